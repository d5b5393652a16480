"""The `trace` agent: what can be had from the contours of the picture, without trying any modelling action.

For every contour the best polygon of every size is known (`simplify`). A sweep of prices per vertex picks one polygon
each, all are refitted together, and the outline with the best score is told as a construction sequence (`construct`).
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from agents.base import Agent, Budget, Decision, Meter, Progress, Solution, finish
from agents.trace.construct import construct
from agents.trace.outline import Outline, outline_of
from agents.trace.rings import Ring, signed_area, trace_rings
from agents.trace.simplify import Contour
from autopoly_env.actions import STOP
from autopoly_env.refit import RefitConfig, RefitTarget
from autopoly_env.simulator import Simulator, State
from autopoly_env.score import ScoreWeights

_REFITS = (RefitConfig(first_level=2), RefitConfig(first_level=1, n_far=60))


@dataclass(frozen=True)
class TraceConfig:
    """How `trace` simplifies."""

    prices: tuple[float, ...] = (0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0)  # of a vertex, in units of its cost in score
    n_constructed: int = 3  # outlines that are built, the best first, until one keeps all of its rings


class TraceAgent(Agent):
    """Traces, simplifies, refits once or twice per price, and constructs the best."""

    name = "trace"

    def __init__(self, config: TraceConfig) -> None:
        self._config = config

    def act(self, simulator: Simulator, state: State) -> Decision:
        """Always STOP: the trace is found as a whole, by `solve`."""
        return Decision(STOP)

    def solve(
        self,
        simulator: Simulator,
        budget: Budget | None = None,
        on_progress: Callable[[Progress], None] | None = None,
    ) -> Solution:
        meter = Meter(budget or Budget(), on_progress)
        outlines = self.outlines(simulator, meter)
        if not outlines:
            return finish(simulator, [simulator.initial()], meter)
        return finish(simulator, build_best(simulator, outlines, self._config.n_constructed), meter)

    def outlines(self, simulator: Simulator, meter: Meter) -> list[Outline]:
        """All outlines of the sweep, refitted or not, the best score first."""
        rings = trace_rings(simulator.silhouette)
        if not rings:
            return []
        target = RefitTarget.of(simulator.silhouette, simulator.resolution)
        found = []
        for outline in self._sweep(simulator, rings):
            fitted = [outline.refitted(target, config) for config in _REFITS]
            found += [outline, *fitted]
            meter.count(len(fitted), max(final_total(simulator, o) for o in (outline, *fitted)))
            if meter.spent():
                break
        return sorted(found, key=lambda outline: -final_total(simulator, outline))

    def _sweep(self, simulator: Simulator, rings: Sequence[Ring]) -> Iterator[Outline]:
        contours = [Contour(ring.points) for ring in rings]
        area = float(simulator.silhouette.mask.mean())
        seen = set()
        for price in self._config.prices:
            weights = ScoreWeights(w_sc=simulator.weights.w_sc * price)
            sizes = tuple(choose_sizes(rings, contours, weights, area, "face_hole" in simulator.operators))
            if sizes not in seen:
                seen.add(sizes)
                kept = [k for k, size in enumerate(sizes) if size]
                polygons = [Ring(contours[k].polygon(sizes[k]), rings[k].parent) for k in kept]
                among = list(rings)
                for k, polygon in zip(kept, polygons, strict=True):
                    among[k] = polygon
                yield outline_of(polygons, among)


def choose_sizes(
    rings: Sequence[Ring], contours: Sequence[Contour], weights: ScoreWeights, area: float, with_holes: bool
) -> Iterator[int]:
    """How many vertices each ring is worth, 0 for none; `area` is the silhouette's, in the unit square.

    The error of a polygon, relative to `area`, is about the IoU that it costs.
    """
    kept: set[int] = set()
    for k, (ring, contour) in enumerate(zip(rings, contours, strict=True)):
        if ring.is_hole and (not with_holes or ring.parent not in kept):
            yield 0
            continue
        errors = contour.errors
        extra = 3 if ring.is_hole else 1  # edges and faces beyond one edge a vertex
        cost = weights.w_sm * errors / area + weights.w_sc * (2 * np.arange(len(errors)) + extra)
        size = int(np.argmin(cost))
        if k > 0 and cost[size] >= weights.w_sm * abs(signed_area(ring.points)) / area:
            yield 0
            continue
        kept.add(k)
        yield size


def final_total(simulator: Simulator, outline: Outline) -> float:
    """r_all of an outline at the silhouette's own resolution."""
    return outline.score(simulator.silhouette.target(simulator.silhouette.resolution), simulator.weights).total


def build_best(simulator: Simulator, outlines: Sequence[Outline], n_most: int) -> list[State]:
    """The best construction of the first outlines, which come best first; stops at the first that loses nothing."""
    best: list[State] = []
    best_total = float("-inf")
    for outline in outlines[:n_most]:
        expected = final_total(simulator, outline)
        if expected <= best_total:
            break
        states = construct(simulator, outline.rings)
        total = simulator.final_score(states[-1].mesh).total
        if total > best_total:
            best, best_total = states, total
    return best
