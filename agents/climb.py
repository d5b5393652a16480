"""`climb`: hill climbing on outlines, from the best that tracing and greedy search have found.

Of two meshes with the same outline the score prefers the one with fewer inner edges, so the search moves among outlines
(rings of vertices) and builds a mesh only in the end. Every neighbour of an outline is refitted before it is judged.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import shapely

from agents.base import Meter, Solution, WholeAgent, finish
from agents.beam import BeamAgent, BeamConfig
from agents.trace.agent import TraceAgent, TraceConfig, build_best, final_total
from agents.trace.outline import Outline, outline_of, outline_of_mesh
from agents.trace.reach import Reach
from agents.trace.rings import Ring, signed_area, trace_rings
from agents.trace.simplify import Contour
from autopoly_env.actions import Action
from autopoly_env.arrays import FloatArray
from autopoly_env.parallel import map_threads
from autopoly_env.placement import Disagreement, hole_shapes, starts
from autopoly_env.refit import LOCAL, THOROUGH, RefitConfig, RefitTarget
from autopoly_env.simulator import Simulator

_NEW_RING_SIZES = (3, 4, 5, 6, 8)


@dataclass(frozen=True)
class ClimbConfig:
    """How `climb` searches."""

    n_seeds: int = 3  # traced outlines of different sizes to climb from, the best first
    with_greedy: bool = True  # climb from what greedy search finds, too
    n_blamed: int = 8  # edges to add vertices to, those with most blame
    n_thorough: int = 4  # neighbours that are refitted again, harder, before a top is taken for one
    n_relocated: int = 3  # edges that a vertex may be moved to from elsewhere when nothing simpler improves
    n_rounds: int = 60


class ClimbAgent(WholeAgent):
    """Traces and searches greedily, then climbs from each result; returns the best."""

    name = "climb"

    def __init__(self, config: ClimbConfig) -> None:
        self._config = config

    def _find(self, simulator: Simulator, meter: Meter) -> Solution:
        tops: list[Outline] = []
        candidates = []
        try:
            for seed in self._traced(simulator, meter):
                tops += [seed, self._climb(simulator, seed, meter)]
            if self._config.with_greedy and not meter.spent():
                solution = BeamAgent(BeamConfig(width=1)).solve(simulator, meter.rest())
                meter.count(solution.stats.n_refits, solution.score.total)
                candidates.append(solution)
                if solution.stats.stopped_by == "interrupted":
                    raise KeyboardInterrupt
                outline = outline_of_mesh(solution.mesh)
                if outline is not None:
                    tops += [outline, self._climb(simulator, outline, meter)]
        except KeyboardInterrupt:
            meter.stopped_by = "interrupted"
        if tops:
            polished = [polish(simulator, outline) for outline in tops]
            polished.sort(key=lambda outline: -final_total(simulator, outline))
            candidates.append(finish(simulator, build_best(simulator, polished, 3), meter))
        if not candidates:
            return finish(simulator, [simulator.initial()], meter)
        best = max(candidates, key=lambda candidate: candidate.score.total)
        return Solution(best.sequence, best.mesh, best.score, meter.stats())

    def _traced(self, simulator: Simulator, meter: Meter) -> Iterator[Outline]:
        sizes: set[int] = set()
        outlines = list(TraceAgent(TraceConfig()).outlines(simulator, meter))
        for outline in sorted(outlines, key=lambda outline: -final_total(simulator, outline)):
            if outline.complexity not in sizes and len(sizes) < self._config.n_seeds and not meter.spent():
                sizes.add(outline.complexity)
                yield outline

    def _climb(self, simulator: Simulator, outline: Outline, meter: Meter) -> Outline:
        """Move to the best neighbour while one is better; look harder before giving up."""
        hill = _Hill(simulator)
        best_total, best = hill.total(outline), outline
        for _ in range(self._config.n_rounds):
            if meter.spent():
                break
            neighbours = [o for o in self._neighbours(simulator, best, hill) if hill.reach.allows(o)]
            fits = hill.fit(neighbours, LOCAL)
            order = sorted(range(len(fits)), key=lambda k: -fits[k][0])
            n_fits = len(fits)
            if not fits or fits[order[0]][0] <= best_total + 1e-9:
                hopeful = [neighbours[k] for k in order[: self._config.n_thorough]]
                fits = hill.fit([*hopeful, best], THOROUGH)
                relocations = [o for o in self._relocations(simulator, best) if hill.reach.allows(o)]
                fits += hill.fit(relocations, LOCAL)
                order = sorted(range(len(fits)), key=lambda k: -fits[k][0])
                n_fits += len(fits)
            improved = fits[order[0]][0] > best_total + 1e-9
            if improved:
                best_total, best = fits[order[0]]
            meter.count(n_fits, best_total)
            if not improved:
                break
        return best

    def _neighbours(self, simulator: Simulator, outline: Outline, hill: "_Hill") -> Iterator[Outline]:
        """A vertex less; one or two more where an edge is to blame; a ring less; a ring more."""
        disagreement = Disagreement(outline.loops, simulator.silhouette)
        for k, ring in enumerate(outline.rings):
            if len(ring.points) > 3:
                yield from (outline.with_ring(k, _without(ring, i)) for i in range(len(ring.points)))
        for row in _blamed_rows(disagreement, self._config.n_blamed):
            yield _grown(outline, disagreement, row, "edge_subdivide")
            yield _grown(outline, disagreement, row, "edge_extrude")
        yield from (outline.without_ring(k) for k in range(1, len(outline.rings)))
        if len(outline.rings) < len(hill.contours):
            yield from _one_ring_more(outline, hill.contours)
        if hill.reach.holes:
            yield from _one_hole_more(outline, disagreement)

    def _relocations(self, simulator: Simulator, outline: Outline) -> Iterator[Outline]:
        """A vertex taken away here and added there."""
        disagreement = Disagreement(outline.loops, simulator.silhouette)
        for row in _blamed_rows(disagreement, self._config.n_relocated):
            grown = _grown(outline, disagreement, row, "edge_subdivide")
            for k, (old, new) in enumerate(zip(outline.rings, grown.rings, strict=True)):
                old_points = {tuple(p) for p in old.points}
                if len(new.points) > 4:
                    kept = (i for i in range(len(new.points)) if tuple(new.points[i]) in old_points)
                    yield from (grown.with_ring(k, _without(new, i)) for i in kept)


class _Hill:
    """The landscape of one target."""

    def __init__(self, simulator: Simulator) -> None:
        self.contours = trace_rings(simulator.silhouette)
        self.reach = Reach.of(simulator)
        self._target = RefitTarget.of(simulator.silhouette, simulator.resolution)
        self._pixels = simulator.silhouette.target(simulator.resolution)
        self._weights = simulator.weights

    def total(self, outline: Outline) -> float:
        return outline.score(self._pixels, self._weights).total

    def fit(self, outlines: Sequence[Outline], config: RefitConfig) -> list[tuple[float, Outline]]:
        """(r_all, refitted outline) of each, on all cores."""

        def fit_one(outline: Outline) -> tuple[float, Outline]:
            fitted = outline.refitted(self._target, config)
            return self.total(fitted), fitted

        return map_threads(fit_one, outlines)


def polish(simulator: Simulator, outline: Outline) -> Outline:
    """The outline refitted at the silhouette's own resolution, if that scores better there."""
    target = RefitTarget.of(simulator.silhouette, min(512, simulator.silhouette.resolution))
    fitted = outline.refitted(target, LOCAL)
    return max((outline, fitted), key=lambda candidate: final_total(simulator, candidate))


def _blamed_rows(disagreement: Disagreement, n_most: int) -> list[int]:
    """Rows of the boundary edges with most blame, those without any left out."""
    blame = disagreement.blame[:, :, 0].max(axis=1)
    order = np.argsort(-blame, kind="stable")[:n_most]
    return [int(row) for row in order if blame[row] > 0.0]


def _without(ring: Ring, index: int) -> Ring:
    return Ring(np.delete(ring.points, index, axis=0), ring.parent)


def _grown(outline: Outline, disagreement: Disagreement, row: int, operator: str) -> Outline:
    """One (edge_subdivide) or two (edge_extrude) vertices more in the boundary edge of that row."""
    loops = outline.loops
    a, b = loops.topology.boundary_half_edges[row].tolist()
    _, start = starts(disagreement, Action(operator, loops.edge_index(a, b)))[0]
    new_points = start.vertices[len(loops.vertices) :]
    ends = np.cumsum([len(ring.points) for ring in outline.rings])
    k = int(np.searchsorted(ends, a, side="right"))
    ring = outline.rings[k]
    place = a - (int(ends[k]) - len(ring.points)) + 1
    return outline.with_ring(k, Ring(np.insert(ring.points, place, new_points, axis=0), ring.parent))


def _one_ring_more(outline: Outline, contours: Sequence[Ring]) -> Iterator[Outline]:
    """One more of the traced contours, at a few sizes: a hole where none is yet, a part outside all parts."""
    polygons = [shapely.Polygon(ring.points) for ring in outline.rings]
    for contour in contours:
        middle = shapely.Polygon(contour.points).representative_point()
        inside = [k for k, polygon in enumerate(polygons) if polygon.contains(middle)]
        parents = [k for k in inside if not outline.rings[k].is_hole]
        if contour.is_hole and (not parents or len(inside) > len(parents)):
            continue
        if not contour.is_hole and parents:
            continue
        for size in _NEW_RING_SIZES:
            if size < len(contour.points):
                polygon = Contour(contour.points).polygon(size)
                ring = Ring(polygon, parents[-1] if contour.is_hole else -1)
                yield outline_of([*outline.rings, ring], outline.rings)


def _one_hole_more(outline: Outline, disagreement: Disagreement) -> Iterator[Outline]:
    """A triangle or quad over the largest excess in a part."""
    for k, ring in enumerate(outline.rings):
        region = None if ring.is_hole else disagreement.excess_in(k)
        if region is not None:
            for n_sides, hole in product((3, 4), (0, 1)):
                points: FloatArray = list(hole_shapes(region, n_sides))[hole]
                if shapely.Polygon(ring.points).contains(shapely.Polygon(points)):
                    backwards = points if signed_area(points) < 0.0 else points[::-1]
                    yield outline_of([*outline.rings, Ring(backwards, k)], outline.rings)
                    break
