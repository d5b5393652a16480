"""Holes inside a face: where to put one, and how to tie it to the face's outline with two bridges.

A hole is k corners wound like a face; two bridges from the face's corners cut the ring between outline and
hole into two faces. Letters: n corners of the face, k corners of the hole.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from autopoly_env.arrays import FloatArray
from autopoly_env.mesh import PolyMesh
from autopoly_env.mesh.planar_kernels import segments_touch
from autopoly_env.operators.hole_kernels import (
    bridges_among,
    free_bridges,
    is_free_bridge,
    is_ring_inside,
    is_simple_ring,
)

Bridge = tuple[int, int]


@dataclass(frozen=True)
class HoleChoice:
    """A hole in a face: its corners, and the two bridges as (position in the face, position in `points`)."""

    points: tuple[tuple[float, float], ...]  # unit square, positive shoelace area
    bridges: tuple[Bridge, Bridge]  # no position twice


def plan_hole(
    mesh: PolyMesh, face: int, points: npt.ArrayLike, obstacles: Sequence[npt.ArrayLike] = ()
) -> HoleChoice | None:
    """The hole with the corners `points` (k,2), tied to face index `face` by its best pair of bridges.

    A bridge is straight and touches nothing on its way: not the outline, the hole, the other bridge, nor a
    ring (m,2) of `obstacles`, such as holes still to come. The best pair has the least `length / sqrt(area) +
    BALANCE_WEIGHT * d`, with d the difference of the two parts' areas over their sum. None if there is no
    such pair, or if the hole does not lie inside the face, is not simple, or is wound the other way.
    """
    ring = mesh.vertices[list(mesh.faces[face])]
    hole = np.array(points, np.float64).reshape(-1, 2)
    if not _fits_inside(ring, hole):
        return None
    walls = [np.hstack((rim, np.roll(rim, -1, axis=0))) for rim in (np.asarray(o, np.float64) for o in obstacles)]
    free = free_bridges(ring, hole, np.vstack(walls) if walls else np.empty((0, 4)))
    ends = np.empty(4, np.int64)
    if not bridges_among(ring, hole, free, ends):
        return None
    f, h, g, i = ends.tolist()
    return HoleChoice(tuple((float(x), float(y)) for x, y in hole), ((f, h), (g, i)))


def default_hole(mesh: PolyMesh, face: int, n_sides: int) -> HoleChoice | None:
    """A regular hole about the centre of the largest circle in the face, half as wide. None if none fits."""
    polygon = shapely.Polygon(mesh.vertices[list(mesh.faces[face])])
    if not polygon.is_valid or polygon.area <= 0.0:
        return None
    circle = shapely.maximum_inscribed_circle(polygon, tolerance=0.02 * polygon.area**0.5)
    (x, y), _rim = circle.coords
    angles = 2.0 * np.pi * np.arange(n_sides) / n_sides - 0.5 * np.pi
    around = 0.5 * circle.length * np.column_stack((np.cos(angles), np.sin(angles)))
    return plan_hole(mesh, face, around + (x, y))


def hole_defect(ring: FloatArray, choice: HoleChoice) -> str | None:
    """Why the hole cannot be cut into the face with the corners `ring` (n,2); None if it can."""
    hole = np.array(choice.points, np.float64).reshape(-1, 2)
    (f, h), (g, i) = choice.bridges
    if not (0 <= min(f, g) and max(f, g) < len(ring) and 0 <= min(h, i) and max(h, i) < len(hole)):
        return "a bridge names a corner that does not exist"
    if f == g or h == i:
        return "its two bridges share a corner"
    if not _fits_inside(ring, hole):
        return "the hole is not a simple, positively wound ring inside the face"
    walls = np.empty((0, 4))
    if not is_free_bridge(ring, hole, walls, f, h) or not is_free_bridge(ring, hole, walls, g, i):
        return "a bridge touches the outline or the hole"
    if segments_touch(*ring[f], *hole[h], *ring[g], *hole[i]):
        return "its two bridges cross"
    return None


def _fits_inside(ring: FloatArray, hole: FloatArray) -> bool:
    return bool(
        np.isfinite(hole).all() and is_simple_ring(hole) and is_simple_ring(ring) and is_ring_inside(hole, ring)
    )
