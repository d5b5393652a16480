"""Numba kernels for straight lines: what touches what, which diagonals a face has, where an edge can go.

Letters: V vertices, E edges, H half-edges, F faces, n corners of a face. All lengths in the unit square;
rings have positive shoelace area (x right, y down). Only +, -, *, / and comparisons are used, so that a
replay on another machine gives the same bits.
"""

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray, IntArray
from autopoly_env.compute import kernel, uncounted_kernel

TOUCH = 1e-9  # segments nearer than this (unit square) count as touching


@uncounted_kernel
def cross(ox: float, oy: float, ax: float, ay: float, bx: float, by: float) -> float:
    return (ax - ox) * (by - oy) - (ay - oy) * (bx - ox)


@uncounted_kernel
def _point_near_segment(px: float, py: float, ax: float, ay: float, bx: float, by: float, gap: float) -> bool:
    dx, dy = bx - ax, by - ay
    length2 = dx * dx + dy * dy
    t = 0.0
    if length2 > 0.0:
        t = min(1.0, max(0.0, ((px - ax) * dx + (py - ay) * dy) / length2))
    ex, ey = ax + t * dx - px, ay + t * dy - py
    return bool(ex * ex + ey * ey <= gap * gap)


@uncounted_kernel
def point_on_segment(px: float, py: float, ax: float, ay: float, bx: float, by: float) -> bool:
    return _point_near_segment(px, py, ax, ay, bx, by, TOUCH)


@uncounted_kernel
def segments_near(
    px: float, py: float, qx: float, qy: float, ax: float, ay: float, bx: float, by: float, gap: float
) -> bool:
    """Whether the closed segments pq and ab come within `gap` of each other."""
    if max(px, qx) + gap < min(ax, bx) or max(ax, bx) + gap < min(px, qx):
        return False
    if max(py, qy) + gap < min(ay, by) or max(ay, by) + gap < min(py, qy):
        return False
    a_side, b_side = cross(px, py, qx, qy, ax, ay), cross(px, py, qx, qy, bx, by)
    p_side, q_side = cross(ax, ay, bx, by, px, py), cross(ax, ay, bx, by, qx, qy)
    if (a_side > 0.0) != (b_side > 0.0) and (p_side > 0.0) != (q_side > 0.0):
        return True
    return bool(
        _point_near_segment(px, py, ax, ay, bx, by, gap)
        or _point_near_segment(qx, qy, ax, ay, bx, by, gap)
        or _point_near_segment(ax, ay, px, py, qx, qy, gap)
        or _point_near_segment(bx, by, px, py, qx, qy, gap)
    )


@uncounted_kernel
def segments_touch(px: float, py: float, qx: float, qy: float, ax: float, ay: float, bx: float, by: float) -> bool:
    """Whether the closed segments pq and ab come within `TOUCH` of each other."""
    return segments_near(px, py, qx, qy, ax, ay, bx, by, TOUCH)


@uncounted_kernel
def enters_cone(ring: FloatArray, i: int, x: float, y: float, outside: bool) -> bool:
    """Whether the way from corner i of `ring` to (x, y) starts into its inside (outside), off its edges."""
    n = len(ring)
    before, after = (i + n - 1) % n, (i + 1) % n
    if outside:
        before, after = after, before
    ax, ay = ring[i, 0], ring[i, 1]
    for k in (before, after):
        if point_on_segment(ring[k, 0], ring[k, 1], ax, ay, x, y):
            return False
        if point_on_segment(x, y, ax, ay, ring[k, 0], ring[k, 1]):
            return False
    left_of_after = cross(ax, ay, ring[after, 0], ring[after, 1], x, y) > 0.0
    right_of_before = cross(ax, ay, ring[before, 0], ring[before, 1], x, y) < 0.0
    if cross(ring[before, 0], ring[before, 1], ax, ay, ring[after, 0], ring[after, 1]) >= 0.0:
        return bool(left_of_after and right_of_before)
    return bool(left_of_after or right_of_before)


@uncounted_kernel
def misses_ring(ring: FloatArray, px: float, py: float, qx: float, qy: float, skip_i: int, skip_j: int) -> bool:
    """Whether segment pq touches no edge of `ring`, except those at corners skip_i and skip_j (-1: none)."""
    n = len(ring)
    for k in range(n):
        after = k + 1 if k + 1 < n else 0
        if k == skip_i or k == skip_j or after == skip_i or after == skip_j:
            continue
        if segments_touch(px, py, qx, qy, ring[k, 0], ring[k, 1], ring[after, 0], ring[after, 1]):
            return False
    return True


@uncounted_kernel
def arc_area(ring: FloatArray, i: int, j: int) -> float:
    """Signed area of the polygon of corners i, i+1, ..., j (going round past the end if j < i)."""
    n, total, k = len(ring), 0.0, i
    while k != j:
        after = k + 1 if k + 1 < n else 0
        total += cross(ring[i, 0], ring[i, 1], ring[k, 0], ring[k, 1], ring[after, 0], ring[after, 1])
        k = after
    return 0.5 * total


@uncounted_kernel
def is_free_diagonal(ring: FloatArray, face: IntArray, edges: IntArray, i: int, j: int) -> bool:
    """Whether corners i and j of a face are joined by a line strictly inside it that is no edge (E,2) of the mesh."""
    n = len(ring)
    if i == j or (i + 1) % n == j or (j + 1) % n == i:
        return False
    if not enters_cone(ring, i, ring[j, 0], ring[j, 1], False):
        return False
    if not enters_cone(ring, j, ring[i, 0], ring[i, 1], False):
        return False
    if not misses_ring(ring, ring[i, 0], ring[i, 1], ring[j, 0], ring[j, 1], i, j):
        return False
    if arc_area(ring, i, j) <= 0.0 or arc_area(ring, j, i) <= 0.0:
        return False
    low, high = min(face[i], face[j]), max(face[i], face[j])
    for e in range(len(edges)):
        if edges[e, 0] == low and edges[e, 1] == high:
            return False
    return True


@kernel
def ring_of(vertices: FloatArray, face: IntArray) -> FloatArray:
    ring = np.empty((len(face), 2))
    for k in range(len(face)):
        ring[k, 0], ring[k, 1] = vertices[face[k], 0], vertices[face[k], 1]
    return ring


@kernel
def splittable_corners(vertices: FloatArray, corners: IntArray, offsets: IntArray, edges: IntArray) -> BoolArray:
    """Mask (H,) of the corners that have a diagonal strictly inside the face and new to the mesh.

    `corners` (H,) are the vertex indices of all faces one after another, face f being
    offsets[f]:offsets[f+1].
    """
    mask = np.zeros(len(corners), np.bool_)
    for f in range(len(offsets) - 1):
        start, n = offsets[f], offsets[f + 1] - offsets[f]
        if n < 4:
            continue
        face = corners[start : start + n]
        ring = ring_of(vertices, face)
        for i in range(n):
            for step in range(2, n - 1):
                if mask[start + i]:
                    break
                j = (i + step) % n
                if is_free_diagonal(ring, face, edges, i, j):
                    mask[start + i] = mask[start + j] = True
    return mask


@kernel
def split_imbalance(vertices: FloatArray, face: IntArray, edges: IntArray, i: int) -> FloatArray:
    """Per corner j (n,) how much the areas differ that diagonal i-j leaves; inf where it is illegal."""
    ring = ring_of(vertices, face)
    imbalance = np.full(len(face), np.inf)
    for j in range(len(face)):
        if is_free_diagonal(ring, face, edges, i, j):
            imbalance[j] = abs(arc_area(ring, i, j) - arc_area(ring, j, i))
    return imbalance


@uncounted_kernel
def _enters_trapezoid(
    ux: float, uy: float, vx: float, vy: float, width: float, height: float, inset: float, from_corner: bool
) -> bool:
    """Whether segment u-v meets the trapezoid that stands on (0, 0), (width, 0) and narrows by `inset` at either end.

    `from_corner`: u is a corner of it, and only what lies beyond u counts.
    """
    low, high = 0.0, 1.0
    for k in range(4):  # clip to each side's half-plane
        if k == 0:
            start, end = uy, vy
        elif k == 1:
            start, end = height - uy, height - vy
        elif k == 2:
            start, end = ux * height - uy * inset, vx * height - vy * inset
        else:
            start, end = (width - ux) * height - uy * inset, (width - vx) * height - vy * inset
        if end > start:
            low = max(low, start / (start - end))
        elif end < start:
            high = min(high, start / (start - end))
        elif start < 0.0:
            return False
    return high - low > 1e-9 if from_corner else high >= low


@uncounted_kernel
def _is_clear(vertices: FloatArray, edges: IntArray, a: int, b: int, offset: float, inset: float) -> bool:
    """Whether no other edge meets the trapezoid on edge a-b; its height and inset in lengths of the edge."""
    ax, ay = vertices[a, 0], vertices[a, 1]
    dx, dy = vertices[b, 0] - ax, vertices[b, 1] - ay
    width = dx * dx + dy * dy  # along the edge and across it, both times the edge's length
    for e in range(len(edges)):
        p, q = edges[e, 0], edges[e, 1]
        if (p == a and q == b) or (p == b and q == a):
            continue
        if q == a or q == b:
            p, q = q, p
        px, py, qx, qy = vertices[p, 0] - ax, vertices[p, 1] - ay, vertices[q, 0] - ax, vertices[q, 1] - ay
        ux, uy, vx, vy = px * dx + py * dy, px * dy - py * dx, qx * dx + qy * dy, qx * dy - qy * dx
        if _enters_trapezoid(ux, uy, vx, vy, width, offset * width, inset * width, p == a or p == b):
            return False
    return True


@uncounted_kernel
def clear_extrusion(
    vertices: FloatArray, edges: IntArray, a: int, b: int, offset: float, inset: float, n_halvings: int
) -> tuple[float, float]:
    """How far edge a-b can move out, and how much it must narrow at either end, to sweep over no other edge.

    In lengths of the edge; outwards of the face that has a before b. At `offset`, then at half of it and so on, the
    rectangle is tried first and then the trapezoid that narrows by `inset`, which also fits into a sharp notch. The
    last trapezoid is returned whether clear or not.
    """
    for _ in range(n_halvings):
        if _is_clear(vertices, edges, a, b, offset, 0.0):
            return offset, 0.0
        if _is_clear(vertices, edges, a, b, offset, inset):
            return offset, inset
        offset *= 0.5
    return offset, inset
