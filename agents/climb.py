"""`climb`: hill climbing on outlines, from the best that tracing and greedy search have found.

Between two meshes with the same outline the score prefers the one with fewer inner edges, so the search moves among
outlines (rings of vertices) and builds a mesh only in the end. Neighbours of an outline: one vertex less, one vertex
more where an edge is to blame for disagreement, a ring less, a ring of the traced contours more. Each is refitted.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from agents.base import Agent, Budget, Decision, Meter, Progress, Solution, finish
from agents.beam import BeamAgent, BeamConfig
from agents.trace.agent import TraceAgent, TraceConfig, build_best, final_total
from agents.trace.outline import Outline, outline_of
from agents.trace.rings import Ring, signed_area, trace_rings
from agents.trace.simplify import Contour
from autopoly_env.actions import STOP, Action
from autopoly_env.errors import IllegalActionError
from autopoly_env.parallel import map_threads
from autopoly_env.placement import Disagreement, starts
from autopoly_env.refit import RefitConfig, RefitTarget
from autopoly_env.simulator import Simulator, State

_QUICK = RefitConfig(first_level=2)
_THOROUGH = RefitConfig(first_level=1, n_far=60)
_NEW_RING_SIZES = (3, 4, 5, 6, 8)


@dataclass(frozen=True)
class ClimbConfig:
    """How `climb` searches."""

    n_seeds: int = 3  # traced outlines of different sizes to climb from, the best first
    with_greedy: bool = True  # climb from what greedy search finds, too
    n_blamed: int = 8  # edges to subdivide, those with most blame
    n_thorough: int = 4  # neighbours that are refitted again, harder, before a top is taken for one
    n_rounds: int = 60


class ClimbAgent(Agent):
    """Traces and searches greedily, then climbs from each result; returns the best."""

    name = "climb"

    def __init__(self, config: ClimbConfig) -> None:
        self._config = config

    def act(self, simulator: Simulator, state: State) -> Decision:
        """Always STOP: the shape is found as a whole, by `solve`."""
        return Decision(STOP)

    def solve(
        self,
        simulator: Simulator,
        budget: Budget | None = None,
        on_progress: Callable[[Progress], None] | None = None,
    ) -> Solution:
        meter = Meter(budget or Budget(), on_progress)
        tops: list[Outline] = []
        for seed in self._seeds(simulator, meter):
            tops += [seed, self._climb(simulator, seed, meter)]
            if meter.spent():
                break
        if not tops:
            return finish(simulator, [simulator.initial()], meter)
        tops.sort(key=lambda outline: -final_total(simulator, outline))
        return finish(simulator, build_best(simulator, tops, 3), meter)

    def _seeds(self, simulator: Simulator, meter: Meter) -> Iterator[Outline]:
        sizes = set()
        for outline in TraceAgent(TraceConfig()).outlines(simulator, meter):
            if outline.complexity not in sizes and len(sizes) < self._config.n_seeds:
                sizes.add(outline.complexity)
                yield outline
        if self._config.with_greedy:
            solution = BeamAgent(BeamConfig(width=1)).solve(simulator)
            meter.count(solution.stats.n_refits, solution.score.total)
            outline = outline_of_mesh(solution.mesh.vertices, solution.mesh.topology.boundary_loops)
            if outline is not None:
                yield outline

    def _climb(self, simulator: Simulator, outline: Outline, meter: Meter) -> Outline:
        target = RefitTarget.of(simulator.silhouette, simulator.resolution)
        pixels = simulator.silhouette.target(simulator.resolution)
        contours = trace_rings(simulator.silhouette)

        def total(candidate: Outline) -> float:
            return candidate.score(pixels, simulator.weights).total

        def refitted(candidate: Outline, config: RefitConfig) -> tuple[float, Outline]:
            fitted = candidate.refitted(target, config)
            return total(fitted), fitted

        best_total, best = total(outline), outline
        for _ in range(self._config.n_rounds):
            neighbours = list(self._neighbours(simulator, best, contours))
            fits = map_threads(lambda candidate: refitted(candidate, _QUICK), neighbours)
            order = sorted(range(len(fits)), key=lambda k: -fits[k][0])
            meter.count(len(fits), best_total)
            if not order:
                break
            if fits[order[0]][0] <= best_total + 1e-9:
                again = [neighbours[k] for k in order[: self._config.n_thorough]]
                fits = map_threads(lambda candidate: refitted(candidate, _THOROUGH), again)
                fits.append(refitted(best, _THOROUGH))
                meter.count(len(fits), best_total)
                order = sorted(range(len(fits)), key=lambda k: -fits[k][0])
            if fits[order[0]][0] <= best_total + 1e-9 or meter.spent():
                break
            best_total, best = fits[order[0]]
        return best

    def _neighbours(self, simulator: Simulator, outline: Outline, contours: Sequence[Ring]) -> Iterator[Outline]:
        disagreement = Disagreement(outline.loops, simulator.silhouette)
        yield from _one_vertex_less(outline)
        blame = disagreement.blame[:, :, 0].max(axis=1)
        edge_of_row = {row: edge for edge, row in disagreement.row_of_edge.items()}
        for row in np.argsort(-blame, kind="stable")[: self._config.n_blamed].tolist():
            if blame[row] > 0.0:
                _, start = starts(disagreement, Action("edge_subdivide", edge_of_row[row]))[0]
                yield outline.moved(start)
        for k in range(1, len(outline.rings)):
            yield outline.without_ring(k)
        if len(outline.rings) < len(contours):
            yield from _one_ring_more(outline, contours, "face_hole" in simulator.operators)


def _one_vertex_less(outline: Outline) -> Iterator[Outline]:
    for k, ring in enumerate(outline.rings):
        if len(ring.points) > (4 if k == 0 else 3):
            for i in range(len(ring.points)):
                yield outline.with_ring(k, Ring(np.delete(ring.points, i, axis=0), ring.parent))


def _one_ring_more(outline: Outline, contours: Sequence[Ring], with_holes: bool) -> Iterator[Outline]:
    """The outline with one more of the traced contours, at a few sizes, if its middle is not in a ring of its kind."""
    loops = outline.loops
    for contour in contours:
        if contour.is_hole and not with_holes:
            continue
        inside = [k for k, ring in enumerate(outline.rings) if _contains(ring.points, contour.points.mean(axis=0))]
        owners = [k for k in inside if not outline.rings[k].is_hole]
        taken = any(outline.rings[k].is_hole for k in inside) if contour.is_hole else bool(owners)
        if taken or (contour.is_hole and not owners):
            continue
        parent = owners[-1] if contour.is_hole else -1
        for size in _NEW_RING_SIZES:
            if size < len(contour.points) and abs(signed_area(contour.points)) > 0.0:
                polygon = Contour(contour.points).polygon(size)
                if parent >= 0 or len(loops.faces) > 0:
                    yield outline_of([*outline.rings, Ring(polygon, parent)], [*outline.rings])


def _contains(points: np.ndarray, point: np.ndarray) -> bool:
    (x, y), (x0, y0), (x1, y1) = point, points.T, np.roll(points, -1, axis=0).T
    above = (y0 > y) != (y1 > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = above & (x < x0 + (y - y0) / (y1 - y0) * (x1 - x0))
    return bool(crossing.sum() % 2)


def outline_of_mesh(vertices: np.ndarray, loops: Sequence[np.ndarray]) -> Outline | None:
    """The outline of a mesh, its largest part first; None where an outer loop is missing."""
    rings = [vertices[loop] for loop in loops]
    outer = sorted((ring for ring in rings if signed_area(ring) > 0.0), key=signed_area, reverse=True)
    if not outer:
        return None
    found = [Ring(ring, -1) for ring in outer]
    for hole in (ring for ring in rings if signed_area(ring) < 0.0):
        inside = [k for k, ring in enumerate(outer) if _contains(ring, hole.mean(axis=0))]
        if inside:
            found.append(Ring(hole, inside[-1]))
    return Outline(tuple(found))
