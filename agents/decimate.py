"""`decimate`: from a fine trace, take one vertex after the other, with a refit in the loop, down to the coarsest shape.

Every outline on the way is kept, so it answers any price of complexity, and any limit on the number of vertices. The
order is Visvalingam's (see `agents.trace.simplify_kernels`), but of several least visible vertices the one goes whose
loss the others make up for best.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from agents.base import Meter, Solution, WholeAgent, finish
from agents.trace.agent import TraceAgent, TraceConfig, build_best, final_total
from agents.trace.outline import Outline
from agents.trace.reach import Reach
from agents.trace.rings import Ring
from autopoly_env.arrays import FloatArray
from autopoly_env.errors import ConfigError
from autopoly_env.parallel import map_threads
from autopoly_env.refit import LOCAL, THOROUGH, RefitConfig, RefitTarget
from autopoly_env.simulator import POLISH_RESOLUTION, Simulator, State


@dataclass(frozen=True)
class DecimateConfig:
    """How `decimate` goes down."""

    prices: tuple[float, ...] = (0.12, 0.3)  # of a vertex in the fine outlines to begin with, as `trace` takes them
    n_candidates: int = 6  # vertices that are taken away on trial, those that span the least area
    n_finished: int = 4  # of the best outlines, how many are refitted harder before they are built
    max_vertices: int | None = None  # of the result

    def __post_init__(self) -> None:
        TraceConfig(self.prices)  # raises
        if self.n_candidates < 1 or self.n_finished < 1:
            raise ConfigError(f"{self}: expected n_candidates and n_finished of at least 1")
        if self.max_vertices is not None and self.max_vertices < 4:
            raise ConfigError(f"max_vertices {self.max_vertices}: expected at least 4, the rectangle's")


class DecimateAgent(WholeAgent):
    """Decimates fine traces; returns the best outline on the way that has few enough vertices."""

    name = "decimate"

    def __init__(self, config: DecimateConfig) -> None:
        self._config = config

    def _find(self, simulator: Simulator, meter: Meter) -> Solution:
        found: list[Outline] = []
        try:
            for outline in self.outlines(simulator, meter):
                if self._config.max_vertices is None or n_vertices(outline) <= self._config.max_vertices:
                    found.append(outline)
        except KeyboardInterrupt:
            meter.stopped_by = "interrupted"
        return finish(simulator, self._built(simulator, found), meter)

    def outlines(self, simulator: Simulator, meter: Meter) -> Iterator[Outline]:
        """All outlines on the way down that can be built: of every number of vertices at least one."""
        for price in self._config.prices:
            fine = []
            for outline in TraceAgent(TraceConfig((price,))).outlines(simulator, meter):
                fine.append(outline)
                yield outline
            if fine:
                best = max(fine, key=lambda outline: final_total(simulator, outline))
                yield from self._descent(simulator, best, meter)

    def _descent(self, simulator: Simulator, outline: Outline, meter: Meter) -> Iterator[Outline]:
        """The outline with ever less in it."""
        target = RefitTarget.of(simulator.silhouette, simulator.resolution)
        pixels, reach = simulator.silhouette.target(simulator.resolution), Reach.of(simulator)

        def total(outline: Outline) -> float:
            return outline.score(pixels, simulator.weights).total

        while not meter.spent():
            candidates = list(_coarser(outline, reach, self._config.n_candidates))
            if not candidates:
                return
            fitted = _refit_all(candidates, target, LOCAL)
            outline = max(fitted, key=total)
            yield outline
            meter.count(len(fitted), total(outline))

    def _built(self, simulator: Simulator, found: list[Outline]) -> list[State]:
        """The construction of the best outline, after a last refit as fine as the silhouette; else the rectangle."""
        target = RefitTarget.of(simulator.silhouette, min(POLISH_RESOLUTION, simulator.silhouette.resolution))
        found = sorted(found, key=lambda outline: -final_total(simulator, outline))
        best = found[: self._config.n_finished]
        finished = [*best, *_refit_all(best, target, LOCAL), *_refit_all(best, target, THOROUGH)]
        finished.sort(key=lambda outline: -final_total(simulator, outline))
        return build_best(simulator, finished, len(finished))


def n_vertices(outline: Outline) -> int:
    """Vertices of all rings, which are those of the mesh that has them."""
    return sum(len(ring.points) for ring in outline.rings)


def _refit_all(outlines: list[Outline], target: RefitTarget, config: RefitConfig) -> list[Outline]:
    return map_threads(lambda outline: outline.refitted(target, config), outlines)


def _coarser(outline: Outline, reach: Reach, n_most: int) -> Iterator[Outline]:
    """The outline without each of the vertices that span the least area, and without each further ring."""
    areas = []
    for k, ring in enumerate(outline.rings):
        if len(ring.points) - 1 in reach.sizes(ring, k):
            areas += [(area, k, i) for i, area in enumerate(_spanned(ring.points).tolist())]
    for _, k, i in sorted(areas)[:n_most]:
        ring = outline.rings[k]
        yield outline.with_ring(k, Ring(np.delete(ring.points, i, axis=0), ring.parent))
    yield from (outline.without_ring(k) for k in range(1, len(outline.rings)))


def _spanned(points: FloatArray) -> FloatArray:
    """(n,) area of the triangle of each vertex and its two neighbours."""
    u, v = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
    return 0.5 * np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
