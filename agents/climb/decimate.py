"""`decimate`: from a fine trace, take one vertex after the other, with a refit in the loop, down to the coarsest shape.

Every outline on the way is kept, so it answers any price of complexity, and any limit on the number of vertices. The
order is Visvalingam's (see `agents.trace.simplify_kernels`), but of several least visible vertices the one goes whose
loss the others make up for best.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from agents.base import WholeAgent
from agents.budget import Meter
from agents.climb.hill import Hill, Place, total_of
from agents.climb.tops import Tops
from agents.finish import finish
from agents.solution import Solution
from agents.trace.agent import TraceAgent, TraceConfig
from agents.trace.outline import Outline
from agents.trace.reach import Reach
from autopoly_env.arrays import FloatArray
from autopoly_env.errors import ConfigError
from autopoly_env.refit import LOCAL
from autopoly_env.simulator import Simulator


@dataclass(frozen=True)
class DecimateConfig:
    """How `decimate` goes down."""

    prices: tuple[float, ...] = (0.12, 0.3)  # of a vertex in the fine outlines to begin with, as `trace` takes them
    n_candidates: int = 6  # vertices that are taken away on trial, those that span the least area
    max_vertices: int | None = None  # of the result

    def __post_init__(self) -> None:
        TraceConfig(self.prices)  # raises
        if self.n_candidates < 1:
            raise ConfigError(f"n_candidates {self.n_candidates}: expected at least 1")
        if self.max_vertices is not None and self.max_vertices < 4:
            raise ConfigError(f"max_vertices {self.max_vertices}: expected at least 4, the rectangle's")


class DecimateAgent(WholeAgent):
    """Decimates fine traces; returns the best outline on the way that has few enough vertices."""

    name = "decimate"
    config_class = DecimateConfig

    def __init__(self, config: DecimateConfig) -> None:
        self._config = config

    def _find(self, simulator: Simulator, meter: Meter) -> Solution:
        tops = Tops(Hill(simulator))
        try:
            for place in self.places(tops.hill, meter):
                if self._config.max_vertices is None or n_vertices(place.outline) <= self._config.max_vertices:
                    tops.add(place)
        except KeyboardInterrupt:
            meter.stopped_by = "interrupted"
        return finish(simulator, tops.built(), meter)

    def places(self, hill: Hill, meter: Meter) -> Iterator[Place]:
        """All outlines on the way down that can be built: of every number of vertices at least one."""
        for price in self._config.prices:
            fine = []
            for outline in TraceAgent(TraceConfig((price,))).outlines(hill.simulator, meter):
                fine.append(hill.place(outline))
                yield fine[-1]
            coarse = [place for place in fine if not place.outline.is_fine]
            if coarse:
                yield from self._descent(hill, max(coarse, key=total_of), meter)

    def _descent(self, hill: Hill, place: Place, meter: Meter) -> Iterator[Place]:
        """The outline with ever less in it."""
        while not meter.spent():
            candidates = list(_coarser(place.outline, hill.reach, self._config.n_candidates))
            if not candidates:
                return
            places = hill.fit(candidates, LOCAL, place.score.iou)
            place = max(places, key=total_of)
            yield place
            meter.count(len(places), place.total, place.mesh)


def n_vertices(outline: Outline) -> int:
    """Vertices of all rings, which are those of the mesh that has them."""
    return sum(len(ring.points) for ring in outline.rings)


def _coarser(outline: Outline, reach: Reach, n_most: int) -> Iterator[Outline]:
    """The outline without each of the vertices that span the least area, and without each further ring."""
    areas = []
    for k, ring in enumerate(outline.rings):
        if len(ring.points) - 1 in reach.sizes(ring, k):
            areas += [(area, k, i) for i, area in enumerate(_spanned(ring.points).tolist())]
    for _, k, i in sorted(areas)[:n_most]:
        ring = outline.rings[k]
        yield outline.with_ring(k, ring.without(i))
    yield from (outline.without_ring(k) for k in range(1, len(outline.rings)))


def _spanned(points: FloatArray) -> FloatArray:
    """(n,) area of the triangle of each vertex and its two neighbours."""
    u = points - np.concatenate((points[-1:], points[:-1]))
    v = np.concatenate((points[1:], points[:1])) - points
    return 0.5 * np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
