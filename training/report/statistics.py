"""Means with bootstrap intervals: how much a mean over these targets says about others like them."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from autopoly_env.arrays import FloatArray

N_RESAMPLES = 2000
LEVEL = 0.95


class Interval(NamedTuple):
    """A mean and the ends of its 95 % interval; NaN where there are no values."""

    mean: float
    low: float
    high: float


def bootstrap_mean(values: FloatArray) -> Interval:
    """Mean of values (N,) and the percentile bootstrap's interval (Efron 1979). The same values give the same."""
    if not len(values):
        return Interval(np.nan, np.nan, np.nan)
    means, low, high = bootstrap_means(np.asarray(values, np.float64)[:, None])
    return Interval(float(means[0]), float(low[0]), float(high[0]))


def bootstrap_means(values: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Means (K,) of the columns of values (N, K), N at least 1, and the ends of their intervals; rows are drawn."""
    low, high = np.quantile(_weights(len(values)) @ values, (0.5 - LEVEL / 2, 0.5 + LEVEL / 2), axis=0)
    return values.mean(axis=0), low, high


@lru_cache(maxsize=8)
def _weights(n: int) -> FloatArray:
    """(N_RESAMPLES, n) the share that each of n values has in each resample."""
    return np.random.default_rng(0).multinomial(n, np.full(n, 1.0 / n), N_RESAMPLES) / n
