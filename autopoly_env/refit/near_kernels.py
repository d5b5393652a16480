"""Descent near an optimum: limited-memory BFGS whose first guess is damped Gauss-Newton. Letters: see `shape_kernels`.

Where a boundary sweeps over pixels that are wrong altogether the squared error falls in proportion to its way, and the
normal equations J'J see a curvature that is not there: their steps are too short by half or more, one after the other.
What gradients say about the true curvature mends that (Liu and Nocedal 1989), so that J'J is needed once a level.
"""

from typing import NamedTuple

import numpy as np

from autopoly_env.arrays import FloatArray
from autopoly_env.compute import kernel, uncounted_kernel
from autopoly_env.raster.derivative_kernels import half_gradient, normal_equations
from autopoly_env.raster.raster_kernels import Picture, Workspace
from autopoly_env.refit.cholesky_kernels import Factor, factorise, solve
from autopoly_env.refit.rule_kernels import hinge, hold
from autopoly_env.refit.shape_kernels import (
    HIGH,
    LOSS,
    LOW,
    N_EVALUATIONS,
    Progress,
    Settings,
    Shape,
    is_at,
    obey,
    offer,
    put,
    rebase,
    tie_gradient,
    tie_normal,
)

_MAX_MOVE = 4.0  # of a vertex in one step of the near phase, in pixels of the level
_LEAST_MOVE = 1e-5  # pixels; a step that is shorter still does not pay
_N_KEPT = 5  # steps that are remembered
_FIRST_STRETCH = 1.5  # of the first step, which nothing is known about
_MOST_STRETCH = 4.0  # of a step by what was remembered of the curvature
_LEAST_CURVATURE = 1e-4  # per squared pixel, of a step that is worth remembering
_N_TRIES = 4  # of ever shorter steps in one direction
_RELATIVE_DAMPING = 1e-2
_MOST_DAMPING = 1e3  # beyond which no shorter step is tried
_COARSE = 5.0  # times the tolerance, on levels that are followed by a finer one


class _Memory(NamedTuple):
    """The last steps, oldest first."""

    moves: FloatArray  # (K, 2N) in pixels
    changes: FloatArray  # (K, 2N) of half the gradient
    products: FloatArray  # (K,) of the two
    shares: FloatArray  # (K,) scratch
    solved: FloatArray  # (2N,) scratch


@kernel
def near_phase(
    unknowns: FloatArray, shape: Shape, picture: Picture, stiffness: float, strict: bool, settings: Settings,
    work: Workspace, best: Progress,
) -> float:  # fmt: skip
    """Descend on `unknowns` and return the loss reached; `strict` refuses steps to meshes that are not sane.

    Beside the relative damping an absolute one holds vertices that slide along a straight edge; `stiffness` keeps the
    boundary edges near what they were, which is what keeps a far target from tangling the outline.
    """
    n = unknowns.shape[0]
    size = picture.coverage.shape[0]
    gradient, next_gradient, candidate = np.empty((n, 2)), np.empty((n, 2)), np.empty((n, 2))
    factor, move = Factor(np.empty((2 * n, 2 * n)), np.empty(2 * n, np.int64)), np.empty(2 * n)
    memory = _Memory(
        *(np.empty((_N_KEPT, 2 * n)), np.empty((_N_KEPT, 2 * n))),
        *(np.empty(_N_KEPT), np.empty(_N_KEPT), np.empty(2 * n)),
    )
    origin = unknowns.copy()
    damping, n_kept, stretch = _RELATIVE_DAMPING, 0, 1.0
    loss = damped_equations(origin, unknowns, shape, picture, stiffness, work, gradient, factor.matrix)
    best.record[N_EVALUATIONS] += 1
    if is_at(unknowns, shape, best):
        best.record[LOSS] = loss
    else:
        rebase(shape, picture, work, next_gradient, best)
    is_factored = factorise(factor, damping, settings.damping)
    for _step in range(settings.n_near):
        if not is_factored:
            return loss
        longest, foreseen = _direction(gradient, factor, memory, n_kept, stretch, move)
        tolerance = (settings.tolerance if stiffness == 0.0 else _COARSE * settings.tolerance) * loss + 1e-9
        if foreseen < 0.5 * tolerance:
            return loss
        length = min(_FIRST_STRETCH if n_kept == 0 else 1.0, _MAX_MOVE / longest)
        is_better = False
        next_loss = loss
        for _try in range(_N_TRIES):
            if longest * length < _LEAST_MOVE:
                return loss
            _stride(unknowns, length / size, move, shape, best, candidate)
            next_loss = damped_gradient(origin, candidate, shape, picture, stiffness, work, next_gradient)
            best.record[N_EVALUATIONS] += 1
            if next_loss < loss:
                is_sane = offer(candidate, shape, next_loss, best)
                is_better = is_sane or not strict
                if is_better:
                    break
            length *= _shorter(unknowns, candidate, gradient, size, next_loss - loss)
        if not is_better:
            damping = max(25.0 * damping, 0.1)
            if damping > _MOST_DAMPING:
                return loss
            n_kept, stretch = 0, 1.0
            damped_equations(origin, unknowns, shape, picture, stiffness, work, gradient, factor.matrix)
            best.record[N_EVALUATIONS] += 1
            is_factored = factorise(factor, damping, settings.damping)
            continue
        n_kept, stretch = _remember(unknowns, candidate, gradient, next_gradient, size, factor, memory, n_kept, stretch)
        gain = loss - next_loss
        put(candidate, unknowns)
        gradient, next_gradient = next_gradient, gradient
        loss = next_loss
        if gain < tolerance:
            return loss
    return loss


@uncounted_kernel
def _direction(
    gradient: FloatArray, factor: Factor, memory: _Memory, n_kept: int, stretch: float, move: FloatArray
) -> tuple[float, float]:
    """Write the step (2N,) in pixels into `move`; return how far it moves a vertex at most, and the gain foreseen.

    The two loops of limited-memory BFGS about the solution of the damped normal equations, which is made longer by
    `stretch`.
    """
    n = move.shape[0]
    for k in range(n):
        move[k] = -gradient[k >> 1, k & 1]
    for i in range(n_kept - 1, -1, -1):
        share = 0.0
        for k in range(n):
            share += memory.moves[i, k] * move[k]
        memory.shares[i] = share / memory.products[i]
        for k in range(n):
            move[k] -= memory.shares[i] * memory.changes[i, k]
    solve(factor, move)
    for k in range(n):
        move[k] *= stretch
    for i in range(n_kept):
        share = 0.0
        for k in range(n):
            share += memory.changes[i, k] * move[k]
        share = memory.shares[i] - share / memory.products[i]
        for k in range(n):
            move[k] += share * memory.moves[i, k]
    longest, foreseen = 0.0, 0.0
    for v in range(n >> 1):
        x, y = move[2 * v], move[2 * v + 1]
        longest = max(longest, x * x + y * y)
        foreseen -= x * gradient[v, 0] + y * gradient[v, 1]
    return max(np.sqrt(longest), 1e-12), foreseen


@uncounted_kernel
def _stride(
    unknowns: FloatArray, length: float, move: FloatArray, shape: Shape, best: Progress, candidate: FloatArray
) -> None:
    """Write where `length` times the step leads from `unknowns`, inside the box, as rule and ties want it."""
    low, high = best.record[LOW], best.record[HIGH]
    for v in range(unknowns.shape[0]):
        candidate[v, 0] = min(max(unknowns[v, 0] + length * move[2 * v], low), high)
        candidate[v, 1] = min(max(unknowns[v, 1] + length * move[2 * v + 1], low), high)
    hold(shape.rule, candidate, low, high)
    obey(shape.ties, shape.boundary, best, candidate)


@uncounted_kernel
def _shorter(unknowns: FloatArray, candidate: FloatArray, gradient: FloatArray, size: int, rise: float) -> float:
    """By what a step that made the loss `rise` is to be shortened: to the lowest point of a parabola, or to a half."""
    slope = 0.0
    for v in range(unknowns.shape[0]):
        for axis in range(2):
            slope += 2.0 * size * gradient[v, axis] * (candidate[v, axis] - unknowns[v, axis])
    bend = rise - slope
    return min(max(-0.5 * slope / bend, 0.1), 0.5) if bend > 0.0 else 0.25


@uncounted_kernel
def _remember(
    unknowns: FloatArray, candidate: FloatArray, gradient: FloatArray, next_gradient: FloatArray, size: int,
    factor: Factor, memory: _Memory, n_kept: int, stretch: float,
) -> tuple[int, float]:  # fmt: skip
    """Keep what the step to `candidate` told of the curvature; return how many steps are kept, and the stretch."""
    n = memory.moves.shape[1]
    if n_kept == _N_KEPT:
        for i in range(_N_KEPT - 1):
            for k in range(n):
                memory.moves[i, k] = memory.moves[i + 1, k]
                memory.changes[i, k] = memory.changes[i + 1, k]
            memory.products[i] = memory.products[i + 1]
        n_kept -= 1
    product, square = 0.0, 0.0
    for k in range(n):
        v, axis = k >> 1, k & 1
        memory.moves[n_kept, k] = size * (candidate[v, axis] - unknowns[v, axis])
        memory.changes[n_kept, k] = next_gradient[v, axis] - gradient[v, axis]
        product += memory.moves[n_kept, k] * memory.changes[n_kept, k]
        square += memory.moves[n_kept, k] ** 2
    if not product > _LEAST_CURVATURE * square:
        return n_kept, stretch
    memory.products[n_kept] = product
    for k in range(n):
        memory.solved[k] = memory.changes[n_kept, k]
    solve(factor, memory.solved)
    square = 0.0
    for k in range(n):
        square += memory.solved[k] * memory.changes[n_kept, k]
    return n_kept + 1, min(max(product / square, 1.0), _MOST_STRETCH)


@uncounted_kernel
def damped_gradient(
    origin: FloatArray, unknowns: FloatArray, shape: Shape, picture: Picture, stiffness: float, work: Workspace,
    gradient: FloatArray,
) -> float:  # fmt: skip
    """`damped_equations` without J'J."""
    size = picture.coverage.shape[0]
    loss = half_gradient(unknowns, shape.loops, picture, work, gradient)
    loss += _stretching(origin, unknowns, shape, stiffness, size, gradient)
    loss += hinge(shape.rule, origin, unknowns, size, gradient, gradient[:0])
    tie_gradient(shape.ties, gradient)
    return loss


@uncounted_kernel
def damped_equations(
    origin: FloatArray, unknowns: FloatArray, shape: Shape, picture: Picture, stiffness: float, work: Workspace,
    gradient: FloatArray, normal: FloatArray,
) -> float:  # fmt: skip
    """Sum of squared coverage errors plus `stiffness` times the squared changes (pixels) of the boundary edges since
    `origin` (N, 2), plus what breaks the rule of faces; its half gradient J'r (N, 2) and the lower triangle of J'J
    (2N, 2N), both per pixel."""
    size = picture.coverage.shape[0]
    loss = normal_equations(unknowns, shape.loops, picture, work, gradient, normal)
    loss += _stretching(origin, unknowns, shape, stiffness, size, gradient)
    for e in range(shape.loops.shape[0] if stiffness != 0.0 else 0):
        i, j = shape.loops[e, 0], shape.loops[e, 1]
        for axis in range(2):
            normal[2 * i + axis, 2 * i + axis] += stiffness
            normal[2 * j + axis, 2 * j + axis] += stiffness
            normal[2 * max(i, j) + axis, 2 * min(i, j) + axis] -= stiffness
    loss += hinge(shape.rule, origin, unknowns, size, gradient, normal)
    tie_gradient(shape.ties, gradient)
    tie_normal(shape.ties, normal)
    return loss


@uncounted_kernel
def _stretching(
    origin: FloatArray, unknowns: FloatArray, shape: Shape, stiffness: float, size: int, gradient: FloatArray
) -> float:
    """What the boundary edges cost that are not what they were; half its gradient per pixel is added to `gradient`."""
    loss = 0.0
    for e in range(shape.loops.shape[0] if stiffness != 0.0 else 0):
        i, j = shape.loops[e, 0], shape.loops[e, 1]
        for axis in range(2):
            change = unknowns[j, axis] - unknowns[i, axis] - origin[j, axis] + origin[i, axis]
            change *= size
            loss += stiffness * change * change
            gradient[j, axis] += stiffness * change
            gradient[i, axis] -= stiffness * change
    return loss
