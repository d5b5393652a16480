"""Numba kernels for holes in a face: whether one fits, which bridges are free, which two are best.

Letters: n corners of the face, k corners of the hole, m wall segments (x0, y0, x1, y1). Both rings have
positive shoelace area; all lengths in the unit square.
"""

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray, IntArray
from autopoly_env.compute import kernel
from autopoly_env.mesh.planar_kernels import (
    arc_area,
    enters_cone,
    misses_ring,
    point_on_segment,
    ring_of,
    segments_touch,
)

HOLE_SIDES = (3, 4)  # corners that a hole may have
TINY_AREA = 1e-6  # unit square, of a face that has no room for one; 1/16 of a pixel at 256 x 256
BALANCE_WEIGHT = 0.25  # what a wholly one-sided cut costs, in lengths of the square root of the face's area


@kernel
def _contains(ring: FloatArray, x: float, y: float) -> bool:
    inside = False
    for k in range(len(ring)):
        ax, ay, bx, by = ring[k - 1, 0], ring[k - 1, 1], ring[k, 0], ring[k, 1]
        if (ay > y) != (by > y) and x < ax + (y - ay) * (bx - ax) / (by - ay):
            inside = not inside
    return inside


@kernel
def is_simple_ring(ring: FloatArray) -> bool:
    """Whether a ring (n,2) has positive area, and its edges touch in nothing but their common corners."""
    n = len(ring)
    if n < 3 or arc_area(ring, 0, n - 1) <= 0.0:
        return False
    for k in range(n):
        after, beyond = (k + 1) % n, (k + 2) % n
        if point_on_segment(ring[beyond, 0], ring[beyond, 1], ring[k, 0], ring[k, 1], ring[after, 0], ring[after, 1]):
            return False
        if point_on_segment(ring[k, 0], ring[k, 1], ring[after, 0], ring[after, 1], ring[beyond, 0], ring[beyond, 1]):
            return False
        if not misses_ring(ring, ring[k, 0], ring[k, 1], ring[after, 0], ring[after, 1], k, after):
            return False
    return True


@kernel
def roomy_faces(vertices: FloatArray, corners: IntArray, offsets: IntArray, least_area: float) -> BoolArray:
    """Mask (F,) of the faces that are simple and larger than `least_area`; as for `splittable_corners`."""
    mask = np.zeros(len(offsets) - 1, np.bool_)
    for f in range(len(mask)):
        ring = ring_of(vertices, corners[offsets[f] : offsets[f + 1]])
        mask[f] = is_simple_ring(ring) and arc_area(ring, 0, len(ring) - 1) > least_area
    return mask


@kernel
def is_ring_inside(ring: FloatArray, outer: FloatArray) -> bool:
    """Whether `ring` (k,2) lies inside `outer` (n,2) without touching it."""
    for k in range(len(ring)):
        if not misses_ring(outer, ring[k - 1, 0], ring[k - 1, 1], ring[k, 0], ring[k, 1], -1, -1):
            return False
    return bool(_contains(outer, ring[0, 0], ring[0, 1]))


@kernel
def is_free_bridge(face: FloatArray, hole: FloatArray, walls: FloatArray, f: int, h: int) -> bool:
    """Whether the way from face corner f to hole corner h stays between the rings and meets no wall (m,4)."""
    px, py, qx, qy = face[f, 0], face[f, 1], hole[h, 0], hole[h, 1]
    if not enters_cone(face, f, qx, qy, False) or not enters_cone(hole, h, px, py, True):
        return False
    if not misses_ring(face, px, py, qx, qy, f, -1) or not misses_ring(hole, px, py, qx, qy, h, -1):
        return False
    for w in range(len(walls)):
        if segments_touch(px, py, qx, qy, walls[w, 0], walls[w, 1], walls[w, 2], walls[w, 3]):
            return False
    return True


@kernel
def free_bridges(face: FloatArray, hole: FloatArray, walls: FloatArray) -> BoolArray:
    """Mask (n, k): which bridges from a face corner to a hole corner are free."""
    mask = np.zeros((len(face), len(hole)), np.bool_)
    for f in range(len(face)):
        for h in range(len(hole)):
            mask[f, h] = is_free_bridge(face, hole, walls, f, h)
    return mask


@kernel
def _part_area(face: FloatArray, hole: FloatArray, f: int, h: int, g: int, i: int) -> float:
    """Area between the bridges f-h and g-i on the side of the face corners f, f+1, ..., g."""
    corners = (g - f) % len(face) + 1
    total, x, y = 0.0, hole[h, 0], hole[h, 1]
    for step in range(corners):
        c = (f + step) % len(face)
        total += x * face[c, 1] - face[c, 0] * y
        x, y = face[c, 0], face[c, 1]
    k = i
    while True:
        total += x * hole[k, 1] - hole[k, 0] * y
        x, y = hole[k, 0], hole[k, 1]
        if k == h:
            return 0.5 * total
        k = (k + len(hole) - 1) % len(hole)


@kernel
def best_bridges(
    face: FloatArray, hole: FloatArray, bridges: IntArray, lengths: FloatArray, balance_weight: float
) -> tuple[int, int]:
    """The cheapest two rows of `bridges` (b,2) that share no corner and do not touch, or (-1, -1).

    The rows (face corner, hole corner) come in the order of their `lengths` (b,), so that the search can stop
    early. A pair costs its lengths and `balance_weight` times the difference of the two parts' areas over
    their sum.
    """
    area = arc_area(face, 0, len(face) - 1) - arc_area(hole, 0, len(hole) - 1)
    best_cost, best = np.inf, (-1, -1)
    for b in range(len(bridges)):
        f, h = bridges[b, 0], bridges[b, 1]
        for c in range(b):
            g, i = bridges[c, 0], bridges[c, 1]
            if lengths[b] + lengths[c] >= best_cost:
                break
            if f == g or h == i:
                continue
            part = _part_area(face, hole, f, h, g, i)
            cost = lengths[b] + lengths[c] + balance_weight * abs(2.0 * part - area) / area
            if cost < best_cost and not segments_touch(
                face[f, 0], face[f, 1], hole[h, 0], hole[h, 1], face[g, 0], face[g, 1], hole[i, 0], hole[i, 1]
            ):
                best_cost, best = cost, (c, b)
    return best


@kernel
def plan_bridges(face: FloatArray, hole: FloatArray, bridges: IntArray) -> bool:
    """Write the best pair of bridges to `bridges` (4,), by the first's position in the face; whether there is one.

    Not so where the hole (k, 2) does not lie inside of the face (n, 2), or either is no simple ring.
    """
    if not (is_simple_ring(hole) and is_simple_ring(face) and is_ring_inside(hole, face)):
        return False
    return bridges_among(face, hole, free_bridges(face, hole, np.empty((0, 4))), bridges)


@kernel
def bridges_among(face: FloatArray, hole: FloatArray, free: BoolArray, bridges: IntArray) -> bool:
    """`plan_bridges` of a mask (n, k) of those that are free."""
    rows, lengths, n = np.empty((free.size, 2), np.int64), np.empty(free.size), 0
    for f in range(len(face)):
        for h in range(len(hole)):
            if free[f, h]:
                x, y = face[f, 0] - hole[h, 0], face[f, 1] - hole[h, 1]
                length, k = np.sqrt(x * x + y * y), n
                while k > 0 and lengths[k - 1] > length:
                    lengths[k], rows[k, 0], rows[k, 1] = lengths[k - 1], rows[k - 1, 0], rows[k - 1, 1]
                    k -= 1
                lengths[k], rows[k, 0], rows[k, 1] = length, f, h
                n += 1
    scale = 1.0 / np.sqrt(arc_area(face, 0, len(face) - 1))
    b, c = best_bridges(face, hole, rows[:n], scale * lengths[:n], BALANCE_WEIGHT)
    if b < 0:
        return False
    if rows[b, 0] > rows[c, 0]:
        b, c = c, b
    bridges[0], bridges[1], bridges[2], bridges[3] = rows[b, 0], rows[b, 1], rows[c, 0], rows[c, 1]
    return True
