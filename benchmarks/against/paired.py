"""What pairs of measurements say: the median of their ratios, and an interval around it."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb
from statistics import median

_CONFIDENCE = 0.95


@dataclass(frozen=True)
class Spread:
    """A median and where it may lie."""

    middle: float
    low: float
    high: float


def spread_of(values: Sequence[float]) -> Spread:
    """The median and its 95 % interval, which follows from the signs alone and supposes nothing of how values lie.

    The k-th least and the k-th greatest of n values hold the median between them unless fewer than k of n coins fall on
    one side. Of fewer than six values, too few for 95 %, it is the least and the greatest.

    >>> spread_of([3.0, 1.0, 2.0, 5.0, 4.0, 6.0, 7.0, 8.0, 9.0])
    Spread(middle=5.0, low=2.0, high=8.0)
    """
    ordered = sorted(values)
    k = _rank(len(ordered))
    return Spread(median(ordered), ordered[k - 1], ordered[-k])


def _rank(n: int) -> int:
    """The largest k of which the interval is sure enough, at least 1."""
    k, outside = 0, 0.0
    while k < n and outside + comb(n, k) / 2**n <= 0.5 * (1.0 - _CONFIDENCE):
        outside += comb(n, k) / 2**n
        k += 1
    return max(1, k)
