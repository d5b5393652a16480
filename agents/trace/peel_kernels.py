"""Numba kernel that takes a simple polygon apart, vertex by vertex, so that it stays simple all the way."""

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray, IntArray
from autopoly_env.compute import kernel
from autopoly_env.mesh.geometry_kernels import CLEARANCE, orientation
from autopoly_env.mesh.planar_kernels import segments_near


@kernel
def peel(points: FloatArray, walls: FloatArray, locked: BoolArray, n_keep: int) -> IntArray:
    """The order in which to drop vertices of a polygon (n, 2) until `n_keep` are left, the least visible first.

    Dropping one never makes the polygon touch itself or a wall (w, 4), nor swallow a wall; locked (n,) vertices stay.
    The order is shorter than n - n_keep where that cannot be kept up.
    """
    n = points.shape[0]
    before, after = np.arange(n) - 1, np.arange(n) + 1
    before[0], after[n - 1] = n - 1, 0
    dropped = np.zeros(n, np.bool_)
    order = np.empty(n, np.int64)
    n_dropped = 0
    while n - n_dropped > n_keep:
        best, least = -1, np.inf
        for i in range(n):
            if dropped[i] or locked[i]:
                continue
            a, b = before[i], after[i]
            area = abs(
                (points[i, 0] - points[a, 0]) * (points[b, 1] - points[a, 1])
                - (points[b, 0] - points[a, 0]) * (points[i, 1] - points[a, 1])
            )
            if area < least and _may_drop(points, walls, after, a, i, b):
                best, least = i, area
        if best < 0:
            break
        dropped[best] = True
        after[before[best]], before[after[best]] = after[best], before[best]
        order[n_dropped] = best
        n_dropped += 1
    return order[:n_dropped]


@kernel
def _may_drop(points: FloatArray, walls: FloatArray, after: IntArray, a: int, i: int, b: int) -> bool:
    """Whether the chord a-b touches nothing of the polygon or the walls, and none lies in the triangle a, i, b."""
    ax, ay, bx, by = points[a, 0], points[a, 1], points[b, 0], points[b, 1]
    cx, cy = points[i, 0], points[i, 1]
    c = b
    while after[c] != a:
        d = after[c]
        if c != b and _inside(points[c, 0], points[c, 1], ax, ay, cx, cy, bx, by):
            return False
        if c != b and segments_near(ax, ay, bx, by, points[c, 0], points[c, 1], points[d, 0], points[d, 1], CLEARANCE):
            return False
        c = d
    if c != b and _inside(points[c, 0], points[c, 1], ax, ay, cx, cy, bx, by):
        return False
    for w in range(walls.shape[0]):
        ux, uy, vx, vy = walls[w, 0], walls[w, 1], walls[w, 2], walls[w, 3]
        at_end = (
            (ux == ax and uy == ay) or (vx == ax and vy == ay) or (ux == bx and uy == by) or (vx == bx and vy == by)
        )
        if not at_end and segments_near(ax, ay, bx, by, ux, uy, vx, vy, CLEARANCE):
            return False
        if _inside(ux, uy, ax, ay, cx, cy, bx, by) or _inside(vx, vy, ax, ay, cx, cy, bx, by):
            return False
    return True


@kernel
def _inside(
    px: float, py: float, ax: float, ay: float, bx: float, by: float, cx: float, cy: float
) -> bool:  # fmt: skip
    """Whether p lies inside or on the rim of triangle abc, but is none of its corners."""
    if (px == ax and py == ay) or (px == bx and py == by) or (px == cx and py == cy):
        return False
    first = orientation(ax, ay, bx, by, px, py)
    second = orientation(bx, by, cx, cy, px, py)
    third = orientation(cx, cy, ax, ay, px, py)
    return not ((first == 1 or second == 1 or third == 1) and (first == -1 or second == -1 or third == -1))
