"""`Dice`: all the randomness of a target, from its seed."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from autopoly_env.arrays import FloatArray
from autopoly_env.errors import ConfigError
from autopoly_env.targets.source import N_SEEDS

_Option = TypeVar("_Option")


class Dice:
    """Random draws that are the same on every machine and with every version of NumPy.

    Everything is made from uniform doubles of PCG64, whose stream NumPy keeps; how it makes integers or shuffles out
    of them may change. `salt` keeps the sources apart: the same seed means something else to each.
    """

    def __init__(self, salt: int, seed: int) -> None:
        """Raises ConfigError for a seed outside 0..2**32 - 1."""
        if not 0 <= seed < N_SEEDS:
            raise ConfigError(f"seed {seed} is out of range; give 0..{N_SEEDS - 1}")
        self._rng = np.random.default_rng([salt, int(seed)])

    def between(self, low: float, high: float) -> float:
        """A number, low <= x < high."""
        return low + (high - low) * self._rng.random()

    def whole(self, low: int, high: int) -> int:
        """A whole number, both ends included."""
        return low + int((high - low + 1) * self._rng.random())

    def chance(self, probability: float) -> bool:
        """True that often."""
        return self._rng.random() < probability

    def pick(self, options: Sequence[_Option]) -> _Option:
        """One of the options, all equally likely."""
        return options[int(len(options) * self._rng.random())]

    def array(self, *shape: int) -> FloatArray:
        """Numbers between -1 and 1."""
        return 2.0 * self._rng.random(shape) - 1.0

    def order(self, n: int) -> list[int]:
        """The numbers 0..n-1, shuffled."""
        return np.argsort(self._rng.random(n), kind="stable").tolist()
