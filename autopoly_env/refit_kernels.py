"""Numba kernels of the refit: gradient descent from far away, damped Gauss-Newton nearby, the best sane mesh kept.

The unknowns are the N boundary vertices, numbered along the boundary loops so that the normal matrix is almost
banded; the other vertices do not show in the picture and follow their neighbours. Letters: V vertices, N boundary
vertices, B directed boundary edges, E edges, F faces, R pixels a side. Positions are in the unit square.
"""

from typing import NamedTuple

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray, IntArray
from autopoly_env.compute import kernel
from autopoly_env.mesh.geometry_kernels import defects
from autopoly_env.raster.derivative_kernels import half_gradient, normal_equations
from autopoly_env.raster.raster_kernels import Workspace

_FIRST_RATE, _LAST_RATE = 2.0 / 64.0, 0.1 / 64.0  # of the far phase, in unit-square lengths
_IDLE_SHARE = 0.03  # of the steepest slope: below it the far phase slows down, or idle vertices would race along edges
_MAX_MOVE = 4.0  # of a vertex in one step of the near phase, in pixels of the level


class Ties(NamedTuple):
    """What keeps unknowns from moving freely."""

    leader: IntArray  # (N,) the unknown of which this one is the mirror image; itself where it is none, -1 where locked
    on_axis: BoolArray  # (N,) the unknowns that stay on the axis
    axis: float  # x of the axis


class Shape(NamedTuple):
    """What the refit needs of a topology, as arrays."""

    boundary: IntArray  # (N,) vertex of each unknown
    loops: IntArray  # (B, 2) directed boundary edges between unknowns
    edges: IntArray  # (E, 2) between vertices
    corners: IntArray  # (H,) vertices of all faces, one face after the other
    offsets: IntArray  # (F+1,) where each face starts in `corners`
    inner: IntArray  # (K,) vertices that are not on the boundary
    neighbours: IntArray  # vertices joined to each inner vertex, one after the other
    neighbour_offsets: IntArray  # (K+1,)
    ties: Ties | None = None  # None where all unknowns are free: Numba then compiles a refit that knows of no ties


class Picture(NamedTuple):
    """One level of the target's pyramid."""

    coverage: FloatArray  # (R, R)
    row_sum: FloatArray  # (R, R+1)
    row_square_sum: FloatArray  # (R, R+1)
    weight_sum: FloatArray | None = None  # (R, R+1), see `derivative_kernels`


class Settings(NamedTuple):
    """The dials of a refit; `autopoly_env.refit.RefitConfig` says what they mean."""

    first_level: int
    n_near: int
    n_far: int
    stiffness: float
    damping: float
    tolerance: float
    keep_defects: bool


class Progress(NamedTuple):
    """The best sane mesh found so far, in arrays that the kernels write to."""

    points: FloatArray  # (V, 2)
    record: FloatArray  # (6,) loss at the current level; crossings, flipped faces allowed; evaluations; box low, high


@kernel
def _obey(
    ties: Ties | None, boundary: IntArray, start: FloatArray, low: float, high: float, unknowns: FloatArray
) -> None:  # fmt: skip
    """Put the unknowns that are tied where their ties want them: locked ones at their start, images opposite."""
    if ties is None:
        return
    left, right = max(low, 2.0 * ties.axis - high), min(high, 2.0 * ties.axis - low)  # so that images stay inside
    for n in range(unknowns.shape[0]):
        leader = ties.leader[n]
        if leader < 0:
            unknowns[n, 0], unknowns[n, 1] = start[boundary[n], 0], start[boundary[n], 1]
        elif ties.on_axis[n]:
            unknowns[n, 0] = ties.axis
        elif leader != n:
            unknowns[leader, 0] = min(max(unknowns[leader, 0], left), right)
            unknowns[n, 0] = 2.0 * ties.axis - unknowns[leader, 0]
            unknowns[n, 1] = unknowns[leader, 1]


@kernel
def _tie_gradient(ties: Ties | None, gradient: FloatArray) -> None:
    """Turn a gradient (N, 2) of free unknowns into that of the leading ones, 0 for those that do not lead."""
    if ties is None:
        return
    for n in range(gradient.shape[0]):
        leader = ties.leader[n]
        if leader >= 0 and leader != n:
            gradient[leader, 0] -= gradient[n, 0]
            gradient[leader, 1] += gradient[n, 1]
        if ties.on_axis[n]:
            gradient[n, 0] = 0.0
        if leader != n:
            gradient[n, 0] = 0.0
            gradient[n, 1] = 0.0


@kernel
def _tie_normal(ties: Ties | None, normal: FloatArray) -> None:
    """The same for the lower triangle of J'J (2N, 2N): rows and columns of images are added to those of their leaders,
    and all that do not lead become those of the unit matrix."""
    if ties is None:
        return
    size = normal.shape[0]
    for i in range(size):
        for j in range(i):
            normal[j, i] = normal[i, j]
    for k in range(size):
        n, axis = k >> 1, k & 1
        leader = ties.leader[n]
        if leader == n and not (axis == 0 and ties.on_axis[n]):
            continue
        if leader >= 0 and leader != n:
            sign = -1.0 if axis == 0 else 1.0
            normal[2 * leader + axis, :] += sign * normal[k, :]
            normal[:, 2 * leader + axis] += sign * normal[:, k]
        normal[k, :] = 0.0
        normal[:, k] = 0.0
        normal[k, k] = 1.0


@kernel
def _spread(start: FloatArray, unknowns: FloatArray, shape: Shape, low: float, high: float, points: FloatArray) -> None:
    """Write all V positions: boundary vertices from `unknowns`, inner ones moved by their neighbours' mean move."""
    points[:] = start
    for n in range(shape.boundary.shape[0]):
        points[shape.boundary[n], 0] = unknowns[n, 0]
        points[shape.boundary[n], 1] = unknowns[n, 1]
    if shape.inner.shape[0] == 0:
        return
    for _sweep in range(30):
        for k in range(shape.inner.shape[0]):
            v = shape.inner[k]
            first, last = shape.neighbour_offsets[k], shape.neighbour_offsets[k + 1]
            for axis in range(2):
                move = 0.0
                for m in range(first, last):
                    u = shape.neighbours[m]
                    move += points[u, axis] - start[u, axis]
                points[v, axis] = min(max(start[v, axis] + move / (last - first), low), high)


@kernel
def _offer(
    start: FloatArray, unknowns: FloatArray, shape: Shape, loss: float, trial: FloatArray, best: Progress
) -> bool:
    """Keep the mesh if it is sane and its loss is the least so far; say whether it is sane."""
    _spread(start, unknowns, shape, best.record[4], best.record[5], trial)
    crossings, flipped = defects(trial, shape.edges, shape.corners, shape.offsets)
    sane = crossings <= best.record[1] and flipped <= best.record[2]
    if sane and loss < best.record[0]:
        best.record[0] = loss
        best.points[:] = trial
    return sane


@kernel
def _loss(unknowns: FloatArray, shape: Shape, picture: Picture, work: Workspace, gradient: FloatArray) -> float:
    """Sum of squared coverage errors; half its gradient per pixel goes into `gradient` (N, 2)."""
    loss = half_gradient(
        unknowns,
        shape.loops,
        picture.coverage.shape[0],
        picture.coverage,
        picture.row_sum,
        picture.row_square_sum,
        work,
        gradient,
        picture.weight_sum,
    )
    _tie_gradient(shape.ties, gradient)
    return loss


@kernel
def far_phase(
    start: FloatArray, unknowns: FloatArray, shape: Shape, picture: Picture, n_steps: int, low: float, high: float,
    work: Workspace, trial: FloatArray, best: Progress,
) -> None:  # fmt: skip
    """Adam (Kingma and Ba 2015) on `unknowns`, with steps that shrink from `_FIRST_RATE` to `_LAST_RATE`."""
    n = unknowns.shape[0]
    gradient = np.empty((n, 2))
    mean = np.zeros((n, 2))
    square = np.zeros((n, 2))
    decay = (_LAST_RATE / _FIRST_RATE) ** (1.0 / max(1, n_steps - 1))
    rate = _FIRST_RATE
    mean_left, square_left = 1.0, 1.0
    for step in range(n_steps):
        loss = _loss(unknowns, shape, picture, work, gradient)
        best.record[3] += 1
        if step > 0 and step % 8 == 0 and loss < best.record[0]:
            _offer(start, unknowns, shape, loss, trial, best)
        mean_left *= 0.9
        square_left *= 0.95
        steepest = 0.0
        for v in range(n):
            for axis in range(2):
                g = gradient[v, axis]
                mean[v, axis] = 0.9 * mean[v, axis] + 0.1 * g
                square[v, axis] = 0.95 * square[v, axis] + 0.05 * g * g
                steepest = max(steepest, square[v, axis])
        floor = _IDLE_SHARE * np.sqrt(steepest / (1.0 - square_left)) + 1e-3
        for v in range(n):
            for axis in range(2):
                move = rate * mean[v, axis] / (1.0 - mean_left)
                move /= np.sqrt(square[v, axis] / (1.0 - square_left)) + floor
                unknowns[v, axis] = min(max(unknowns[v, axis] - move, low), high)
        _obey(shape.ties, shape.boundary, start, low, high, unknowns)
        rate *= decay


@kernel
def _solve_in_place(matrix: FloatArray, vector: FloatArray) -> bool:
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


@kernel
def _normal_equations(
    origin: FloatArray, unknowns: FloatArray, shape: Shape, picture: Picture, stiffness: float, work: Workspace,
    gradient: FloatArray, normal: FloatArray,
) -> float:  # fmt: skip
    """Sum of squared coverage errors plus `stiffness` times the squared changes (pixels) of the boundary edges since
    `origin` (N, 2); its half gradient J'r (N, 2) and the lower triangle of J'J (2N, 2N), both per pixel."""
    size = picture.coverage.shape[0]
    loss = normal_equations(
        unknowns,
        shape.loops,
        size,
        picture.coverage,
        picture.row_sum,
        picture.row_square_sum,
        work,
        gradient,
        normal,
        picture.weight_sum,
    )
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
    _tie_gradient(shape.ties, gradient)
    _tie_normal(shape.ties, normal)
    return loss


@kernel
def near_phase(
    start: FloatArray, unknowns: FloatArray, shape: Shape, picture: Picture, stiffness: float, strict: bool,
    settings: Settings, low: float, high: float, work: Workspace, trial: FloatArray, best: Progress,
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
    loss = _normal_equations(origin, unknowns, shape, picture, stiffness, work, gradient, normal)
    factor = 1e-2
    for _step in range(settings.n_near):
        best.record[3] += 1
        matrix[:] = normal
        for k in range(2 * n):
            matrix[k, k] += factor * normal[k, k] + settings.damping
            move[k] = -gradient[k >> 1, k & 1]
        if not _solve_in_place(matrix, move):
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
        _obey(shape.ties, shape.boundary, start, low, high, candidate)
        next_loss = _normal_equations(origin, candidate, shape, picture, stiffness, work, next_gradient, next_normal)
        if next_loss < loss:
            sane = _offer(start, candidate, shape, next_loss, trial, best)
        else:
            sane = False
        if not next_loss < loss or (strict and not sane):
            factor = max(5.0 * factor, 1e-3)
            if factor > 1e6 or longest * scale * size < 1e-4:
                return
            continue
        gain = loss - next_loss
        unknowns[:] = candidate
        loss = next_loss
        gradient, next_gradient = next_gradient, gradient
        normal, next_normal = next_normal, normal
        factor = 0.2 * factor if factor > 1e-6 else factor
        if gain < settings.tolerance * loss + 1e-9:
            return


@kernel
def _restore_idle(
    start: FloatArray, shape: Shape, picture: Picture, work: Workspace, trial: FloatArray, best: Progress
) -> None:
    """Put vertices that moved less than a tenth of a pixel back to their start if that costs next to nothing."""
    size = picture.coverage.shape[0]
    n = shape.boundary.shape[0]
    unknowns = np.empty((n, 2))
    idle = 0
    for k in range(n):
        v = shape.boundary[k]
        move = max(abs(best.points[v, 0] - start[v, 0]), abs(best.points[v, 1] - start[v, 1]))
        source = start if move * size < 0.1 else best.points
        idle += move > 0.0 and move * size < 0.1
        unknowns[k, 0] = source[v, 0]
        unknowns[k, 1] = source[v, 1]
    if idle == 0:
        return
    _obey(shape.ties, shape.boundary, start, best.record[4], best.record[5], unknowns)
    loss = _loss(unknowns, shape, picture, work, np.empty((n, 2)))
    allowed = best.record[0] * 1.001 + 1e-3
    if loss <= allowed:
        kept = best.record[0]
        best.record[0] = np.inf
        if not _offer(start, unknowns, shape, loss, trial, best):
            best.record[0] = kept


@kernel
def refit(
    start: FloatArray, shape: Shape, pyramid: tuple[Picture, ...], settings: Settings, work: Workspace,
    result: FloatArray,
) -> tuple[float, float, int]:  # fmt: skip
    """Fit all vertices to the target; write (V, 2) `result`; return (loss before, loss after, evaluations).

    The loss is the sum of squared coverage errors at the last, finest picture of `pyramid`. The result has no larger
    loss than the start, and no more crossings or flipped faces unless `settings.keep_defects` is true.
    """
    n = shape.boundary.shape[0]
    trial = np.empty_like(start)
    unknowns, scratch = np.empty((n, 2)), np.empty((n, 2))
    low, high = 0.0, 1.0
    for k in range(n):
        v = shape.boundary[k]
        for axis in range(2):
            unknowns[k, axis] = start[v, axis]
            low, high = min(low, start[v, axis]), max(high, start[v, axis])
    fine = pyramid[len(pyramid) - 1]
    crossings, flipped = defects(start, shape.edges, shape.corners, shape.offsets)
    best = Progress(start.copy(), np.zeros(6))
    best.record[1] = 1e9 if settings.keep_defects else crossings
    best.record[2] = 1e9 if settings.keep_defects else flipped
    best.record[4], best.record[5] = low, high
    loss_before = _loss(unknowns, shape, fine, work, scratch)

    _descend(start, unknowns, shape, pyramid, settings.first_level, settings, low, high, work, trial, best)
    if settings.n_far > 0:
        picture = pyramid[max(0, len(pyramid) - 3)]
        _rebase(shape, picture, work, scratch, best)
        far_phase(start, unknowns, shape, picture, settings.n_far, low, high, work, trial, best)
        _descend(start, unknowns, shape, pyramid, len(pyramid) - 2, settings, low, high, work, trial, best)
    _rebase(shape, fine, work, scratch, best)
    reached = _loss(unknowns, shape, fine, work, scratch)
    if reached < 0.98 * best.record[0]:  # the free search ended in a mesh that is not sane
        _take_boundary(best.points, shape, unknowns)
        near_phase(start, unknowns, shape, fine, 0.0, True, settings, low, high, work, trial, best)
    if best.record[0] <= loss_before:
        _restore_idle(start, shape, fine, work, trial, best)
    if not best.record[0] < loss_before:
        result[:] = start
        return loss_before, loss_before, int(best.record[3])
    result[:] = best.points
    return loss_before, best.record[0], int(best.record[3])


@kernel
def _descend(
    start: FloatArray, unknowns: FloatArray, shape: Shape, pyramid: tuple[Picture, ...], first_level: int,
    settings: Settings, low: float, high: float, work: Workspace, trial: FloatArray, best: Progress,
) -> None:  # fmt: skip
    """Near phase from `first_level` of the pyramid to its last, each level less stiff than the one before."""
    scratch = np.empty_like(unknowns)
    last = len(pyramid) - 1
    for level in range(max(0, first_level), last + 1):
        stiffness = 0.0 if level == last else settings.stiffness * 0.3 ** max(0, level - 1)
        _rebase(shape, pyramid[level], work, scratch, best)
        near_phase(start, unknowns, shape, pyramid[level], stiffness, False, settings, low, high, work, trial, best)


@kernel
def _take_boundary(points: FloatArray, shape: Shape, unknowns: FloatArray) -> None:
    for k in range(shape.boundary.shape[0]):
        unknowns[k, 0] = points[shape.boundary[k], 0]
        unknowns[k, 1] = points[shape.boundary[k], 1]


@kernel
def _rebase(shape: Shape, picture: Picture, work: Workspace, scratch: FloatArray, best: Progress) -> None:
    """Restate the loss of the best mesh so far at another level."""
    unknowns = np.empty((shape.boundary.shape[0], 2))
    _take_boundary(best.points, shape, unknowns)
    best.record[0] = _loss(unknowns, shape, picture, work, scratch)
