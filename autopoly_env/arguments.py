"""Checks of values that people type or files hold, with errors that say what is allowed."""

import math
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, SupportsFloat, TypeVar

import numpy as np

from autopoly_env.errors import ConfigError
from autopoly_env.shown import short

if TYPE_CHECKING:
    from pydantic import ValidationError

_Value = TypeVar("_Value")

LARGEST = 2**63 - 1  # whole number that kernels and random numbers take


def is_count(text: str) -> bool:
    """Whether a text is a whole number from 0, of at most 18 digits."""
    return text.isascii() and text.isdecimal() and len(text) <= 18


def one_of(name: str, value: _Value, allowed: tuple[_Value, ...]) -> _Value:
    """The value, if it is allowed. Raises ConfigError otherwise."""
    if value not in allowed:
        raise ConfigError(f"{name}={short(value)}: expected one of {', '.join(map(repr, allowed))}")
    return value


def whole(name: str, value: Any, at_least: int = 0, at_most: int = LARGEST) -> int:
    """The value, a whole number of at least and at most so much. Raises ConfigError otherwise."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not at_least <= value <= at_most:
        bounds = f"of at least {at_least}" + (f", at most {at_most}" if at_most < LARGEST else "")
        raise ConfigError(f"{name}={short(value)}: expected a whole number {bounds}")
    return int(value)


def at_least(bound: float, **values: float) -> None:
    """Raise ConfigError that names the first of the values which is no finite number of at least so much."""
    for name, value in values.items():
        if not bound <= value < math.inf:
            raise ConfigError(f"{name}={short(value)}: expected a number of at least {bound:g}")


def above(bound: float, **values: float) -> None:
    """Raise ConfigError that names the first of the values which is no finite number above so much."""
    for name, value in values.items():
        if not bound < value < math.inf:
            raise ConfigError(f"{name}={short(value)}: expected a number above {bound:g}")


def share(**values: float) -> None:
    """Raise ConfigError that names the first of the values which is not from 0 to 1."""
    for name, value in values.items():
        if not 0.0 <= value <= 1.0:
            raise ConfigError(f"{name}={short(value)}: expected a share, 0 to 1")


def number(name: str, value: Any) -> float:
    """The value, a finite number. Raises ConfigError otherwise."""
    found = float("nan")
    if not isinstance(value, bool) and isinstance(value, SupportsFloat):
        with suppress(OverflowError, TypeError, ValueError):
            found = float(value)
    if not math.isfinite(found):
        raise ConfigError(f"{name}={short(value)}: expected a number")
    return found


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
