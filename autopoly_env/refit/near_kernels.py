"""Damped Gauss-Newton near an optimum. Letters: see `shape_kernels`."""

import numpy as np

from autopoly_env.arrays import FloatArray
from autopoly_env.compute import kernel
from autopoly_env.raster.derivative_kernels import normal_equations
from autopoly_env.raster.raster_kernels import Picture, Workspace
from autopoly_env.refit.rule_kernels import hinge, hold
from autopoly_env.refit.shape_kernels import (
    HIGH,
    LOW,
    N_EVALUATIONS,
    Progress,
    Settings,
    Shape,
    obey,
    offer,
    put,
    tie_gradient,
    tie_normal,
)

_MAX_MOVE = 4.0  # of a vertex in one step of the near phase, in pixels of the level


@kernel
def near_phase(
    unknowns: FloatArray, shape: Shape, picture: Picture, stiffness: float, strict: bool, settings: Settings,
    work: Workspace, best: Progress,
) -> None:  # fmt: skip
    """Levenberg-Marquardt (Marquardt 1963) on `unknowns`; `strict` refuses steps to meshes that are not sane.

    Beside Marquardt's relative damping an absolute one holds vertices that slide along a straight edge; `stiffness`
    keeps the boundary edges near what they were, which is what keeps a far target from tangling the outline.
    """
    n = unknowns.shape[0]
    size = picture.coverage.shape[0]
    gradient, normal = np.empty((n, 2)), np.empty((2 * n, 2 * n))
    next_gradient, next_normal = np.empty((n, 2)), np.empty((2 * n, 2 * n))
    candidate = np.empty((n, 2))
    matrix, move = np.empty((2 * n, 2 * n)), np.empty(2 * n)
    origin = unknowns.copy()
    low, high = best.record[LOW], best.record[HIGH]
    loss = damped_equations(origin, unknowns, shape, picture, stiffness, work, gradient, normal)
    factor = 1e-2
    for _step in range(settings.n_near):
        best.record[N_EVALUATIONS] += 1
        put(normal, matrix)
        for k in range(2 * n):
            matrix[k, k] += factor * normal[k, k] + settings.damping
            move[k] = -gradient[k >> 1, k & 1]
        if not solve_in_place(matrix, move):
            factor = max(10.0 * factor, 1e-3)
            continue
        longest = 0.0
        for v in range(n):
            longest = max(longest, move[2 * v] ** 2 + move[2 * v + 1] ** 2)
        longest = np.sqrt(longest)
        scale = (1.0 if longest <= _MAX_MOVE else _MAX_MOVE / longest) / size
        for v in range(n):
            candidate[v, 0] = min(max(unknowns[v, 0] + scale * move[2 * v], low), high)
            candidate[v, 1] = min(max(unknowns[v, 1] + scale * move[2 * v + 1], low), high)
        hold(shape.rule, candidate, low, high)
        obey(shape.ties, shape.boundary, best, candidate)
        next_loss = damped_equations(origin, candidate, shape, picture, stiffness, work, next_gradient, next_normal)
        if next_loss < loss:
            sane = offer(candidate, shape, next_loss, best)
        else:
            sane = False
        if not next_loss < loss or (strict and not sane):
            factor = max(5.0 * factor, 1e-3)
            if factor > 1e6 or longest * scale * size < 1e-4:
                return
            continue
        gain = loss - next_loss
        put(candidate, unknowns)
        loss = next_loss
        gradient, next_gradient = next_gradient, gradient
        normal, next_normal = next_normal, normal
        factor = 0.2 * factor if factor > 1e-6 else factor
        if gain < settings.tolerance * loss + 1e-9:
            return


@kernel
def damped_equations(
    origin: FloatArray, unknowns: FloatArray, shape: Shape, picture: Picture, stiffness: float, work: Workspace,
    gradient: FloatArray, normal: FloatArray,
) -> float:  # fmt: skip
    """Sum of squared coverage errors plus `stiffness` times the squared changes (pixels) of the boundary edges since
    `origin` (N, 2), plus what breaks the rule of faces; its half gradient J'r (N, 2) and the lower triangle of J'J
    (2N, 2N), both per pixel."""
    size = picture.coverage.shape[0]
    loss = normal_equations(unknowns, shape.loops, picture, work, gradient, normal)
    for e in range(shape.loops.shape[0] if stiffness != 0.0 else 0):
        i, j = shape.loops[e, 0], shape.loops[e, 1]
        for axis in range(2):
            change = unknowns[j, axis] - unknowns[i, axis] - origin[j, axis] + origin[i, axis]
            change *= size
            loss += stiffness * change * change
            gradient[j, axis] += stiffness * change
            gradient[i, axis] -= stiffness * change
            normal[2 * i + axis, 2 * i + axis] += stiffness
            normal[2 * j + axis, 2 * j + axis] += stiffness
            normal[2 * max(i, j) + axis, 2 * min(i, j) + axis] -= stiffness
    loss += hinge(shape.rule, origin, unknowns, size, gradient, normal)
    tie_gradient(shape.ties, gradient)
    tie_normal(shape.ties, normal)
    return loss


@kernel
def solve_in_place(matrix: FloatArray, vector: FloatArray) -> bool:
    """Solve matrix x = vector by an envelope Cholesky factorisation of the lower triangle; False if not definite."""
    n = vector.shape[0]
    first = np.empty(n, np.int64)
    for i in range(n):
        j = 0
        while j < i and matrix[i, j] == 0.0:
            j += 1
        first[i] = j
        for j in range(first[i], i):
            total = matrix[i, j]
            for k in range(max(first[i], first[j]), j):
                total -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = total / matrix[j, j]
        total = matrix[i, i]
        for k in range(first[i], i):
            total -= matrix[i, k] * matrix[i, k]
        if not total > 0.0:
            return False
        matrix[i, i] = np.sqrt(total)
        total = vector[i]
        for k in range(first[i], i):
            total -= matrix[i, k] * vector[k]
        vector[i] = total / matrix[i, i]
    for i in range(n - 1, -1, -1):
        vector[i] /= matrix[i, i]
        for k in range(first[i], i):
            vector[k] -= matrix[i, k] * vector[i]
    return True
