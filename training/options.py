"""Configs of training scripts: a YAML file, then dotted overrides from the command line such as `optim.lr=1e-3`."""

import json
import os
from dataclasses import asdict
from typing import Any, TypeVar

import yaml

from agents.options import read_yaml, validated
from autopoly_env.errors import ConfigError

_Config = TypeVar("_Config")


def read_config(path: str | os.PathLike[str] | None, overrides: list[str], default: _Config) -> _Config:
    """`default` with what the file says and then with the overrides, each `key=value` or `section.key=value`.

    Raises ConfigError, in one line, if the file cannot be read or is no YAML, for a key that there is not, and for a
    value that does not fit.
    """
    values = asdict(default)  # type: ignore[call-overload]
    if path is not None:
        _merge(values, read_yaml(path), str(path))
    for override in overrides:
        key, equals, text = override.partition("=")
        if not (key and equals):
            raise ConfigError(f"override {override!r}: expected section.key=value, such as optim.lr=1e-3")
        nested: Any = _value(override, text)
        for part in reversed(key.split(".")):
            nested = {part: nested}
        _merge(values, nested, f"override {override!r}")
    return build_config(type(default), values, "the config" if path is None else str(path))


def build_config(kind: type[_Config], values: dict[str, Any], where: str) -> _Config:
    """A config of a dataclass from plain values. Raises ConfigError, with `where` they are from."""
    try:
        return validated(kind, values)
    except ConfigError as error:
        raise ConfigError(f"{where}: {error}") from None


def plain(config: Any) -> dict[str, Any]:
    """A config as JSON knows it."""
    values: dict[str, Any] = json.loads(json.dumps(asdict(config)))
    return values


def _merge(values: dict[str, Any], given: dict[Any, Any], where: str) -> None:
    """Put what is given over the values, section by section."""
    for key, value in given.items():
        if key not in values:
            raise ConfigError(f"{where}: unknown option {key!r}; give one of {', '.join(values)}")
        if not isinstance(values[key], dict):
            values[key] = value
        elif isinstance(value, dict):
            _merge(values[key], value, where)
        else:
            raise ConfigError(f"{where}: {key!r} is a section; give one of its options: {', '.join(values[key])}")


def _value(override: str, text: str) -> Any:
    try:
        return yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError):
        raise ConfigError(f"override {override!r}: the value is not YAML; quote it or correct it") from None
