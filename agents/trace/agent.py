"""The `trace` agent: what can be had from the contours of the picture, without trying any modelling action.

For every contour the best polygon of every size is known (`simplify`). A sweep of prices per vertex picks one polygon
each, all are refitted together, and the outline with the best score is told as a construction sequence (`construct`).
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, count

import numpy as np
import shapely

from agents.base import WholeAgent
from agents.budget import Meter
from agents.finish import finish
from agents.solution import Solution
from agents.trace.construct import UnbuildableError, construct
from agents.trace.outline import Outline, outline_of
from agents.trace.reach import Reach
from agents.trace.rings import Ring, signed_area, trace_rings
from agents.trace.simplify import Contour
from autopoly_env.errors import ConfigError
from autopoly_env.refit import LOCAL, THOROUGH
from autopoly_env.score import ScoreWeights
from autopoly_env.simulator import Simulator, State

_REFITS = (LOCAL, THOROUGH)
_HIGHEST_PRICE = 1000.0
_N_FINE = 2  # fine outlines that are refitted, the best as they are


@dataclass(frozen=True)
class TraceConfig:
    """How `trace` simplifies."""

    prices: tuple[float, ...] = (0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0)  # of a vertex, in units of its cost in score
    n_constructed: int = 3  # outlines that are built, the best first, until one keeps all of its rings

    def __post_init__(self) -> None:
        if not self.prices or not self.prices[0] > 0.0 or list(self.prices) != sorted(self.prices):
            raise ConfigError(f"prices {self.prices}: expected at least one, positive and ascending")
        if self.n_constructed < 1:
            raise ConfigError(f"n_constructed {self.n_constructed}: expected at least 1")


class TraceAgent(WholeAgent):
    """Traces, simplifies, refits once or twice per price, and constructs the best."""

    name = "trace"
    config_class = TraceConfig

    def __init__(self, config: TraceConfig) -> None:
        self._config = config

    def _find(self, simulator: Simulator, meter: Meter) -> Solution:
        outlines: list[Outline] = []
        try:
            for outline in self.outlines(simulator, meter):
                outlines.append(outline)
        except KeyboardInterrupt:
            meter.stopped_by = "interrupted"
        if not outlines:
            return finish(simulator, [simulator.initial()], meter)
        outlines.sort(key=lambda outline: -final_total(simulator, outline))
        return finish(simulator, build_best(simulator, outlines, self._config.n_constructed), meter)

    def outlines(self, simulator: Simulator, meter: Meter) -> Iterator[Outline]:
        """All outlines of the sweep that can be built, each refitted in two ways and then as it was.

        Of those that are fine the best two are refitted, in one way.
        """
        pixels = simulator.silhouette.target(simulator.resolution)
        outlines = list(self.sweep(simulator, trace_rings(simulator.silhouette)))
        fine = [k for k, outline in enumerate(outlines) if outline.is_fine]
        rough = sorted(fine, key=lambda k: -final_total(simulator, outlines[k]))[_N_FINE:]
        for k, outline in enumerate(outlines):
            if meter.spent():
                return
            configs = () if k in rough else (LOCAL,) if outline.is_fine else _REFITS
            target = simulator.refit_target(outline.score(pixels, simulator.weights).iou)
            found = [*(outline.refitted(target, config) for config in configs), outline]
            totals = [final_total(simulator, one) for one in found]
            meter.count(len(configs), max(totals), found[totals.index(max(totals))].shape)
            yield from found

    def sweep(self, simulator: Simulator, rings: Sequence[Ring], reach: Reach | None = None) -> Iterator[Outline]:
        """Polygons of the rings from cheap to dear vertices; past the last price on, until one can be built.

        `reach` says what can be, by default with the simulator's operators one vertex after the other.
        """
        if not rings:
            return
        reach = reach or Reach.of(simulator)
        contours = [ring.contour for ring in rings]
        area = float(simulator.silhouette.mask.mean())
        prices = self._config.prices
        wanted = _wanted(rings, simulator.guidance.keep)
        seen: set[tuple[int, ...]] = set()
        found = False
        for price in chain(prices, (prices[-1] * 2.0**k for k in count(1))):
            if price > prices[-1] and (found or price > _HIGHEST_PRICE):
                return
            weights = ScoreWeights(simulator.weights.w_sm, simulator.weights.w_sc * price)
            chosen = list(choose_sizes(rings, contours, weights, area, reach, wanted))
            while any(finer := [_is_short(contour, n, reach) for contour, n in zip(contours, chosen, strict=True)]):
                pairs = zip(contours, finer, strict=True)
                contours = [contour.finer or contour if is_short else contour for contour, is_short in pairs]
                chosen = list(choose_sizes(rings, contours, weights, area, reach, wanted))
            sizes = _without_hidden(rings, chosen)
            if sizes not in seen:
                seen.add(sizes)
                outline = _outline(rings, contours, sizes)
                if reach.allows(outline):
                    found = True
                    yield outline


def _wanted(rings: Sequence[Ring], keep: Collection[str]) -> set[int]:
    """The rings that a user wants kept; a hole is kept with the part around it."""
    holes = {k for k, ring in enumerate(rings) if ring.is_hole} if "holes" in keep else set()
    parts = {k for k, ring in enumerate(rings) if not ring.is_hole} if "parts" in keep else set()
    return holes | parts | {rings[k].parent for k in holes}


def _is_short(contour: Contour, n_vertices: int, reach: Reach) -> bool:
    """Whether a polygon of more vertices than the contour's longest one may be worth its price, and can be built."""
    return contour.n_most == n_vertices < reach.n_steps and contour.finer is not None


def choose_sizes(
    rings: Sequence[Ring],
    contours: Sequence[Contour],
    weights: ScoreWeights,
    area: float,
    reach: Reach,
    wanted: Collection[int] = (),
) -> Iterator[int]:
    """How many vertices each ring is worth, 0 for none; `area` is the silhouette's, in the unit square.

    The error of a polygon, relative to `area`, is about the IoU that it costs. Rings that are `wanted` are not left out
    for what they cost.
    """
    kept: set[int] = set()
    for k, (ring, contour) in enumerate(zip(rings, contours, strict=True)):
        errors = contour.errors
        allowed = reach.sizes(ring, k) if k == 0 or ring.parent in kept | {-1} else range(0)
        sizes = range(allowed.start, min(allowed.stop, len(errors)))
        extra = 3 if ring.is_hole else 1  # edges and faces beyond one edge a vertex
        costs = [weights.w_sm * errors[n] / area + weights.w_sc * (2 * n + extra) for n in sizes]
        worth_it = k == 0 or k in wanted or (sizes and min(costs) < weights.w_sm * abs(signed_area(ring.points)) / area)
        if not sizes or not worth_it:
            yield 0
            continue
        kept.add(k)
        yield sizes[int(np.argmin(costs))]


def _without_hidden(rings: Sequence[Ring], sizes: Sequence[int]) -> tuple[int, ...]:
    """The sizes, but 0 for parts inside a hole that is left out, since they would not show, and for holes in them."""
    kept = np.flatnonzero(sizes).tolist()
    polygons = np.array([shapely.Polygon(rings[k].points) for k in kept])
    layers = np.array([-1 if rings[k].is_hole else 1 for k in kept])
    outer = (k for k in kept if not rings[k].is_hole)
    hidden = {k for k in outer if layers @ shapely.contains_xy(polygons, *rings[k].points[0]) > 0}
    return tuple(
        0 if {k, ring.parent} & hidden else size for k, (ring, size) in enumerate(zip(rings, sizes, strict=True))
    )


def _outline(rings: Sequence[Ring], contours: Sequence[Contour], sizes: Sequence[int]) -> Outline:
    among = [
        Ring(contour.polygon(size), ring.parent) if size else ring
        for ring, contour, size in zip(rings, contours, sizes, strict=True)
    ]
    return outline_of([ring for ring, size in zip(among, sizes, strict=True) if size], among)


def final_total(simulator: Simulator, outline: Outline) -> float:
    """r_all of an outline at the silhouette's own resolution, less what is off it in choosing."""
    target = simulator.silhouette.target(simulator.silhouette.resolution)
    return outline.score(target, simulator.weights).total - simulator.off(outline.loops)


def build_best(simulator: Simulator, outlines: Sequence[Outline], n_most: int) -> list[State]:
    """The best construction of the first `n_most` outlines that can be built, else the initial rectangle.

    The outlines come best first; it stops at the first that loses nothing.
    """
    best: list[State] = []
    best_total = float("-inf")
    n_built = 0
    for outline in outlines:
        if n_built == n_most or final_total(simulator, outline) <= best_total:
            break
        try:
            states = construct(simulator, outline.rings)
        except UnbuildableError:
            continue
        n_built += 1
        total = simulator.worth(states[-1].mesh)
        if total > best_total:
            best, best_total = states, total
    return best or [simulator.initial()]
