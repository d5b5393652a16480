"""Packages that some formats need and not every installation has."""

from importlib import import_module
from typing import Any

from autopoly_env.errors import ConfigError


def need(module: str, package: str, extra: str) -> Any:
    """The module. Raises ConfigError, which names the extra that has its package, where it is not installed."""
    try:
        return import_module(module)
    except ImportError:
        advice = f"pip install -e '.[{extra}]' in the checkout"
        raise ConfigError(f"{extra} needs the package {package}, which is not installed: {advice}") from None
