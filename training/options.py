"""Configs of training scripts: a YAML file, then dotted overrides from the command line such as `optim.lr=1e-3`."""

import json
import os
import re
from collections.abc import Collection
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeVar

from agents.options import put_override, read_yaml, validated
from autopoly_env.errors import ConfigError, RunError
from autopoly_env.files import write_atomically

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
        nested: dict[Any, Any] = {}
        put_override(nested, override, f"override {override!r}", "optim.lr=1e-3")
        _merge(values, nested, f"override {override!r}")
    try:
        return validated(type(default), values)
    except ConfigError as error:
        typed = [override for override in overrides if re.match(_key_of(override), str(error))]
        where = f"override {typed[-1]!r}" if typed else "the config" if path is None else path
        raise ConfigError(f"{where}: {error}") from None


def build_config(kind: type[_Config], values: dict[str, Any], where: str) -> _Config:
    """A config of a dataclass from plain values. Raises ConfigError, with `where` they are from."""
    try:
        return validated(kind, values)
    except ConfigError as error:
        raise ConfigError(f"{where}: {error}") from None


def plain(config: Any) -> dict[str, Any]:
    """A config as JSON knows it. Raises ConfigError for what that cannot hold, such as a date or NaN."""
    try:
        values: dict[str, Any] = json.loads(json.dumps(asdict(config), allow_nan=False))
    except (TypeError, ValueError, RecursionError) as error:
        raise ConfigError(f"the settings cannot be written as JSON ({error}); give plain values") from None
    return values


def check_same_run(folder: Path, known: Any, given: Any, harmless: Collection[str]) -> None:
    """Raise RunError, which names the first setting that differs, unless a run may go on with what is given.

    `harmless` settings may differ.
    """
    key = _first_difference(known, given, harmless)
    if key:
        raise RunError(f"{folder} belongs to a run with another {key}; give another --out, or the same settings")


def claim_run(folder: Path, settings: dict[str, Any], harmless: Collection[str]) -> None:
    """Note the settings of a run that begins, in settings.json, for it may be killed before its first checkpoint.

    Raises RunError as `check_same_run` where a run with other ones has begun there, OutputError where nothing can be
    written.
    """
    path = folder / "settings.json"
    try:
        known = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):  # none yet, or half of them
        known = None
    if known is not None:
        check_same_run(folder, known, settings, harmless)
    write_atomically(path, json.dumps(settings, indent=2) + "\n")


def _first_difference(one: Any, other: Any, harmless: Collection[str], key: str = "") -> str:
    """The dotted key of the first setting that is not the same in both; empty if there is none."""
    if not (isinstance(one, dict) and isinstance(other, dict)):
        return "" if one == other else key
    for name in sorted((one.keys() | other.keys()) - set(harmless)):
        found = _first_difference(one.get(name), other.get(name), harmless, f"{key}.{name}".lstrip("."))
        if found:
            return found
    return ""


def _key_of(override: str) -> str:
    """A pattern of the key of `key=value`, or of what is in it."""
    return re.escape(override.partition("=")[0]) + r"\b"


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
