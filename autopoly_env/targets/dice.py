"""`Dice`: all the randomness of a target, from its seed."""

import math
from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from autopoly_env.arrays import FloatArray
from autopoly_env.errors import ConfigError
from autopoly_env.targets.source import N_SEEDS

_N_AHEAD = 512  # numbers drawn at once: one by one they take longer
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
        self._drawn, self._n_used = np.empty(0), 0

    def ahead(self, n: int) -> FloatArray:
        """The next draws, n or more, each 0 <= x < 1, of which none is used yet."""
        if len(self._drawn) - self._n_used < n:
            more = self._rng.random(max(n, _N_AHEAD))
            self._drawn, self._n_used = np.concatenate((self._drawn[self._n_used :], more)), 0
        return self._drawn[self._n_used :]

    def use(self, n: int) -> FloatArray:
        """The next n draws."""
        drawn = self.ahead(n)[:n]
        self.skip(n)
        return drawn

    def skip(self, n: int) -> None:
        """Count n draws of `ahead` as used."""
        self._n_used += n

    def between(self, low: float, high: float) -> float:
        """A number, low <= x < high."""
        return low + (high - low) * self._draw()

    def whole(self, low: int, high: int) -> int:
        """A whole number, both ends included."""
        return low + int((high - low + 1) * self._draw())

    def chance(self, probability: float) -> bool:
        """True that often."""
        return self._draw() < probability

    def pick(self, options: Sequence[_Option]) -> _Option:
        """One of the options, all equally likely."""
        return options[int(len(options) * self._draw())]

    def array(self, *shape: int) -> FloatArray:
        """Numbers between -1 and 1."""
        return 2.0 * self.use(math.prod(shape)).reshape(shape) - 1.0

    def order(self, n: int) -> list[int]:
        """The numbers 0..n-1, shuffled."""
        return np.argsort(self.use(n), kind="stable").tolist()

    def _draw(self) -> float:
        if self._n_used == len(self._drawn):
            self.ahead(1)
        self._n_used += 1
        return float(self._drawn[self._n_used - 1])
