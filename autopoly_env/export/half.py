"""Half of a mesh whose left and right are alike, cut at its axis: a modelling program's mirror makes it whole."""

from itertools import pairwise

import numpy as np
import shapely

from autopoly_env.errors import ConfigError, OutputError
from autopoly_env.mesh import Face, PolyMesh
from autopoly_env.mesh.symmetry import TOLERANCE, axis_of, middle_of

Place = tuple[float, float]


def halved(mesh: PolyMesh) -> tuple[PolyMesh, float]:
    """The part to the right of the axis, and the axis' x. Faces across it are cut, so inside they need not be alike.

    What lies within `TOLERANCE` of the axis is put on it. Raises OutputError as `half_axis` does, or where nothing is
    left.

    >>> half, axis = halved(PolyMesh.rectangle(0.0, 0.0, 1.0, 0.5))
    >>> axis, half.vertices.tolist()
    (0.5, [[1.0, 0.0], [1.0, 0.5], [0.5, 0.0], [0.5, 0.5]])
    """
    axis = half_axis(mesh)
    places = mesh.vertices.copy()
    places[np.abs(places[:, 0] - axis) <= TOLERANCE, 0] = axis
    points: list[Place] = [(x, y) for x, y in places.tolist()]
    cuts: dict[Face, int] = {}  # the vertex on each edge that crosses the axis
    parts = [part for face in mesh.faces for part in _right_parts(_cut_ring(face, points, axis, cuts), points, axis)]
    if not parts:
        raise OutputError(f"no face reaches to the right of x = {axis:g}: give a mesh with an area")
    kept = sorted({v for part in parts for v in part})
    number = {v: k for k, v in enumerate(kept)}
    return PolyMesh.from_faces([points[v] for v in kept], [tuple(number[v] for v in part) for part in parts]), axis


def half_axis(mesh: PolyMesh) -> float:
    """`axis_of`. Raises OutputError where there is none."""
    axis = axis_of(mesh)
    if axis is None:
        raise OutputError(
            f"the outline is not its own mirror image about x = {middle_of(mesh):g}, the middle: there is no half of "
            "it; build it by agents.solve --symmetry best"
        )
    return axis


def check_flat(depth: float) -> None:
    """Raise ConfigError for a half that is to have a thickness: it would get a wall at the axis."""
    if depth:
        raise ConfigError(f"half with depth {depth:g}: halves are flat; mirror it, then give it thickness there")


def _cut_ring(face: Face, points: list[Place], axis: float, cuts: dict[Face, int]) -> Face:
    """The corners of a face with a vertex wherever an edge crosses the axis; new ones are appended to the points."""
    ring: list[int] = []
    for a, b in pairwise((*face, face[0])):
        ring.append(a)
        edge = (min(a, b), max(a, b))
        (x, y), (u, v) = points[edge[0]], points[edge[1]]
        if (x - axis) * (u - axis) < 0.0:
            if edge not in cuts:
                cuts[edge] = len(points)
                points.append((axis, y + (v - y) * (axis - x) / (u - x)))
            ring.append(cuts[edge])
    return tuple(ring)


def _right_parts(ring: Face, points: list[Place], axis: float) -> list[Face]:
    """What of a face lies to the right of the axis, which it crosses in corners only; concave faces may fall apart."""
    sides = [points[v][0] - axis for v in ring]
    if min(sides) >= 0.0:
        return [ring]
    if max(sides) <= 0.0:
        return []
    corners = [points[v] for v in ring]
    (_, low), (_, high) = np.min(corners, axis=0), np.max(corners, axis=0)
    right = shapely.box(axis, low - 1.0, axis + max(sides) + 1.0, high + 1.0)
    found = shapely.get_parts(shapely.intersection(shapely.Polygon(corners), right))
    numbers = dict(zip(corners, ring, strict=True))
    outlines = [shapely.orient_polygons(part).exterior.coords[:-1] for part in found if part.area > 0.0]
    return [tuple(numbers[place] for place in outline) for outline in outlines]
