"""Timing on a machine that is shared and noisy: calls take turns, and medians (or minima) are compared."""

import statistics
import timeit
from collections.abc import Callable

Call = Callable[[], object]


def median_seconds(*calls: Call, rounds: int = 101, sample: float = 0.001) -> list[float]:
    """Median seconds of each call.

    Each is first called to warm up. A round measures all of them, one after the other, so that all share the machine's
    moods; quick calls are repeated until a measurement takes about `sample` seconds, less than a turn of the
    operating system, so that most measurements are not cut by another process.
    """
    return [statistics.median(times) for times in _interleaved(calls, rounds, sample)]


def least_seconds(*calls: Call, rounds: int = 101, sample: float = 0.001) -> list[float]:
    """As `median_seconds`, but of the quickest round: what a call costs when no other process is in its way."""
    return [min(times) for times in _interleaved(calls, rounds, sample)]


def _interleaved(calls: tuple[Call, ...], rounds: int, sample: float) -> list[tuple[float, ...]]:
    counts = [_repeats(call, sample) for call in calls]
    measured = [
        [timeit.timeit(call, number=n) / n for call, n in zip(calls, counts, strict=True)] for _ in range(rounds)
    ]
    return list(zip(*measured, strict=True))


def _repeats(call: Call, sample: float) -> int:
    call()
    return max(1, round(sample / min(timeit.repeat(call, number=1, repeat=5))))
