"""Numba kernels that find where a mesh is, or has a gap, too narrow to be seen, though the picture has it otherwise.

Letters: V vertices, B directed boundary edges, R pixels a side. All lengths in the unit square.
"""

import numpy as np

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.compute import kernel
from autopoly_env.mesh.planar_kernels import segments_near

_FAINT, _FULL = 0.25, 0.75  # coverage at a point, below (above) which it counts as background (object)
_MOST_SAMPLES = 256  # along one edge


@kernel
def _coverage_at(coverage: FloatArray, x: float, y: float) -> float:
    """Bilinear between the centres of the pixels, 0 outside the picture."""
    size = coverage.shape[0]
    u, v = x * size - 0.5, y * size - 0.5
    column, row = int(np.floor(u)), int(np.floor(v))
    value = 0.0
    for i in range(row, row + 2):
        for j in range(column, column + 2):
            if 0 <= i < size and 0 <= j < size:
                value += (1.0 - abs(v - i)) * (1.0 - abs(u - j)) * coverage[i, j]
    return value


@kernel
def _is_inside(points: FloatArray, rim: IntArray, x: float, y: float) -> bool:
    winding = 0
    for e in range(rim.shape[0]):
        ax, ay = points[rim[e, 0], 0], points[rim[e, 0], 1]
        bx, by = points[rim[e, 1], 0], points[rim[e, 1], 1]
        if (ay > y) != (by > y) and x < ax + (y - ay) * (bx - ax) / (by - ay):
            winding += 1 if by > ay else -1
    return winding != 0


@kernel
def _contradicts(
    points: FloatArray, rim: IntArray, i: int, j: int, coverage: FloatArray, width: float, least: float
) -> bool:
    """Whether edges i and j come closer than `least`, or closer than `width` where the picture says otherwise."""
    ax, ay = points[rim[i, 0], 0], points[rim[i, 0], 1]
    dx, dy = points[rim[i, 1], 0] - ax, points[rim[i, 1], 1] - ay
    cx, cy = points[rim[j, 0], 0], points[rim[j, 0], 1]
    ex, ey = points[rim[j, 1], 0] - cx, points[rim[j, 1], 1] - cy
    length2 = ex * ex + ey * ey
    n = min(_MOST_SAMPLES, int(np.ceil(2.0 * np.sqrt(dx * dx + dy * dy) / width)) + 1)
    for k in range(n + 1):
        px, py = ax + k / n * dx, ay + k / n * dy
        t = min(1.0, max(0.0, ((px - cx) * ex + (py - cy) * ey) / length2)) if length2 > 0.0 else 0.0
        qx, qy = cx + t * ex, cy + t * ey
        distance = np.sqrt((px - qx) ** 2 + (py - qy) ** 2)
        if distance < least:
            return True
        if distance < width:
            x, y = 0.5 * (px + qx), 0.5 * (py + qy)
            shown = _coverage_at(coverage, x, y)
            if shown <= _FAINT and _is_inside(points, rim, x, y):
                return True
            if shown >= _FULL and not _is_inside(points, rim, x, y):
                return True
    return False


@kernel
def count_hairlines(points: FloatArray, rim: IntArray, coverage: FloatArray, width: float, least: float) -> int:
    """Pairs of boundary edges (`rim` (B, 2)) with a corridor or a slit between them that the picture has not.

    Pairs that share a vertex or are joined by a third edge make spikes and notches, no corridors, and do not count.
    """
    n_edges, n_pairs = rim.shape[0], 0
    after = np.full(points.shape[0], -1, np.int64)
    for e in range(n_edges):
        after[rim[e, 0]] = rim[e, 1]
    for i in range(n_edges):
        a, b = rim[i, 0], rim[i, 1]
        for j in range(n_edges):
            c, d = rim[j, 0], rim[j, 1]
            if i == j or a == c or a == d or b == c or b == d or after[b] == c or after[d] == a:
                continue
            near = segments_near(
                points[a, 0], points[a, 1], points[b, 0], points[b, 1],
                points[c, 0], points[c, 1], points[d, 0], points[d, 1], width,
            )  # fmt: skip
            if near and _contradicts(points, rim, i, j, coverage, width, least):
                n_pairs += 1
                break
    return n_pairs
