"""Options in JSON from a page or a file, held to the dataclass that they are of."""

from dataclasses import fields
from typing import Any, TypeVar

from agents.options import validated
from autopoly_env.errors import ConfigError
from autopoly_env.shown import short

_Config = TypeVar("_Config")


def options_of(kind: type[_Config], values: Any, what: str = "") -> _Config:
    """A dataclass of plain values. Raises ConfigError, beginning with `what`, for odd ones and unknown names."""
    if not isinstance(values, dict):
        raise ConfigError(f"{what}expected a JSON object, got {short(values)}")
    known = [one.name for one in fields(kind)]  # type: ignore[arg-type]
    unknown = [name for name in values if name not in known]
    if unknown:
        raise ConfigError(f"{what}{short(unknown[0])} is unknown; expected {', '.join(known)}")
    return validated(kind, values, what)
