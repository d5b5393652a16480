"""The charts of a report: score against complexity, and score against work."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from autopoly_env.arrays import FloatArray
from training.records import Outcome
from training.report.axes import Axis, frame, number, x_axis, y_axis
from training.report.comparison import Comparison, Series
from training.report.statistics import bootstrap_means

MARKERS = (
    '<circle r="4"/>',
    '<path d="M-3.7-3.7h7.4v7.4h-7.4z"/>',
    '<path d="M0-4.9L4.6 3.4H-4.6z"/>',
    '<path d="M0-5.2L5.2 0 0 5.2-5.2 0z"/>',
    '<path d="M0 4.9L4.6-3.4H-4.6z"/>',
)
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


def colour_class(i: int) -> str:
    """The style class with the colour of series number i."""
    return f"s{i % N_COLOURS}"


def marker(i: int) -> int:
    """Which of MARKERS series number i has: colours come round again before the pairs of both do."""
    return (i + i // N_COLOURS) % len(MARKERS)


def marker_symbols() -> str:
    """The markers, to be used as #m0, #m1, ..."""
    return "".join(f'<g id="m{k}">{shape}</g>' for k, shape in enumerate(MARKERS))


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


def scatter(comparison: Comparison, value: str) -> str:
    """r_sm against "r_sc" or "r_si": a point for every target and series, a larger one for each series' mean."""
    spots = [(t, i, float(getattr(outcome, value)), outcome.r_sm) for t, i, outcome in scatter_points(comparison)]
    x, label = _complexity_axis(value, [at for *_, at, _ in spots] or [1.0])
    y = y_axis(_floor([r_sm for *_, r_sm in spots], 0.05), 1.0)
    aside = _lanes(len(comparison.series)) if x.is_whole else np.zeros(len(comparison.series))
    points = [
        f'<use href="#m{marker(i)}" class="point {colour_class(i)}" data-s="{i}" data-t="{t}"'
        f' x="{number(x.place(at + aside[i]))}" y="{number(y.place(r_sm))}"/>'
        for t, i, at, r_sm in spots
    ]
    points += _mean_points(comparison.series, value, x, y)
    return frame(x, y, label, "r_sm: IoU", f"IoU against {value}", "\n".join(points))


def _complexity_axis(value: str, found: Sequence[float]) -> tuple[Axis, str]:
    if value == "r_si":
        label = "r_si: self-intersections (spread within a number)"
        return x_axis(-0.5, max(found) + 0.5, is_whole=True), label
    low, high = max(min(found), 1.0), max(max(found), 1.0)
    return x_axis(0.9 * low, 1.1 * high, is_log=True), "r_sc: vertices + edges + faces (log scale)"


def anytime(curves: Curves, labels: Sequence[str], work: str) -> str:
    """Mean r_all against refits or seconds so far, a line and its 95 % band for every series."""
    known = curves.means[np.isfinite(curves.means)]
    x = x_axis(float(curves.grid[0]), float(curves.grid[-1]), is_log=True)
    y = y_axis(_floor(known.tolist(), 5.0), float(np.nanmax(curves.high, initial=1.0)))
    bands, lines = [], []
    for i in range(len(labels)):
        shown = np.flatnonzero(np.isfinite(curves.means[i]))
        if not shown.size:
            continue
        at = [number(x.place(curves.grid[k])) for k in shown]
        middle, low, high = (
            [f"{a} {number(y.place(v))}" for a, v in zip(at, values[i, shown], strict=True)]
            for values in (curves.means, curves.low, curves.high)
        )
        own = f'class="{colour_class(i)}" data-s="{i}"'
        bands.append(f'<path {own} d="M{"L".join(high + low[::-1])}Z"/>')
        end = f'<use href="#m{marker(i)}" {own} x="{at[-1]}" y="{middle[-1].split()[1]}"/>'
        lines.append(f'<path {own} d="M{"L".join(middle)}"/>{end}')
    body = f'<g class="bands">{"".join(bands)}</g><g class="lines">{"".join(lines)}</g><path class="cursor"/>'
    return frame(x, y, f"{work} (log scale)", "best r_all so far, mean over targets", f"r_all against {work}", body)


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


def _mean_points(series: Sequence[Series], value: str, x: Axis, y: Axis) -> list[str]:
    points = []
    for i, one in enumerate(series):
        outcomes = [outcome for _, outcome in one.outcomes]
        if outcomes:
            at = x.place(float(np.mean([getattr(outcome, value) for outcome in outcomes])))
            r_sm = y.place(float(np.mean([outcome.r_sm for outcome in outcomes])))
            place = f"translate({number(at)} {number(r_sm)}) scale(2.1)"
            points.append(
                f'<use href="#m{marker(i)}" class="mean {colour_class(i)}" data-s="{i}" transform="{place}"/>'
            )
    return points


def _lanes(n_series: int) -> FloatArray:
    """How far beside a whole number the points of each series lie."""
    return SPREAD * ((np.arange(n_series) + 0.5) / n_series - 0.5)


def _floor(values: Sequence[float], step: float) -> float:
    """The least value, rounded down to a step."""
    return float(np.floor(min(values, default=0.0) / step) * step)
