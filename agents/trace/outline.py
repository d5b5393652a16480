"""An `Outline`: the rings of a shape as one thing that can be refitted and scored before it is a mesh."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise

import numpy as np
import shapely

from agents.trace.rings import Ring, signed_area
from autopoly_env.arrays import FloatArray
from autopoly_env.mesh import PolyMesh, Topology
from autopoly_env.refit import Bonds, RefitConfig, RefitTarget, refit
from autopoly_env.score import Score, ScoreWeights, intersection_over_union, score_of
from autopoly_env.silhouette import Target
from autopoly_env.simulator import MANY_VERTICES


@dataclass(frozen=True)
class Outline:
    """Outer rings and holes; the main outline first, a hole after the ring that it lies in."""

    rings: tuple[Ring, ...]

    @cached_property
    def loops(self) -> PolyMesh:
        """The rings as the faces of a mesh, holes wound backwards: its rendering is that of the shape."""
        cycles = _cycles(tuple(len(ring.points) for ring in self.rings))
        return PolyMesh.numbered(np.concatenate([ring.points for ring in self.rings]), cycles)

    def shape(self) -> PolyMesh:
        """`loops`, as budgets show what was found."""
        return self.loops

    @cached_property
    def n_vertices(self) -> int:
        return sum(len(ring.points) for ring in self.rings)

    @cached_property
    def n_holes(self) -> int:
        return sum(ring.is_hole for ring in self.rings)

    @property
    def is_fine(self) -> bool:
        """Whether it has so many vertices that moves of single ones are not tried."""
        return self.n_vertices > MANY_VERTICES

    @property
    def complexity(self) -> int:
        """V + E + F of the mesh that has these rings: each hole brings two bridges and a face."""
        return 2 * self.n_vertices + 3 * self.n_holes + (len(self.rings) - self.n_holes)

    @property
    def n_steps(self) -> int:
        """Actions that `construct` takes to build the rings."""
        n_steps = 0
        for k, ring in enumerate(self.rings):
            n = len(ring.points)
            n_steps += max(n - 4, 0)  # subdivisions
            n_steps += 1 if ring.is_hole else (3 if k > 0 else 0) + (n == 3)
        return n_steps

    def score(self, target: Target, weights: ScoreWeights) -> Score:
        """The score of the mesh that has these rings, its bridges crossing nothing."""
        return self.scored(intersection_over_union(self.loops, target), weights)

    def scored(self, iou: float, weights: ScoreWeights, complexity: int | None = None) -> Score:
        """The score of a mesh that has these rings, this IoU and, if it is given, complexity.

        Its inner edges cross nothing.
        """
        return score_of(self.loops, iou, weights, self.complexity if complexity is None else complexity)

    def refitted(self, target: RefitTarget, config: RefitConfig, bonds: Bonds | None = None) -> "Outline":
        """The rings moved to match the target, as far as bonds of `loops` let them."""
        return self.moved(refit(self.loops, target, config, bonds).mesh)

    def moved(self, loops: PolyMesh) -> "Outline":
        """The rings at the positions of `loops`, which has the vertices of this outline's own, elsewhere."""
        bounds = loops.topology.face_offsets.tolist()
        parts = [loops.vertices[a:b].copy() for a, b in pairwise(bounds)]
        made = Outline(tuple(Ring(part, ring.parent) for part, ring in zip(parts, self.rings, strict=True)))
        made.__dict__["loops"] = loops
        return made

    def with_ring(self, index: int, ring: Ring) -> "Outline":
        """The outline with one ring replaced."""
        return Outline((*self.rings[:index], ring, *self.rings[index + 1 :]))

    def without_ring(self, index: int) -> "Outline":
        """The outline without a ring and without the holes in it."""
        gone = {index} | {k for k, ring in enumerate(self.rings) if ring.parent == index}
        return outline_of([ring for k, ring in enumerate(self.rings) if k not in gone], self.rings)


@lru_cache(maxsize=4096)
def _cycles(sizes: tuple[int, ...]) -> Topology:
    """Rings of these sizes, as outlines by the thousand have them: what follows from it is computed once."""
    ends = np.cumsum([0, *sizes]).tolist()
    return Topology(ends[-1], tuple(tuple(range(a, b)) for a, b in pairwise(ends)))


def outline_of(kept: Sequence[Ring], among: Sequence[Ring]) -> Outline:
    """The outline of some of the rings of `among`, whose indices their `parent` counts."""
    place = {id(ring): k for k, ring in enumerate(kept)}
    rings = []
    for ring in kept:
        parent = place[id(among[ring.parent])] if ring.is_hole else -1
        rings.append(Ring(ring.points, parent))
    return Outline(tuple(rings))


def outline_of_mesh(mesh: PolyMesh) -> Outline | None:
    """The outline of a mesh, its largest part first; None where its loops do not nest."""
    return nested([mesh.vertices[loop] for loop in mesh.topology.boundary_loops])


def nested(loops: Sequence[FloatArray]) -> Outline | None:
    """The outline of closed polygons (n, 2), wound as rings are; None where one is a hole in nothing."""
    outer = sorted((loop for loop in loops if signed_area(loop) > 0.0), key=signed_area, reverse=True)
    rings = [Ring(loop, -1) for loop in outer]
    holes = [loop for loop in loops if signed_area(loop) < 0.0]
    polygons = [shapely.Polygon(loop) for loop in outer if holes]
    for hole in holes:
        within = shapely.Polygon(hole)
        middle = within.representative_point() if within.is_valid else None
        around = [k for k, polygon in enumerate(polygons) if polygon.area > within.area]  # no island in the hole
        inside = [k for k in around if middle is not None and polygons[k].contains(middle)]
        if not inside:
            return None
        rings.append(Ring(hole, inside[-1]))
    return Outline(tuple(rings)) if outer else None
