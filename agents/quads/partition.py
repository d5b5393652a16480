"""`Partition`: an outline cut into convex quads and triangles, with as few faces as there can be.

Without holes the cut is exact (dynamic programming over the diagonals). A hole is joined to what is around it by a
bridge, which becomes an edge of the mesh; which bridges are best is searched from the shortest ones on.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import takewhile
from typing import NamedTuple

import numpy as np

from agents.quads import partition_kernels
from agents.trace.outline import Outline
from autopoly_env.arrays import BoolArray, FloatArray, IntArray
from autopoly_env.mesh import Face, PolyMesh, Topology, is_sane
from autopoly_env.mesh.corner_kernels import turns
from autopoly_env.mesh.symmetry import mirrored
from autopoly_env.refit import Bonds

LEAST_SINE = 0.02  # of the turn at every corner of a face
MOST_CORNERS = 160  # of one part and its holes that are cut exactly; the time grows with the fourth power
BENT_SINE = 0.025  # what it is made by moving vertices
MOST_BENT = 0.25  # of sine, by which a corner may lack that
_N_ROUNDS = 60
_MANY_HOLES = 4  # from which on one way is tried only
_N_BRIDGES = 3  # ways to join a hole that are tried, the shortest first


class _Way(NamedTuple):
    """A part of an outline as one polygon."""

    polygon: IntArray  # (n,) indices of the outline's vertices; those of bridges come twice
    seen: BoolArray  # (n, n) which corners see each other


@dataclass(frozen=True)
class Partition:
    """The faces, as indices of the outline's vertices, ring after ring."""

    faces: tuple[Face, ...]
    cost: float  # elements that the faces add to the rings, with a little for ugly corners

    @cached_property
    def n_quads(self) -> int:
        return sum(len(face) == 4 for face in self.faces)


class Cuts:
    """An outline that is to be cut: what its corners see of each other is found once, for cuts of every kind."""

    def __init__(self, outline: Outline) -> None:
        self._points = outline.loops.vertices
        cycles = outline.loops.faces
        self._parts = [
            _ways_to_walk(
                self._points, cycles[k], [cycles[h] for h, other in enumerate(outline.rings) if other.parent == k]
            )
            for k, ring in enumerate(outline.rings)
            if not ring.is_hole
        ]

    def best(self, bend: float = 0.0) -> Partition | None:
        """The best cut that was found; None where there is none. Corners of quads may lack so much sine."""
        faces: list[Face] = []
        cost = 0.0
        for ways in self._parts:
            found = _best_of_part(self._points, ways, bend)
            if found is None:
                return None
            faces += found.faces
            cost += found.cost
        return Partition(tuple(faces), cost)


def partitioned(outline: Outline) -> Partition | None:
    """The best cut that was found; None where there is none."""
    return Cuts(outline).best()


def least_faces(outline: Outline) -> int:
    """How many faces there are at least: all of them quads, but one where the number of corners is odd."""
    if len(outline.rings) == 1:
        return (outline.n_vertices - 1) // 2
    n_corners = {k: len(ring.points) for k, ring in enumerate(outline.rings) if not ring.is_hole}
    for ring in outline.rings:
        if ring.is_hole:
            n_corners[ring.parent] += len(ring.points) + 2  # the bridge to it is walked both ways
    return sum((n - 1) // 2 for n in n_corners.values())


def bent(mesh: PolyMesh, bonds: Bonds | None = None) -> PolyMesh | None:
    """The mesh with vertices moved so that all faces are convex; None where that takes too much.

    Mirror images by `bonds` move alike.
    """
    topology, points = mesh.topology, mesh.vertices.copy()
    partition_kernels.bend(points, topology.corners, topology.face_offsets, BENT_SINE, _N_ROUNDS)
    if bonds is not None and (bonds.images >= 0).all():
        points = 0.5 * (points + mirrored(points[bonds.images], bonds.axis))
    if turns(points, topology.corners, topology.face_offsets).min() < LEAST_SINE:
        return None
    moved = mesh.with_vertices(np.clip(points, 0.0, 1.0))
    return moved if is_sane(moved) else None


def mesh_of(outline: Outline, partition: Partition) -> PolyMesh:
    """The outline as a mesh of the partition's faces."""
    points = outline.loops.vertices
    return PolyMesh.numbered(points, Topology(len(points), partition.faces))


def _ways_to_walk(points: FloatArray, around: Face, holes: Sequence[Face]) -> list[_Way]:
    """A part as one polygon; with holes, a few ways of joining them. None of those that are too long."""
    if len(around) + sum(map(len, holes)) + 2 * len(holes) > MOST_CORNERS:
        return []
    polygons = [np.array(around)]
    if holes:
        flat, offsets = np.concatenate([np.array(hole) for hole in holes]), np.cumsum([0, *map(len, holes)])
        ranks = range(_N_BRIDGES if len(holes) < _MANY_HOLES else 1)
        bridged = (partition_kernels.bridged(points, polygons[0], flat, offsets, rank) for rank in ranks)
        polygons = list(takewhile(len, bridged))
    return [_Way(polygon, partition_kernels.visible(points, polygon)) for polygon in polygons]


def _best_of_part(points: FloatArray, ways: Sequence[_Way], bend: float) -> Partition | None:
    best_cost, best_faces = np.inf, np.empty((0, 4), np.int64)
    for polygon, seen in ways:
        cost, faces = partition_kernels.cut(points, polygon, seen, LEAST_SINE, bend)
        if cost < best_cost:
            best_cost, best_faces = cost, faces
    if best_cost == np.inf:
        return None
    rows = [tuple(face[:-1]) if face[-1] < 0 else tuple(face) for face in best_faces.tolist()]
    return Partition(tuple(rows), float(best_cost))
