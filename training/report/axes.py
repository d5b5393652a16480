"""Axes of a chart: where a value lies, and which values get a tick."""

import math
from dataclasses import dataclass

WIDTH, HEIGHT = 540, 380  # user units of every chart; a screen shows about one pixel for each
LEFT, RIGHT, TOP, BOTTOM = 58, 14, 12, 54  # margins that the ticks and labels need, large ones on phones included
N_TICKS = 6


@dataclass(frozen=True)
class Axis:
    """Values from `low` to `high`, laid out from `start` to `end` in user units, linearly or by their logarithm."""

    low: float
    high: float
    start: float
    end: float
    is_log: bool = False
    is_whole: bool = False  # whether only whole numbers get a tick

    def place(self, value: float) -> float:
        """Where a value lies; what is beyond an end lies at the end."""
        value = min(max(value, self.low), self.high)
        low, high, at = (math.log(v) if self.is_log else v for v in (self.low, self.high, value))
        return self.start + (self.end - self.start) * (at - low) / (high - low)

    def ticks(self) -> list[float]:
        """Round values, about N_TICKS of them: 1, 2 and 5 times a power of ten."""
        if self.is_log:
            return _log_ticks(self.low, self.high)
        return _linear_ticks(self.low, self.high, 1.0 if self.is_whole else 0.0)

    def labelled_ticks(self) -> list[tuple[float, str]]:
        """Where each tick lies, and what stands at it."""
        return [(self.place(tick), tick_label(tick)) for tick in self.ticks()]


def x_axis(low: float, high: float, *, is_log: bool = False, is_whole: bool = False) -> Axis:
    """From left to right."""
    return Axis(*_apart(low, high, is_log), LEFT, WIDTH - RIGHT, is_log, is_whole)


def y_axis(low: float, high: float) -> Axis:
    """From the bottom to the top."""
    return Axis(*_apart(low, high, False), HEIGHT - BOTTOM, TOP)


def number(value: float) -> str:
    """A coordinate, to a tenth of a user unit."""
    return f"{value + 0.0:.1f}".removesuffix(".0")


def tick_label(value: float) -> str:
    """A tick's value as people write it.

    >>> [tick_label(value) for value in (0.05, 1.0, 250.0, 20000.0, 3e6)]
    ['0.05', '1', '250', '20k', '3M']
    """
    for size, letter in ((1e6, "M"), (1e4, "k")):
        if abs(value) >= size:
            return f"{value / (1e3 if letter == 'k' else 1e6):.4g}{letter}"
    return f"{value:.4g}"


def _apart(low: float, high: float, is_log: bool) -> tuple[float, float]:
    """The two ends, apart from each other."""
    if high > low:
        return low, high
    return (low / 1.5, low * 1.5) if is_log else (low - 0.5, high + 0.5)


def _linear_ticks(low: float, high: float, least: float = 0.0) -> list[float]:
    """Ticks that are `least` apart at least."""
    rough = max((high - low) / N_TICKS, least)
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(k * power for k in (1, 2, 5, 10) if k * power >= rough * (1 - 1e-9))
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


def _log_ticks(low: float, high: float) -> list[float]:
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    for factors in ((1, 2, 5), (1, 3), (1,)):
        ticks = [k * 10.0**power for power in powers for k in factors]
        ticks = [tick for tick in ticks if low * (1 - 1e-9) <= tick <= high * (1 + 1e-9)]
        if len(ticks) <= N_TICKS + 2:
            break
    return ticks if len(ticks) > 1 else _linear_ticks(low, high)
