"""Numba kernels for the plane geometry of meshes: signed face areas, pairs of edges that meet or nearly meet."""

import numpy as np

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.compute import kernel, uncounted_kernel
from autopoly_env.mesh.planar_kernels import segments_near
from autopoly_env.mesh.topology_kernels import links_in

# Forward error bound of the 2x2 orientation determinant (Shewchuk 1997, "Adaptive precision floating-point
# arithmetic and fast robust geometric predicates", ccwerrboundA).
_ORIENTATION_ERROR = (3.0 + 16.0 * 2.0**-53) * 2.0**-53
UNCERTAIN = 2
_MIN_FACE_AREA = 1e-9  # unit square; a face of less counts as empty
CLEARANCE = 4e-4  # unit square, a tenth of a pixel at 256 x 256; edges of the boundary that come closer are a hairline


@uncounted_kernel
def orientation(ax: float, ay: float, bx: float, by: float, cx: float, cy: float) -> int:
    """Sign of the area of triangle abc: 1, 0, -1, or UNCERTAIN where rounding decides."""
    left = (ax - cx) * (by - cy)
    right = (ay - cy) * (bx - cx)
    det = left - right
    bound = _ORIENTATION_ERROR * (abs(left) + abs(right))
    if det > bound:
        return 1
    if det < -bound:
        return -1
    if bound == 0.0:
        return 0
    return UNCERTAIN


@uncounted_kernel
def _segments_meet(p: FloatArray, a: int, b: int, c: int, d: int) -> int:
    """1 where the closed segments ab and cd share a point, 0 where not, UNCERTAIN where rounding decides."""
    ax, ay, bx, by = p[a, 0], p[a, 1], p[b, 0], p[b, 1]
    cx, cy, dx, dy = p[c, 0], p[c, 1], p[d, 0], p[d, 1]
    if max(ax, bx) < min(cx, dx) or max(cx, dx) < min(ax, bx):
        return 0
    if max(ay, by) < min(cy, dy) or max(cy, dy) < min(ay, by):
        return 0
    side_c = orientation(ax, ay, bx, by, cx, cy)
    side_d = orientation(ax, ay, bx, by, dx, dy)
    if side_c == side_d and (side_c == 1 or side_c == -1):
        return 0
    side_a = orientation(cx, cy, dx, dy, ax, ay)
    side_b = orientation(cx, cy, dx, dy, bx, by)
    if side_a == side_b and (side_a == 1 or side_a == -1):
        return 0
    if side_a == UNCERTAIN or side_b == UNCERTAIN or side_c == UNCERTAIN or side_d == UNCERTAIN:
        return UNCERTAIN
    return 1  # collinear segments come here too, and their boxes overlap, so they touch


_NO_SIDES = np.empty((0, 2), np.int64)


@kernel
def count_crossings(points: FloatArray, edges: IntArray) -> tuple[int, int]:
    """Pairs of edges that share no vertex and meet: (certain ones, ones that rounding decides)."""
    certain, uncertain, _ = _count_pairs(points, edges, _NO_SIDES, 0.0, np.empty((len(edges), 4)))
    return certain, uncertain


@uncounted_kernel
def _count_pairs(
    points: FloatArray, edges: IntArray, sides: IntArray, gap: float, boxes: FloatArray
) -> tuple[int, int, int]:  # fmt: skip
    """`count_crossings`, and pairs of boundary edges that share no vertex, do not meet, and come closer than `gap`.

    `sides` (E, 2) are those of `Links`; where they are empty nothing is on the boundary.

    Nearly all pairs lie apart, and their `boxes` (E, 4), side by side in memory, tell so: low x, high x, low y, high y.
    They are scratch.
    """
    certain, uncertain, near = 0, 0, 0
    for i in range(edges.shape[0]):
        a, b = edges[i, 0], edges[i, 1]
        ax, ay, bx, by = points[a, 0], points[a, 1], points[b, 0], points[b, 1]
        low_x, high_x, low_y, high_y = min(ax, bx), max(ax, bx), min(ay, by), max(ay, by)
        boxes[i, 0], boxes[i, 1], boxes[i, 2], boxes[i, 3] = low_x, high_x, low_y, high_y
        low_x, high_x, low_y, high_y = low_x - gap, high_x + gap, low_y - gap, high_y + gap
        for j in range(i):
            if boxes[j, 1] < low_x or boxes[j, 0] > high_x or boxes[j, 3] < low_y or boxes[j, 2] > high_y:
                continue
            c, d = edges[j, 0], edges[j, 1]
            if a == c or a == d or b == c or b == d:
                continue
            meet = _segments_meet(points, a, b, c, d)
            if meet == 1:
                certain += 1
            elif meet == UNCERTAIN:
                uncertain += 1
            elif sides.shape[0] > 0 and sides[i, 1] < 0 and sides[j, 1] < 0:
                cx, cy, dx, dy = points[c, 0], points[c, 1], points[d, 0], points[d, 1]
                near += segments_near(ax, ay, bx, by, cx, cy, dx, dy, gap)
    return certain, uncertain, near


@kernel
def face_areas(points: FloatArray, corners: IntArray, offsets: IntArray) -> FloatArray:
    """Signed area (F,) of every face; face f has the vertices corners[offsets[f]:offsets[f+1]]."""
    areas = np.empty(offsets.shape[0] - 1)
    for face in range(len(areas)):
        areas[face] = _face_area(points, corners, offsets, face)
    return areas


@uncounted_kernel
def _face_area(points: FloatArray, corners: IntArray, offsets: IntArray, face: int) -> float:
    first, last = offsets[face], offsets[face + 1]
    ox, oy = points[corners[first], 0], points[corners[first], 1]
    area = 0.0
    for k in range(first + 1, last - 1):
        i, j = corners[k], corners[k + 1]
        area += (points[i, 0] - ox) * (points[j, 1] - oy) - (points[j, 0] - ox) * (points[i, 1] - oy)
    return 0.5 * area


@kernel
def defects(points: FloatArray, packed: IntArray) -> tuple[int, int, int, int]:
    """`count_defects` of a mesh whose topology is packed (`packed_links`)."""
    links = links_in(packed)
    boxes = np.empty((len(links.edges), 4))
    return count_defects(points, links.edges, links.sides, links.corners, links.offsets, boxes)


@uncounted_kernel
def count_defects(
    points: FloatArray, edges: IntArray, sides: IntArray, corners: IntArray, offsets: IntArray, boxes: FloatArray
) -> tuple[int, int, int, int]:
    """(crossings, those of them that rounding decides, hairlines, flipped or empty faces) of a mesh.

    The arrays of whole numbers are those of `Links`; `boxes` (E, 4) is scratch.
    """
    certain, uncertain, hairlines = _count_pairs(points, edges, sides, CLEARANCE, boxes)
    flipped = 0
    for face in range(offsets.shape[0] - 1):
        if not _face_area(points, corners, offsets, face) > _MIN_FACE_AREA:
            flipped += 1
    return certain + uncertain, uncertain, hairlines, flipped
