"""The Numba kernel that paints polygons over each other: the picture of a model whose surface may be anything."""

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray, IntArray
from autopoly_env.compute import kernel


@kernel
def paint_polygons(points: FloatArray, ends: IntArray, image: BoolArray) -> None:
    """Set every sample of `image` (N, N) whose centre lies in one of the polygons, by the non-zero winding rule.

    `points` (C, 2): the corners of all polygons, one after the other, in samples (x right, y down); polygon f has those
    from ends[f] to ends[f + 1]. Scan lines: a crossing is computed from the upper end of an edge to the lower one, so
    that two polygons that share an edge leave no gap along it, whichever way each of them runs.
    """
    n = len(image)
    longest = 0
    for f in range(len(ends) - 1):
        longest = max(longest, ends[f + 1] - ends[f])
    xs, windings = np.empty(longest), np.empty(longest, np.int64)
    for f in range(len(ends) - 1):
        begin, end = ends[f], ends[f + 1]
        low, high = np.inf, -np.inf
        for k in range(begin, end):
            low, high = min(low, points[k, 1]), max(high, points[k, 1])
        for row in range(max(0, int(np.ceil(low - 0.5))), min(n, int(np.ceil(high - 0.5)))):
            n_crossings = _crossings(points, begin, end, row + 0.5, xs, windings)
            winding = 0
            for k in range(n_crossings - 1):
                winding += windings[k]
                if winding != 0:
                    first = max(0, int(np.ceil(xs[k] - 0.5)))
                    last = min(n, int(np.ceil(xs[k + 1] - 0.5)))
                    for column in range(first, last):
                        image[row, column] = True


@kernel
def _crossings(points: FloatArray, begin: int, end: int, y: float, xs: FloatArray, windings: IntArray) -> int:
    """Where the polygon crosses the line at y: into `xs`, ascending, and how, +1 or -1; returns their number."""
    n = 0
    for k in range(begin, end):
        a, b = k, k + 1 if k + 1 < end else begin
        if (points[a, 1] <= y) == (points[b, 1] <= y):
            continue
        winding = 1
        if points[a, 1] > points[b, 1]:
            a, b, winding = b, a, -1
        share = (y - points[a, 1]) / (points[b, 1] - points[a, 1])
        x = points[a, 0] + share * (points[b, 0] - points[a, 0])
        place = n
        while place > 0 and xs[place - 1] > x:
            xs[place], windings[place] = xs[place - 1], windings[place - 1]
            place -= 1
        xs[place], windings[place] = x, winding
        n += 1
    return n
