"""An `Outline`: the rings of a shape as one thing that can be refitted and scored before it is a mesh."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from agents.trace.rings import Ring
from autopoly_env.mesh import PolyMesh, Topology
from autopoly_env.refit import RefitConfig, RefitTarget, refit
from autopoly_env.score import Score, ScoreWeights, intersection_over_union, self_intersections
from autopoly_env.silhouette import Target


@dataclass(frozen=True)
class Outline:
    """Outer rings and holes; the main outline first, a hole after the ring that it lies in."""

    rings: tuple[Ring, ...]

    @cached_property
    def loops(self) -> PolyMesh:
        """The rings as the faces of a mesh, holes wound backwards: its rendering is that of the shape."""
        ends = np.cumsum([0, *(len(ring.points) for ring in self.rings)]).tolist()
        cycles = tuple(tuple(range(a, b)) for a, b in zip(ends, ends[1:], strict=False))
        n, f = ends[-1], len(cycles)
        points = np.concatenate([ring.points for ring in self.rings])
        return PolyMesh(points, Topology(n, cycles), tuple(range(n)), tuple(range(f)), n, f)

    @property
    def complexity(self) -> int:
        """V + E + F of the mesh that has these rings: each hole brings two bridges and a face."""
        n_vertices = sum(len(ring.points) for ring in self.rings)
        n_holes = sum(ring.is_hole for ring in self.rings)
        return 2 * n_vertices + 3 * n_holes + (len(self.rings) - n_holes)

    def score(self, target: Target, weights: ScoreWeights) -> Score:
        """The score of the mesh that has these rings, its bridges crossing nothing."""
        iou = intersection_over_union(self.loops, target)
        crossings = self_intersections(self.loops)
        total = weights.w_sm * iou - weights.w_sc * self.complexity - weights.w_si * crossings
        return Score(iou, self.complexity, crossings, total)

    def refitted(self, target: RefitTarget, config: RefitConfig) -> "Outline":
        """The rings moved to match the target."""
        return self.moved(refit(self.loops, target, config).mesh)

    def moved(self, loops: PolyMesh) -> "Outline":
        """The rings at the positions of `loops`."""
        parts = [loops.vertices[list(cycle)] for cycle in loops.faces]
        return Outline(tuple(Ring(p, ring.parent) for p, ring in zip(parts, self.rings, strict=True)))

    def with_ring(self, index: int, ring: Ring) -> "Outline":
        """The outline with one ring replaced."""
        return Outline((*self.rings[:index], ring, *self.rings[index + 1 :]))

    def without_ring(self, index: int) -> "Outline":
        """The outline without a ring and without the holes in it."""
        gone = {index} | {k for k, ring in enumerate(self.rings) if ring.parent == index}
        return outline_of([ring for k, ring in enumerate(self.rings) if k not in gone], self.rings)


def outline_of(kept: Sequence[Ring], among: Sequence[Ring]) -> Outline:
    """The outline of some of the rings of `among`, whose indices their `parent` counts."""
    place = {id(ring): k for k, ring in enumerate(kept)}
    rings = []
    for ring in kept:
        parent = place[id(among[ring.parent])] if ring.is_hole else -1
        rings.append(Ring(ring.points, parent))
    return Outline(tuple(rings))
