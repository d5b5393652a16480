"""`Frame`: what stays regular while a construction is bent - level and plumb edges, and left and right alike.

A bend takes the points of the plane elsewhere. A frame holds the places of vertices to what they are to keep: those
that share a coordinate share it afterwards, and what is each other's mirror image remains so. A vertex that stays from
one mesh to the next has one place, and stays. Letters: N places, A anchors.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.mesh import PolyMesh, mirrored
from autopoly_env.sequence.follower import PointMap

EXACT = 1e-6  # unit square: edges that are off by less are level or plumb, and points are one
_LEAST_SYMMETRIC = 0.25  # of a pull, below which its symmetric part is nothing to go by


@dataclass(frozen=True, eq=False)
class Frame:
    """Places of vertices, and which of them go together."""

    places: FloatArray  # (N, 2) of all vertices and, under symmetry, of their mirror images, in this order
    anchors: IntArray  # (A,) of the first mesh's vertices, in its order, and of their mirror images
    groups: tuple[IntArray, IntArray]  # (N,) each: numbers of those that share x, and of those that share y
    is_symmetric: bool

    @classmethod
    def of(cls, meshes: Sequence[PolyMesh], axis: float | None, *, keep_level: bool) -> "Frame":
        """What meshes in a row have: edges that are level or plumb, if those are kept, and a mirror at x = axis."""
        places, where = np.unique(np.concatenate([mesh.vertices for mesh in meshes]), axis=0, return_inverse=True)
        where, n = where.ravel(), len(places)
        offsets = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
        edges = np.unique(
            where[np.concatenate([mesh.edges + k for mesh, k in zip(meshes, offsets, strict=False)])], axis=0
        )
        anchors = where[: offsets[1]]
        if axis is not None:
            places = np.concatenate((places, mirrored(places, axis)))
            edges, anchors = np.concatenate((edges, edges + n)), np.concatenate((anchors, anchors + n))
        twins = KDTree(places).query_pairs(EXACT, output_type="ndarray")
        off = np.abs(places[edges[:, 0]] - places[edges[:, 1]])
        across, along = (
            _groups(len(places), [twins, *([edges[off[:, k] <= EXACT]] if keep_level else [])]) for k in (0, 1)
        )
        return cls(places, anchors, (across, along), axis is not None)

    def led(self, pulls: FloatArray) -> FloatArray:
        """(A, 2) pulls of the anchors as the frame lets them be: what is tied to one that is pulled goes along."""
        if self.is_symmetric:
            pulls = _symmetric_part(pulls)
        led = np.empty_like(pulls)
        for k, groups in enumerate(self.groups):
            at, pull = groups[self.anchors], pulls[:, k]
            total, weight = np.bincount(at, pull * np.abs(pull)), np.bincount(at, np.abs(pull))
            led[:, k] = (total / np.where(weight > 0.0, weight, 1.0))[at]
        return led

    def held(self, bend: PointMap) -> PointMap:
        """`bend`, but for the places: of those that share a coordinate each goes to the mean of where they would go."""
        moved = bend(self.places)
        for k, groups in enumerate(self.groups):
            moved[:, k] = (np.bincount(groups, moved[:, k]) / np.bincount(groups))[groups]
        known = {(x, y): row for (x, y), row in zip(self.places.tolist(), moved, strict=True)}

        def place(points: FloatArray) -> FloatArray:
            bent = bend(points)
            for k, (x, y) in enumerate(points.tolist()):
                bent[k] = known.get((x, y), bent[k])
            return bent

        return place


def _groups(n: int, ties: Sequence[IntArray]) -> IntArray:
    """(n,) the number of the group that each is in, where pairs (.., 2) are tied."""
    pairs = np.concatenate(ties)
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    groups: IntArray = connected_components(graph, directed=False)[1].astype(np.int64)
    return groups


def _symmetric_part(pulls: FloatArray) -> FloatArray:
    """Pulls (A, 2), the second half of mirror images, with left and right alike, the longest as long as it was."""
    images = np.roll(pulls, len(pulls) // 2, axis=0) * (-1.0, 1.0)
    both: FloatArray = 0.5 * (pulls + images)
    longest, left = np.hypot(*pulls.T).max(), np.hypot(*both.T).max()
    return both * (longest / left) if left >= _LEAST_SYMMETRIC * longest > 0.0 else both
