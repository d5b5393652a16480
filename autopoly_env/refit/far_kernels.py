"""Gradient descent from far away, which may leave an optimum that is none. Letters: see `shape_kernels`."""

import numpy as np

from autopoly_env.arrays import FloatArray
from autopoly_env.compute import kernel
from autopoly_env.raster.raster_kernels import Picture, Workspace
from autopoly_env.refit.rule_kernels import hold
from autopoly_env.refit.shape_kernels import HIGH, LOSS, LOW, N_EVALUATIONS, Progress, Shape, loss_at, obey, offer

_FIRST_RATE, _LAST_RATE = 2.0 / 64.0, 0.1 / 64.0  # of the far phase, in unit-square lengths
_IDLE_SHARE = 0.03  # of the steepest slope: below it the far phase slows down, or idle vertices would race along edges


@kernel
def far_phase(
    unknowns: FloatArray, shape: Shape, picture: Picture, n_steps: int, work: Workspace, best: Progress
) -> None:
    """Adam (Kingma and Ba 2015) on `unknowns`, with steps that shrink from `_FIRST_RATE` to `_LAST_RATE`."""
    n = unknowns.shape[0]
    low, high = best.record[LOW], best.record[HIGH]
    gradient = np.empty((n, 2))
    mean = np.zeros((n, 2))
    square = np.zeros((n, 2))
    decay = (_LAST_RATE / _FIRST_RATE) ** (1.0 / max(1, n_steps - 1))
    rate = _FIRST_RATE
    mean_left, square_left = 1.0, 1.0
    for step in range(n_steps):
        loss = loss_at(unknowns, shape, picture, work, gradient)
        best.record[N_EVALUATIONS] += 1
        if step > 0 and step % 8 == 0 and loss < best.record[LOSS]:
            offer(unknowns, shape, loss, best)
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
        hold(shape.rule, unknowns, low, high)
        obey(shape.ties, shape.boundary, best, unknowns)
        rate *= decay
