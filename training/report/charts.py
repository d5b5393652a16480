"""The charts of a report: score against complexity, and score against work."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from autopoly_env.arrays import FloatArray
from training.records import Outcome
from training.report.axes import Axis, number, x_axis, y_axis
from training.report.comparison import Comparison, Series
from training.report.statistics import bootstrap_means

N_MARKERS = 5  # in templates/charts.html
N_COLOURS = 8
N_POINTS = 72  # of a curve
MOST_POINTS = 6000  # of a scatter; beyond, only every second, third, ... target is drawn
SPREAD = 0.7  # of the space between two whole numbers that the points of one of them may fill


@dataclass(frozen=True)
class Curves:
    """Mean r_all over targets against work: `grid` (N,); `means`, `low`, `high` (S, N), NaN where not all targets
    have a shape yet or the series is over."""

    grid: FloatArray
    means: FloatArray
    low: FloatArray
    high: FloatArray


@dataclass(frozen=True)
class Chart:
    """A frame with its axes and labels."""

    x: Axis
    y: Axis
    x_label: str
    y_label: str
    title: str


@dataclass(frozen=True)
class Point:
    """Where a target of a series lies, in user units; `target` is its place in the comparison, -1 for a mean."""

    series: int
    x: float
    y: float
    target: int = -1


@dataclass(frozen=True)
class Scatter(Chart):
    """r_sm against `value`: a point for every target and series, a larger one for each series' mean."""

    value: str
    points: list[Point]
    means: list[Point]


@dataclass(frozen=True)
class BandedLine:
    """A curve as paths of SVG: the line, its 95 % band, and where it ends."""

    series: int
    path: str
    band: str
    end: tuple[float, float]


@dataclass(frozen=True)
class Anytime(Chart):
    """Mean r_all against `work` so far, a line for every series."""

    work: str
    lines: list[BandedLine]


def colour_class(i: int) -> str:
    """The style class with the colour of series number i."""
    return f"s{i % N_COLOURS}"


def marker(i: int) -> int:
    """Which of the marks series number i has: colours come round again before the pairs of both do."""
    return (i + i // N_COLOURS) % N_MARKERS


def scatter_points(comparison: Comparison) -> list[tuple[int, int, Outcome]]:
    """(target, series, outcome) of what a scatter draws, both as their places in the comparison."""
    step = math.ceil(sum(len(series.outcomes) for series in comparison.series) / MOST_POINTS)
    places = {name: t for t, name in enumerate(comparison.targets) if t % max(step, 1) == 0}
    return [
        (places[target], i, outcome)
        for i, series in enumerate(comparison.series)
        for target, outcome in series.outcomes
        if target in places
    ]


def scatter(comparison: Comparison, value: str) -> Scatter:
    """The scatter of "r_sc" or "r_si"."""
    spots = [(t, i, float(getattr(outcome, value)), outcome.r_sm) for t, i, outcome in scatter_points(comparison)]
    x, label = _complexity_axis(value, [at for *_, at, _ in spots] or [1.0])
    y = y_axis(_floor([r_sm for *_, r_sm in spots], 0.05), 1.0)
    aside = _lanes(len(comparison.series)) if x.is_whole else np.zeros(len(comparison.series))
    points = [Point(i, x.place(at + aside[i]), y.place(r_sm), t) for t, i, at, r_sm in spots]
    means = _mean_points(comparison.series, value, x, y)
    return Scatter(x, y, label, "r_sm: IoU", f"IoU against {value}", value, points, means)


def _complexity_axis(value: str, found: Sequence[float]) -> tuple[Axis, str]:
    if value == "r_si":
        label = "r_si: self-intersections (spread within a number)"
        return x_axis(-0.5, max(found) + 0.5, is_whole=True), label
    low, high = max(min(found), 1.0), max(max(found), 1.0)
    return x_axis(0.9 * low, 1.1 * high, is_log=True), "r_sc: vertices + edges + faces (log scale)"


def anytime(curves: Curves, work: str) -> Anytime:
    """The chart of the curves against "refits" or "seconds"."""
    known = curves.means[np.isfinite(curves.means)]
    x = x_axis(float(curves.grid[0]), float(curves.grid[-1]), is_log=True)
    y = y_axis(_floor(known.tolist(), 5.0), float(np.nanmax(curves.high, initial=1.0)))
    lines = [_line(curves, i, x, y) for i in range(len(curves.means)) if np.isfinite(curves.means[i]).any()]
    label = "best r_all so far, mean over targets"
    return Anytime(x, y, f"{work} (log scale)", label, f"r_all against {work}", work, lines)


def _line(curves: Curves, i: int, x: Axis, y: Axis) -> BandedLine:
    """The curve of series number i, where it is known."""
    shown = np.flatnonzero(np.isfinite(curves.means[i]))
    places = [x.place(at) for at in curves.grid[shown]]
    middle, low, high = (
        [f"{number(a)} {number(y.place(v))}" for a, v in zip(places, values[i, shown], strict=True)]
        for values in (curves.means, curves.low, curves.high)
    )
    end = places[-1], y.place(curves.means[i, shown[-1]])
    return BandedLine(i, f"M{'L'.join(middle)}", f"M{'L'.join(high + low[::-1])}Z", end)


def curves_of(comparison: Comparison, column: int) -> Curves:
    """The anytime curves against column 0 (refits) or 1 (seconds) of the records' curves."""
    curves = [[o.curve for _, o in series.outcomes if o.curve] for series in comparison.series]
    starts = [max(curve[0][column] for curve in own) for own in curves if own]
    ends = [row[column] for own in curves for curve in own for row in curve if row[column] > 0]
    first, last = max(min(starts, default=1.0), min(ends, default=1.0)), max(ends, default=10.0)
    grid = np.geomspace(first, max(last, 1.01 * first), N_POINTS)
    stacked = [_curves_of(series, grid, column) for series in comparison.series]
    means, low, high = (np.array([parts[k] for parts in stacked]) for k in range(3))
    return Curves(grid, means, low, high)


def _curves_of(series: Series, grid: FloatArray, column: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mean and interval (N,) of one series, from where all its targets have a shape to where all are over."""
    by_target: dict[str, list[FloatArray]] = {}
    for target, outcome in series.outcomes:
        if outcome.curve:
            by_target.setdefault(target, []).append(_held(outcome, grid, column))
    if not by_target:
        empty = np.full(len(grid), np.nan)
        return empty, empty, empty
    values = np.array([np.mean(held, axis=0) for held in by_target.values()])
    last = max(row[column] for _, outcome in series.outcomes for row in outcome.curve)
    shown = np.isfinite(values).all(axis=0) & (np.append(grid[0], grid[:-1]) <= last)
    means, low, high = bootstrap_means(np.where(shown, values, 0.0))
    return tuple(np.where(shown, one, np.nan) for one in (means, low, high))  # type: ignore[return-value]


def _held(outcome: Outcome, grid: FloatArray, column: int) -> FloatArray:
    """(N,) the best r_all by each point of the grid; NaN before the first."""
    work = np.array([row[column] for row in outcome.curve], np.float64)
    best = np.maximum.accumulate([row[2] for row in outcome.curve])
    index = np.searchsorted(work, grid * (1.0 + 1e-9), side="right") - 1
    return np.where(index >= 0, best[np.maximum(index, 0)], np.nan)


def _mean_points(series: Sequence[Series], value: str, x: Axis, y: Axis) -> list[Point]:
    points = []
    for i, one in enumerate(series):
        outcomes = [outcome for _, outcome in one.outcomes]
        if outcomes:
            at = x.place(float(np.mean([getattr(outcome, value) for outcome in outcomes])))
            points.append(Point(i, at, y.place(float(np.mean([outcome.r_sm for outcome in outcomes])))))
    return points


def _lanes(n_series: int) -> FloatArray:
    """How far beside a whole number the points of each series lie."""
    return SPREAD * ((np.arange(n_series) + 0.5) / n_series - 0.5)


def _floor(values: Sequence[float], step: float) -> float:
    """The least value, rounded down to a step."""
    return float(np.floor(min(values, default=0.0) / step) * step)
