"""Checks of arguments that people type, with errors that say what is allowed."""

from typing import Any, SupportsFloat, TypeVar

import numpy as np

from autopoly_env.errors import ConfigError

_Value = TypeVar("_Value")


def one_of(name: str, value: _Value, allowed: tuple[_Value, ...]) -> _Value:
    """The value, if it is allowed. Raises ConfigError otherwise."""
    if value not in allowed:
        raise ConfigError(f"{name}={value!r}: expected one of {', '.join(map(repr, allowed))}")
    return value


def whole(name: str, value: Any, at_least: int = 0) -> int:
    """The value, a whole number of at least so much. Raises ConfigError otherwise."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < at_least:
        raise ConfigError(f"{name}={value!r}: expected a whole number of at least {at_least}")
    return int(value)


def number(name: str, value: Any) -> float:
    """The value, a finite number. Raises ConfigError otherwise."""
    if isinstance(value, bool) or not isinstance(value, SupportsFloat) or not np.isfinite(float(value)):
        raise ConfigError(f"{name}={value!r}: expected a number")
    return float(value)
