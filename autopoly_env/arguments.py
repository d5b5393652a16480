"""Checks of values that people type or files hold, with errors that say what is allowed."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, SupportsFloat, TypeVar

import numpy as np

from autopoly_env.errors import ConfigError
from autopoly_env.shown import short

if TYPE_CHECKING:
    from pydantic import ValidationError

_Value = TypeVar("_Value")


def one_of(name: str, value: _Value, allowed: tuple[_Value, ...]) -> _Value:
    """The value, if it is allowed. Raises ConfigError otherwise."""
    if value not in allowed:
        raise ConfigError(f"{name}={short(value)}: expected one of {', '.join(map(repr, allowed))}")
    return value


def whole(name: str, value: Any, at_least: int = 0) -> int:
    """The value, a whole number of at least so much. Raises ConfigError otherwise."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < at_least:
        raise ConfigError(f"{name}={short(value)}: expected a whole number of at least {at_least}")
    return int(value)


def number(name: str, value: Any) -> float:
    """The value, a finite number. Raises ConfigError otherwise."""
    if isinstance(value, bool) or not isinstance(value, SupportsFloat) or not np.isfinite(float(value)):
        raise ConfigError(f"{name}={short(value)}: expected a number")
    return float(value)


@dataclass(frozen=True)
class Defect:
    """What is wrong with a value: where it stands, what pydantic says of it, and the value itself."""

    place: tuple[int | str, ...]  # names and indices, from the outside inwards
    problem: str
    value: Any

    def __str__(self) -> str:
        return f"{'.'.join(map(str, self.place))}: {self.problem}"


def first_defect(error: "ValidationError") -> Defect:
    """The first of the defects that pydantic has found; as text it is "place: problem", in one line."""
    details = error.errors(include_url=False)[0]
    return Defect(details["loc"], details["msg"], details["input"])
