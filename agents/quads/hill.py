"""The landscape under the rule: what an outline is worth once it is cut into convex quads and triangles."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from agents.climb.moves import neighbours
from agents.finish.align import aligned
from agents.quads.mirror import symmetric_neighbours, symmetrised
from agents.quads.moves import quad_neighbours, quad_shaken
from agents.quads.partition import MOST_BENT, Cuts, Partition, bent, least_faces, mesh_of
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

    def mesh(self) -> PolyMesh:
        """Its faces; the rings of what cannot be cut."""
        return self.outline.loops if self.partition is None else mesh_of(self.outline, self.partition)


def total_of(place: QuadPlace) -> float:
    return place.total


class QuadHill:
    """The landscape of one target, at the silhouette's own resolution (`Simulator.finest` at most)."""

    def __init__(self, simulator: Simulator) -> None:
        self.simulator = simulator
        self.contours = trace_rings(simulator.silhouette)
        self._pixels = simulator.silhouette.target(simulator.finest)
        self.axis = simulator.guidance.axis  # about which outlines are symmetric, None where they need not be

    def place(self, outline: Outline, iou: float | None = None) -> QuadPlace:
        """The outline as it is, cut at its best, or bent a little where that saves faces; `iou` where it is known."""
        cuts = Cuts(outline)
        partition = cuts.best()
        place = self._cut(outline, partition, self._iou(outline) if iou is None else iou)
        if partition is not None and len(partition.faces) <= least_faces(outline):
            return place
        relaxed = cuts.best(MOST_BENT)
        if relaxed is None or (partition is not None and len(relaxed.faces) >= len(partition.faces)):
            return place
        mesh = bent(mesh_of(outline, relaxed), self.simulator.guidance.bonds(outline.loops))
        if mesh is None:
            return place
        moved = outline.moved(outline.loops.with_vertices(mesh.vertices))
        return max(place, self._cut(moved, relaxed, self._iou(moved)), key=total_of)

    def _iou(self, outline: Outline) -> float:
        return intersection_over_union(outline.loops, self._pixels)

    def _promise(self, outline: Outline, iou: float) -> float:
        """What an outline is worth as it is, if it can be cut as well as can be."""
        weights = self.simulator.weights
        return weights.w_sm * iou - weights.w_sc * complexity_of(outline, least_faces(outline))

    def _cut(self, outline: Outline, partition: Partition | None, iou: float) -> QuadPlace:
        weights = self.simulator.weights
        if partition is None:
            score = outline.scored(iou, weights)
            return QuadPlace(outline, None, score, score.total - _UNCUT)
        score = outline.scored(iou, weights, complexity_of(outline, len(partition.faces)))
        n_triangles = len(partition.faces) - partition.n_quads
        off = weights.w_sc * _TRIANGLE * n_triangles + self.simulator.off(outline.loops)
        return QuadPlace(outline, partition, score, score.total - off)

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
            halves = symmetric_neighbours(found, place.outline, self.axis)
            found = [half for half in halves if self.simulator.guidance.is_symmetric(half.loops)]
        ious = [self._iou(outline) for outline in found]
        likely = _best_first(list(map(self._promise, found, ious)))[:_N_LIKELY]
        places = map_threads(lambda k: self.place(found[k], ious[k]), likely)
        return [found[likely[k]] for k in _best_first([place.total for place in places])]

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
    n_parts = len(outline.rings) - outline.n_holes
    return 2 * (outline.n_vertices + n_faces) - n_parts + outline.n_holes
