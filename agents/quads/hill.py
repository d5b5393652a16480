"""The landscape under the rule: what an outline is worth once it is cut into convex quads and triangles."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from agents.climb.moves import neighbours
from agents.finish.align import aligned
from agents.quads.mirror import symmetric_neighbours, symmetrised
from agents.quads.moves import quad_neighbours, quad_shaken
from agents.quads.partition import MOST_BENT, Partition, bent, least_faces, mesh_of, partitioned
from agents.trace.outline import Outline
from agents.trace.rings import trace_rings
from autopoly_env.compute import map_threads
from autopoly_env.mesh import PolyMesh, is_sane
from autopoly_env.refit import RefitConfig
from autopoly_env.score import Score, intersection_over_union
from autopoly_env.simulator import Simulator

_UNCUT = 50.0  # points of r_all that an outline loses which cannot be cut
_N_LIKELY = 30  # neighbours that are cut before one is tried
_TRIANGLE = 0.5  # elements that a triangle is thought to cost beside its own


class QuadPlace(NamedTuple):
    """An outline, how it is cut, and what the mesh is worth."""

    outline: Outline
    partition: Partition | None
    score: Score
    total: float  # r_all, less a little for triangles and what is off in choosing


def total_of(place: QuadPlace) -> float:
    return place.total


class QuadHill:
    """The landscape of one target, at the silhouette's own resolution (`Simulator.finest` at most)."""

    def __init__(self, simulator: Simulator) -> None:
        self.simulator = simulator
        self.contours = trace_rings(simulator.silhouette)
        self._pixels = simulator.silhouette.target(simulator.finest)
        self.axis = simulator.guidance.axis  # about which outlines are symmetric, None where they need not be

    def place(self, outline: Outline) -> QuadPlace:
        """The outline as it is, cut at its best, or bent a little where that saves faces."""
        score = outline.score(self._pixels, self.simulator.weights)
        partition = partitioned(outline)
        place = self._cut(outline, partition, score)
        if partition is not None and len(partition.faces) <= least_faces(outline):
            return place
        relaxed = partitioned(outline, MOST_BENT)
        if relaxed is None or (partition is not None and len(relaxed.faces) >= len(partition.faces)):
            return place
        mesh = bent(mesh_of(outline, relaxed), self.simulator.guidance.bonds(outline.loops))
        if mesh is None:
            return place
        moved = outline.moved(outline.loops.with_vertices(mesh.vertices))
        return max(place, self._cut(moved, relaxed, moved.score(self._pixels, self.simulator.weights)), key=total_of)

    def promise(self, outline: Outline) -> float:
        """What an outline is worth as it is, if it can be cut as well as can be."""
        iou = intersection_over_union(outline.loops, self._pixels)
        weights = self.simulator.weights
        return weights.w_sm * iou - weights.w_sc * complexity_of(outline, least_faces(outline))

    def _cut(self, outline: Outline, partition: Partition | None, score: Score) -> QuadPlace:
        w_sc = self.simulator.weights.w_sc
        if partition is None:
            return QuadPlace(outline, None, score, score.total - _UNCUT)
        complexity = complexity_of(outline, len(partition.faces))
        total = score.total - w_sc * (complexity - score.complexity)
        off = w_sc * _TRIANGLE * (len(partition.faces) - partition.n_quads) + self.simulator.off(outline.loops)
        score = Score(score.iou, complexity, score.self_intersections, total)
        return QuadPlace(outline, partition, score, total - off)

    def fit(self, outlines: list[Outline], config: RefitConfig, iou: float) -> list[QuadPlace]:
        """Each outline refitted, on all cores, on the way to more than `iou`."""
        target = self.simulator.refit_target(iou)

        def fitted(outline: Outline) -> QuadPlace:
            bonds = self.simulator.guidance.bonds(outline.loops)
            return self.place(outline.refitted(target, config, bonds))

        return map_threads(fitted, outlines)

    def symmetric(self, outline: Outline) -> list[Outline]:
        """The outline, or under symmetry what comes of its right half and of its left one."""
        if self.axis is None:
            return [outline]
        halves = [symmetrised(outline, self.axis, side) for side in (1, -1)]
        return [half for half in halves if half is not None and self.simulator.guidance.is_symmetric(half.loops)]

    def neighbours(self, place: QuadPlace, n_blamed: int) -> list[Outline]:
        """Outlines that are one move away, the most promising first: those that are worth most as they are."""
        silhouette = self.simulator.silhouette
        found = list(neighbours(place.outline, silhouette, self.contours, n_blamed, holes=True))
        if place.partition is not None:
            found += quad_neighbours(place.outline, place.partition, silhouette, n_blamed)
        if self.axis is not None:
            found = list(symmetric_neighbours(found, place.outline, self.axis))
        likely = [found[k] for k in _best_first(map_threads(self.promise, found))[:_N_LIKELY]]
        return [likely[k] for k in _best_first(map_threads(lambda outline: self.place(outline).total, likely))]

    def polished(self, place: QuadPlace) -> list[PolyMesh]:
        """The mesh of a place, polished under the rule and, if asked for, aligned; none if it has defects."""
        assert place.partition is not None
        mesh = mesh_of(place.outline, place.partition)
        if not is_sane(mesh, "quads"):
            return []
        mesh = self.simulator.polish(mesh)
        return [aligned(self.simulator, mesh) if self.simulator.guidance.align else mesh]

    def shaken(self, place: QuadPlace, rng: np.random.Generator) -> Outline:
        """An outline a few random moves away."""
        found = self.symmetric(quad_shaken(place.outline, self.simulator.silhouette, rng))
        return found[int(rng.integers(len(found)))] if found else place.outline


def _best_first(worth: Sequence[float]) -> list[int]:
    order: list[int] = np.argsort(-np.array(worth), kind="stable").tolist()
    return order


def complexity_of(outline: Outline, n_faces: int) -> int:
    """V + E + F of a mesh of that outline, by Euler's formula: V - E + F is its parts less its holes."""
    n_vertices = sum(len(ring.points) for ring in outline.rings)
    n_holes = sum(ring.is_hole for ring in outline.rings)
    n_parts = len(outline.rings) - n_holes
    return 2 * (n_vertices + n_faces) - n_parts + n_holes
