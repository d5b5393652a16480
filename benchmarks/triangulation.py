"""Ear clipping: the peers fill triangles only, so that a polygon must be cut before they can draw it."""

import numpy as np
import numpy.typing as npt
from numba import njit

from autopoly_env.arrays import BoolArray, FloatArray

Triangles = tuple[npt.NDArray[np.uint32], BoolArray]


@njit(cache=True)
def triangulate(points: FloatArray) -> Triangles:
    """Cut a polygon (n, 2) of positive area into n-2 triangles.

    Returns the corners (n-2, 3), wound like the polygon, and flags (n-2, 3): whether the side from corner k to corner
    k+1 is a side of the polygon. One that crosses itself is cut as well as it can be.
    """
    n = len(points)
    triangles = np.empty((n - 2, 3), np.uint32)
    outer = np.empty((n - 2, 3), np.bool_)
    left = list(range(n))
    for t in range(n - 2):
        at = _ear(points, left)
        m = len(left)
        corners = (left[at - 1], left[at], left[(at + 1) % m])
        for k in range(3):
            triangles[t, k] = corners[k]
            outer[t, k] = (corners[k] + 1) % n == corners[(k + 1) % 3]
        left.pop(at)
    return triangles, outer


@njit(cache=True)
def _ear(points: FloatArray, left: list[int]) -> int:
    """Position of a corner that can be cut off; the one of largest area where there is none."""
    m = len(left)
    largest, fallback = -np.inf, 0
    for at in range(m):
        i, j, k = left[at - 1], left[at], left[(at + 1) % m]
        area = _area(points, i, j, k)
        if area > largest:
            largest, fallback = area, at
        if area <= 0.0:
            continue
        free = True
        for p in left:
            if p != i and p != j and p != k and _inside(points, p, i, j, k):
                free = False
                break
        if free:
            return at
    return fallback


@njit(cache=True)
def _inside(points: FloatArray, p: int, i: int, j: int, k: int) -> bool:
    return _area(points, i, j, p) >= 0.0 and _area(points, j, k, p) >= 0.0 and _area(points, k, i, p) >= 0.0


@njit(cache=True)
def _area(points: FloatArray, i: int, j: int, k: int) -> float:
    ax, ay = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
    bx, by = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1]
    return ax * by - ay * bx
