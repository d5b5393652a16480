"""Numba kernels that cut a polygon into convex quads and triangles at least cost.

Letters: n corners. A polygon may be weakly simple: a bridge to a hole is walked both ways, and its corners come twice
under one name. Rings have positive shoelace area (x right, y down).
"""

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray, IntArray
from autopoly_env.compute import kernel
from autopoly_env.mesh.corner_kernels import turn
from autopoly_env.mesh.geometry_kernels import CLEARANCE
from autopoly_env.mesh.planar_kernels import enters_cone, segments_touch

UGLINESS = 0.1  # what the worst corner of a face costs at most, in elements
LEAST_GAP = 3.0 * CLEARANCE  # between opposite sides of a quad, so that a refit leaves room to build it
BENDING = 2.0  # what it costs for each unit of sine that a corner has to be bent to be allowed


@kernel
def visible(points: FloatArray, names: IntArray) -> BoolArray:
    """(n, n) whether a diagonal joins two corners of the polygon `names` (n,) inside it and touches nothing of it."""
    n, ring = len(names), points[names]
    seen = np.zeros((n, n), np.bool_)
    for i in range(n):
        for j in range(i + 2, n):
            if i == 0 and j == n - 1:
                continue
            if names[i] == names[j] or not enters_cone(ring, i, ring[j, 0], ring[j, 1], False):
                continue
            if not enters_cone(ring, j, ring[i, 0], ring[i, 1], False):
                continue
            seen[i, j] = seen[j, i] = _misses(points, names, names[i], names[j])
    return seen


@kernel
def least_costs(
    points: FloatArray, names: IntArray, seen: BoolArray, least_sine: float, bend: float
) -> tuple[FloatArray, IntArray]:
    """Cost (n, n) of cutting what lies beyond each chord i < j, and the face (n, n, 2) on that chord: corners k, m.

    m is -1 for a triangle. The cost of a face is 2, itself and an edge, and up to `UGLINESS` for its worst corner. No
    corner of a face turns by less than `least_sine`, of which a quad may lack `bend`; no quad is thinner than
    `LEAST_GAP`. Klincsek 1980, with quads as well
    as triangles: O(n^4).
    """
    n = len(points)
    cost = np.full((n, n), np.inf)
    faces = np.full((n, n, 2), -1, np.int64)
    for i in range(n - 1):
        cost[i, i + 1] = 0.0
    for length in range(2, n):
        for i in range(n - length):
            j = i + length
            if not seen[i, j] and length < n - 1:
                continue
            for k in range(i + 1, j):
                if cost[i, k] == np.inf:
                    continue
                if cost[k, j] < np.inf and cost[i, k] + cost[k, j] + 2.0 < cost[i, j]:
                    worst = _worst_of_triangle(points, i, k, j)
                    if worst >= least_sine:
                        total = cost[i, k] + cost[k, j] + 2.0 + UGLINESS * (1.0 - worst)
                        if total < cost[i, j]:
                            cost[i, j], faces[i, j, 0], faces[i, j, 1] = total, k, -1
                at_k = turn(points, j, i, k)
                if at_k < least_sine - bend:
                    continue
                for m in range(k + 1, j):
                    if not cost[i, k] + cost[k, m] + cost[m, j] + 2.0 < cost[i, j]:
                        continue
                    worst = min(at_k, turn(points, i, k, m), turn(points, k, m, j), turn(points, m, j, i))
                    if worst >= least_sine - bend and names[i] != names[m] and names[k] != names[j]:
                        total = cost[i, k] + cost[k, m] + cost[m, j] + 2.0 + UGLINESS * (1.0 - worst)
                        total += BENDING * max(0.0, least_sine - worst)
                        if total < cost[i, j] and _is_thick(points, i, k, m, j):
                            cost[i, j], faces[i, j, 0], faces[i, j, 1] = total, k, m
    return cost, faces


@kernel
def _is_thick(points: FloatArray, a: int, b: int, c: int, d: int) -> bool:
    """Whether opposite sides of a convex quad are so far apart that both may be boundary edges while it is built."""
    least = min(
        min(_gap(points, a, c, d), _gap(points, b, c, d), _gap(points, c, a, b), _gap(points, d, a, b)),
        min(_gap(points, b, d, a), _gap(points, c, d, a), _gap(points, d, b, c), _gap(points, a, b, c)),
    )
    return least >= LEAST_GAP


@kernel
def _gap(points: FloatArray, p: int, a: int, b: int) -> float:
    """Distance of corner p from the side between a and b."""
    dx, dy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    x, y = points[p, 0] - points[a, 0], points[p, 1] - points[a, 1]
    share = min(1.0, max(0.0, (x * dx + y * dy) / (dx * dx + dy * dy)))
    return np.hypot(x - share * dx, y - share * dy)


@kernel
def _worst_of_triangle(points: FloatArray, a: int, b: int, c: int) -> float:
    return min(turn(points, c, a, b), turn(points, a, b, c), turn(points, b, c, a))


@kernel
def cut(points: FloatArray, names: IntArray, seen: BoolArray, least_sine: float, bend: float) -> tuple[float, IntArray]:
    """The least cost of cutting a polygon, whose corners are `names` (n,) of the points, and its faces (m, 4).

    `seen` (n, n) says which corners are `visible` to each other. Of a triangle the last entry is -1. The
    cost is inf, and there are no faces, where it cannot be cut.
    """
    n = len(names)
    corners = points[names]
    costs, chosen = least_costs(corners, names, seen, least_sine, bend)
    if n < 3 or costs[0, n - 1] == np.inf:
        return np.inf, np.empty((0, 4), np.int64)
    faces = np.empty((n - 2, 4), np.int64)
    waiting = np.empty((n, 2), np.int64)
    waiting[0] = 0, n - 1
    n_faces, n_waiting = 0, 1
    while n_waiting:
        n_waiting -= 1
        i, j = waiting[n_waiting, 0], waiting[n_waiting, 1]
        if j == i + 1:
            continue
        k, m = chosen[i, j, 0], chosen[i, j, 1]
        faces[n_faces] = names[i], names[k], names[j], -1
        waiting[n_waiting] = i, k
        if m < 0:
            waiting[n_waiting + 1] = k, j
            n_waiting += 2
        else:
            faces[n_faces, 2], faces[n_faces, 3] = names[m], names[j]
            waiting[n_waiting + 1] = k, m
            waiting[n_waiting + 2] = m, j
            n_waiting += 3
        n_faces += 1
    return costs[0, n - 1], faces[:n_faces]


@kernel
def bridged(points: FloatArray, around: IntArray, holes: IntArray, offsets: IntArray, rank: int) -> IntArray:
    """One polygon of a ring and its holes, each joined by the shortest bridge there is to what is joined already.

    Hole h has the corners holes[offsets[h]:offsets[h + 1]]. The first bridge is the shortest but `rank`. The polygon is
    empty where there is no bridge.
    """
    n_holes = len(offsets) - 1
    polygon = np.empty(len(around) + len(holes) + 2 * n_holes, np.int64)
    n = len(around)
    polygon[:n] = around
    is_joined = np.zeros(n_holes, np.bool_)
    for nth in range(n_holes):
        longer, best_i, best_h, best_j = -1.0, -1, -1, -1
        for _ in range(rank + 1 if nth == 0 else 1):
            shortest = np.inf
            best_i = -1
            for h in range(n_holes):
                if is_joined[h]:
                    continue
                hole = holes[offsets[h] : offsets[h + 1]]
                for i in range(n):
                    for j in range(len(hole)):
                        dx, dy = points[polygon[i], 0] - points[hole[j], 0], points[polygon[i], 1] - points[hole[j], 1]
                        gap = dx * dx + dy * dy
                        if longer < gap < shortest and _is_bridge(
                            points, polygon[:n], holes, offsets, is_joined, h, i, j
                        ):
                            shortest, best_i, best_h, best_j = gap, i, h, j
            if best_i < 0:
                return polygon[:0]
            longer = shortest
        hole = holes[offsets[best_h] : offsets[best_h + 1]]
        size = len(hole)
        tail = polygon[best_i:n].copy()
        for k in range(size + 1):
            polygon[best_i + 1 + k] = hole[(best_j + k) % size]
        polygon[best_i + size + 2 : n + size + 2] = tail
        n += size + 2
        is_joined[best_h] = True
    return polygon[:n]


@kernel
def _is_bridge(
    points: FloatArray,
    polygon: IntArray,
    holes: IntArray,
    offsets: IntArray,
    is_joined: BoolArray,
    h: int,
    i: int,
    j: int,
) -> bool:
    """Whether corner i of a polygon and corner j of hole h in it see each other."""
    hole = holes[offsets[h] : offsets[h + 1]]
    a, b = polygon[i], hole[j]
    ax, ay, bx, by = points[a, 0], points[a, 1], points[b, 0], points[b, 1]
    if not enters_cone(points[polygon], i, bx, by, False) or not enters_cone(points[hole], j, ax, ay, False):
        return False
    if not _misses(points, polygon, a, b):
        return False
    for other in range(len(offsets) - 1):
        if not is_joined[other] and not _misses(points, holes[offsets[other] : offsets[other + 1]], a, b):
            return False
    return True


@kernel
def _misses(points: FloatArray, ring: IntArray, a: int, b: int) -> bool:
    """Whether the segment between two points touches no side of a ring but those that begin or end there."""
    n = len(ring)
    for k in range(n):
        c, d = ring[k], ring[k + 1 if k + 1 < n else 0]
        if c == a or c == b or d == a or d == b:
            continue
        if segments_touch(
            points[a, 0], points[a, 1], points[b, 0], points[b, 1], points[c, 0], points[c, 1], points[d, 0],
            points[d, 1],
        ):  # fmt: skip
            return False
    return True


@kernel
def bend(points: FloatArray, corners: IntArray, offsets: IntArray, least_sine: float, n_rounds: int) -> None:
    """Move vertices, in place, as little as may be until every corner of a face turns by `least_sine`.

    Corner after corner is put right by the shortest move of its three vertices (Kaczmarz 1937).
    """
    for _ in range(n_rounds):
        is_done = True
        for f in range(len(offsets) - 1):
            start, n = offsets[f], offsets[f + 1] - offsets[f]
            for k in range(n):
                a, b, c = corners[start + k], corners[start + (k + 1) % n], corners[start + (k + 2) % n]
                ux, uy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
                vx, vy = points[c, 0] - points[b, 0], points[c, 1] - points[b, 1]
                lacking = least_sine * np.sqrt((ux * ux + uy * uy) * (vx * vx + vy * vy)) - (ux * vy - uy * vx)
                if lacking <= 0.0:
                    continue
                is_done = False
                size = 2.0 * (ux * ux + uy * uy + vx * vx + vy * vy + ux * vx + uy * vy)
                if size <= 0.0:
                    continue
                step = lacking / size
                points[a, 0] -= step * vy
                points[a, 1] += step * vx
                points[c, 0] -= step * uy
                points[c, 1] += step * ux
                points[b, 0] += step * (vy + uy)
                points[b, 1] -= step * (vx + ux)
        if is_done:
            return
