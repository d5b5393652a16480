"""Numba kernels that simplify a closed contour: Visvalingam's thinning, then the best polygon of every size."""

import numpy as np

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.compute import kernel


@kernel
def thin(points: FloatArray, n_keep: int) -> IntArray:
    """Indices of the points left when the one that spans the least triangle is dropped until `n_keep` remain.

    Visvalingam and Whyatt 1993, "Line generalisation by repeated elimination of points", on a closed line.
    """
    n = points.shape[0]
    before, after = np.arange(n) - 1, np.arange(n) + 1
    before[0], after[n - 1] = n - 1, 0
    area = np.empty(n)
    for i in range(n):
        area[i] = _triangle(points, before[i], i, after[i])
    for _ in range(n - n_keep):
        least = 0
        for i in range(1, n):
            if area[i] < area[least]:
                least = i
        area[least] = np.inf
        i, j = before[least], after[least]
        after[i], before[j] = j, i
        area[i] = max(_triangle(points, before[i], i, j), 0.0)
        area[j] = max(_triangle(points, i, j, after[j]), 0.0)
    left, n_left = np.empty(n, np.int64), 0
    for i in range(n):
        if area[i] < np.inf:
            left[n_left] = i
            n_left += 1
    return left[:n_left].copy()


@kernel
def _triangle(points: FloatArray, a: int, b: int, c: int) -> float:
    ux, uy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    vx, vy = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
    return 0.5 * abs(ux * vy - uy * vx)


@kernel
def chord_errors(points: FloatArray, longest: int) -> FloatArray:
    """(n, n+1) area between the contour from point i to point j (n is point 0 again) and the chord, for i < j.

    Infinite where a chord spans more than `longest` points.
    """
    n = points.shape[0]
    errors, ring = np.full((n, n + 1), np.inf), np.empty((n + 1, 2))
    for k in range(n + 1):  # once, for a remainder takes as long as the rest of a step
        ring[k, 0], ring[k, 1] = points[k % n, 0], points[k % n, 1]
    for i in range(n):
        for j in range(i + 1, min(n, i + longest) + 1):
            ax, ay = ring[i, 0], ring[i, 1]
            dx, dy = ring[j, 0] - ax, ring[j, 1] - ay
            length = np.sqrt(dx * dx + dy * dy)
            if length == 0.0:
                continue
            dx, dy = dx / length, dy / length
            error, along, across = 0.0, 0.0, 0.0
            for k in range(i + 1, j + 1):
                px, py = ring[k, 0] - ax, ring[k, 1] - ay
                next_along, next_across = px * dx + py * dy, py * dx - px * dy
                step, a, b = abs(next_along - along), abs(across), abs(next_across)
                if across * next_across >= 0.0:
                    error += 0.5 * step * (a + b)
                else:  # the contour crosses the chord here: two triangles
                    error += 0.5 * step * (a * a + b * b) / (a + b)
                along, across = next_along, next_across
            errors[i, j] = error
    return errors


@kernel
def best_polygons(errors: FloatArray, n_most: int, longest: int) -> tuple[FloatArray, IntArray]:
    """The polygon of every size 1..n_most through point 0 that errs least; no chord spans more than `longest` points.

    Returns (n_most+1,) least errors and (n_most+1, n+1) where in the best way to point j with k chords the last chord
    begins: dynamic programming over the end of the last chord (Perez and Vidal 1994, "Optimum polygonal approximation
    of digitized curves").
    """
    n = errors.shape[0]
    least = np.full((n_most + 1, n + 1), np.inf)
    came_from = np.zeros((n_most + 1, n + 1), np.int64)
    least[0, 0] = 0.0
    for k in range(1, n_most + 1):
        for j in range(k, n + 1):
            for i in range(max(k - 1, j - longest), j):
                error = least[k - 1, i] + errors[i, j]
                if error < least[k, j]:
                    least[k, j] = error
                    came_from[k, j] = i
    return least[:, n].copy(), came_from
