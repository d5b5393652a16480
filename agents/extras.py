"""Packages that not every installation has."""

from importlib import import_module

from autopoly_env.errors import ConfigError


def require(extra: str, who: str, *packages: str) -> None:
    """Import the packages that `who` needs. Raises ConfigError, which names the extra that has them."""
    try:
        for package in packages:
            import_module(package)
    except ImportError as error:
        raise ConfigError(
            f"{who} needs the package {error.name}, which is not installed: pip install -e '.[{extra}]' in the checkout"
        ) from None
