"""Numba kernels that say whether a random shape can be shown: what is how far apart, and whether faces overlap."""

from typing import NamedTuple

import numpy as np

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.compute import kernel
from autopoly_env.mesh.geometry_kernels import orientation
from autopoly_env.mesh.topology_kernels import links_in
from autopoly_env.raster.raster_kernels import Workspace, coverage_image
from autopoly_env.silhouette.area_kernels import label_areas

_SLACK = 1e-9  # by which a pixel's coverage may round to more than all of it


class Limits(NamedTuple):
    """What is asked of a shape, in extents, the longer side of its box."""

    area: float  # at least, in square extents
    gap: float  # of `is_clear`, as the others
    length: float
    bend: float
    cosine: float


@kernel
def is_sound(points: FloatArray, packed: IntArray, limits: Limits, work: Workspace, image: FloatArray) -> bool:
    """Whether nothing crosses, overlaps or is flipped, and all that there is can be seen.

    `packed` is the topology. `image` (R, R), a picture that shows whether faces overlap, is scratch.
    """
    links = links_in(packed)
    low_x, low_y, high_x, high_y = np.inf, np.inf, -np.inf, -np.inf
    for v in range(len(points)):
        low_x, high_x = min(low_x, points[v, 0]), max(high_x, points[v, 0])
        low_y, high_y = min(low_y, points[v, 1]), max(high_y, points[v, 1])
    extent = max(high_x - low_x, high_y - low_y)
    covered = 0.0
    for f in range(len(links.offsets) - 1):
        double = 0.0
        for h in range(links.offsets[f], links.offsets[f + 1]):
            a, b = links.half_edges[h, 0], links.half_edges[h, 1]
            double += points[a, 0] * points[b, 1] - points[b, 0] * points[a, 1]
        if not double > 0.0:
            return False
        covered += 0.5 * double
    if covered < limits.area * extent**2:
        return False
    gap, length, bend = limits.gap * extent, limits.length * extent, limits.bend * extent
    if not is_clear(points, links.edges, links.boundary, gap, length, bend, limits.cosine):
        return False
    placed = np.empty((len(points), 2))
    for v in range(len(points)):
        placed[v, 0], placed[v, 1] = (points[v, 0] - low_x) / extent, (points[v, 1] - low_y) / extent
    coverage_image(placed, links.boundary, len(image), work, image)
    for row in range(len(image)):
        for column in range(len(image)):
            if image[row, column] > 1.0 + _SLACK:
                return False
    return True


@kernel
def shows_all(points: FloatArray, packed: IntArray, work: Workspace, image: FloatArray) -> bool:
    """Whether a picture of the shape, for which `image` (R, R) is scratch, has all its parts and holes, and no other.

    Of an outline that passes no vertex twice each loop is that of a part or of a hole.
    """
    links = links_in(packed)
    coverage_image(points, links.boundary, len(image), work, image)
    return n_regions(image) == len(links.loop_ends) + 1


@kernel
def n_regions(image: FloatArray) -> int:
    """How many 4-connected regions of pixels there are that are all covered by half or more, or all by less."""
    inside = image >= 0.5
    return label_areas(inside, False)[1] + label_areas(~inside, False)[1]


@kernel
def is_clear(
    points: FloatArray, edges: IntArray, boundary: IntArray, gap: float, length: float, bend: float, cosine: float
) -> bool:
    """Whether all edges (E, 2) are apart, and the outline `boundary` (B, 2) bends at each of its corners.

    Edges without a common vertex stay `gap` apart, which also keeps them from crossing; those with one meet at an
    angle whose cosine is at most `cosine`; none is shorter than `length`. The outline passes no vertex twice, and each
    of its corners is `bend` away from the straight line between its neighbours.
    """
    for i in range(edges.shape[0]):
        a, b = edges[i, 0], edges[i, 1]
        if _distance(points, a, b) < length:
            return False
        for j in range(i):
            c, d = edges[j, 0], edges[j, 1]
            if a == c or a == d:
                shared, p, q = a, b, d if a == c else c
            elif b == c or b == d:
                shared, p, q = b, a, d if b == c else c
            else:
                if _is_nearer(points, a, b, c, d, gap):
                    return False
                continue
            if _cosine(points, shared, p, q) > cosine:
                return False
    return _bends(points, boundary, bend)


@kernel
def clearance(ring: FloatArray, x: float, y: float) -> float:
    """Distance of (x, y) from a ring (n, 2); negative outside."""
    nearest, inside, n = np.inf, False, len(ring)
    for k in range(n):
        ax, ay, bx, by = ring[k - 1, 0], ring[k - 1, 1], ring[k, 0], ring[k, 1]
        nearest = min(nearest, _from_segment(x, y, ax, ay, bx, by))
        if (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax):
            inside = not inside
    return nearest if inside else -nearest


@kernel
def _bends(points: FloatArray, boundary: IntArray, bend: float) -> bool:
    following = np.full(points.shape[0], -1, np.int64)
    for k in range(boundary.shape[0]):
        if following[boundary[k, 0]] >= 0:
            return False  # the outline passes here twice
        following[boundary[k, 0]] = boundary[k, 1]
    for k in range(boundary.shape[0]):
        a, b = boundary[k, 0], boundary[k, 1]
        if _to_segment(points, b, a, following[b]) < bend:
            return False
    return True


@kernel
def _distance(points: FloatArray, a: int, b: int) -> float:
    dx, dy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    return float(np.sqrt(dx * dx + dy * dy))


@kernel
def _cosine(points: FloatArray, corner: int, p: int, q: int) -> float:
    """Cosine of the angle between corner-p and corner-q."""
    dot = (points[p, 0] - points[corner, 0]) * (points[q, 0] - points[corner, 0])
    dot += (points[p, 1] - points[corner, 1]) * (points[q, 1] - points[corner, 1])
    return dot / (_distance(points, corner, p) * _distance(points, corner, q))


@kernel
def _to_segment(points: FloatArray, p: int, a: int, b: int) -> float:
    """Distance of point p from segment ab."""
    return _from_segment(points[p, 0], points[p, 1], points[a, 0], points[a, 1], points[b, 0], points[b, 1])


@kernel
def _from_segment(x: float, y: float, ax: float, ay: float, bx: float, by: float) -> float:
    dx, dy, x, y = bx - ax, by - ay, x - ax, y - ay
    along = min(max((x * dx + y * dy) / (dx * dx + dy * dy), 0.0), 1.0)
    x, y = x - along * dx, y - along * dy
    return float(np.sqrt(x * x + y * y))


@kernel
def _is_nearer(points: FloatArray, a: int, b: int, c: int, d: int, gap: float) -> bool:
    """Whether segments ab and cd cross or come nearer than `gap`."""
    ends = min(_to_segment(points, a, c, d), _to_segment(points, b, c, d))
    if min(ends, _to_segment(points, c, a, b), _to_segment(points, d, a, b)) < gap:
        return True
    return _side(points, a, b, c) != _side(points, a, b, d) and _side(points, c, d, a) != _side(points, c, d, b)


@kernel
def _side(points: FloatArray, a: int, b: int, c: int) -> int:
    return orientation(points[a, 0], points[a, 1], points[b, 0], points[b, 1], points[c, 0], points[c, 1])
