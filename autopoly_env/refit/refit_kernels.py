"""The refit as a whole: the near phase up the pyramid, the far phase if it is asked for, the best sane mesh kept.

Letters: see `shape_kernels`.
"""

import numpy as np

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.compute import kernel
from autopoly_env.mesh.geometry_kernels import count_defects
from autopoly_env.raster.raster_kernels import Picture, Workspace
from autopoly_env.refit.far_kernels import far_phase
from autopoly_env.refit.near_kernels import near_phase
from autopoly_env.refit.pyramid_kernels import picture_in
from autopoly_env.refit.shape_kernels import (
    HIGH,
    LOSS,
    LOW,
    MOST_CROSSINGS,
    MOST_FLIPPED,
    MOST_HAIRLINES,
    N_EVALUATIONS,
    Progress,
    Settings,
    Shape,
    loss_at,
    obey,
    offer,
    put,
    rebase,
    shape_of,
    take_boundary,
)

_NEARLY_RIGHT = 1.0  # times R: a loss below it leaves next to nothing for the far phase to gain


@kernel
def refit(
    start: FloatArray, packed: IntArray, bound: IntArray, axis: float, asked: float,
    coverages: FloatArray, sums: FloatArray,
    first_level: int, n_near: int, n_far: int, stiffness: float, damping: float, tolerance: float, keep_defects: bool,
    work: Workspace, result: FloatArray,
) -> tuple[float, float, int]:  # fmt: skip
    """Fit all vertices to the target; write (V, 2) `result`; return (loss before, loss after, evaluations).

    The arguments are those of `shape_of`, those of `picture_in`, and those of `Settings`, which numbers cross into a
    kernel sooner than tuples. The loss is the sum of squared coverage errors at the finest level. The result has no
    larger loss than the start, and no more crossings, hairlines or flipped faces unless `keep_defects` is true. A start
    that is not finite has no loss: NaN, and nothing is written.
    """
    for v in range(start.shape[0]):
        if not (np.isfinite(start[v, 0]) and np.isfinite(start[v, 1])):
            return np.nan, np.nan, 0
    shape = shape_of(packed, bound, axis, asked)
    pyramid = (
        picture_in(coverages, sums, 0), picture_in(coverages, sums, 1), picture_in(coverages, sums, 2),
        picture_in(coverages, sums, 3),
    )  # fmt: skip
    settings = Settings(first_level, n_near, n_far, stiffness, damping, tolerance, keep_defects)
    n = shape.boundary.shape[0]
    unknowns, scratch = np.empty((n, 2)), np.empty((n, 2))
    low, high = 0.0, 1.0
    for k in range(n):
        v = shape.boundary[k]
        for axis in range(2):
            unknowns[k, axis] = start[v, axis]
            low, high = min(low, start[v, axis]), max(high, start[v, axis])
    fine = pyramid[len(pyramid) - 1]
    boxes = np.empty((shape.edges.shape[0], 4))
    best = Progress(start.copy(), start.copy(), np.empty((start.shape[0], 2)), boxes, np.zeros(7))
    crossings, _, hairlines, flipped = count_defects(
        best.start, shape.edges, shape.sides, shape.corners, shape.offsets, boxes
    )
    best.record[MOST_CROSSINGS] = 1e9 if settings.keep_defects else crossings
    best.record[MOST_HAIRLINES] = 1e9 if settings.keep_defects else hairlines
    best.record[MOST_FLIPPED] = 1e9 if settings.keep_defects else flipped
    best.record[LOW], best.record[HIGH] = low, high
    loss_before = loss_at(unknowns, shape, fine, work, scratch)

    reached = _descend(unknowns, shape, pyramid, settings.first_level, settings, work, best)
    if settings.n_far > 0 and reached > _NEARLY_RIGHT * fine.coverage.shape[0]:
        picture = pyramid[max(0, len(pyramid) - 3)]
        rebase(shape, picture, work, scratch, best)
        far_phase(unknowns, shape, picture, settings.n_far, work, best)
        reached = _descend(unknowns, shape, pyramid, len(pyramid) - 2, settings, work, best)
    if reached < 0.98 * best.record[LOSS]:  # the free search ended in a mesh that is not sane
        take_boundary(best.points, shape, unknowns)
        near_phase(unknowns, shape, fine, 0.0, True, settings, work, best)
    if shape.rule.triples.shape[0] > 0:  # whose cost the best loss may hold
        rebase(shape, fine, work, scratch, best)
    if best.record[LOSS] <= loss_before:
        _restore_idle(shape, fine, work, best)
    if not best.record[LOSS] < loss_before:
        put(best.start, result)
        return loss_before, loss_before, int(best.record[N_EVALUATIONS])
    put(best.points, result)
    return loss_before, best.record[LOSS], int(best.record[N_EVALUATIONS])


@kernel
def _descend(
    unknowns: FloatArray, shape: Shape, pyramid: tuple[Picture, ...], first_level: int, settings: Settings,
    work: Workspace, best: Progress,
) -> float:  # fmt: skip
    """Near phase from `first_level` of the pyramid to its last, each less stiff than the one before; the last loss."""
    loss = np.inf
    last = len(pyramid) - 1
    for level in range(max(0, first_level), last + 1):
        stiffness = 0.0 if level == last else settings.stiffness * 0.3 ** max(0, level - 1)
        loss = near_phase(unknowns, shape, pyramid[level], stiffness, False, settings, work, best)
    return loss


@kernel
def _restore_idle(shape: Shape, picture: Picture, work: Workspace, best: Progress) -> None:
    """Put vertices that moved less than a tenth of a pixel back to their start if that costs next to nothing."""
    start, size = best.start, picture.coverage.shape[0]
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
    obey(shape.ties, shape.boundary, best, unknowns)
    loss = loss_at(unknowns, shape, picture, work, np.empty((n, 2)))
    allowed = best.record[LOSS] * 1.001 + 1e-3
    if loss <= allowed:
        kept = best.record[LOSS]
        best.record[LOSS] = np.inf
        if not offer(unknowns, shape, loss, best):
            best.record[LOSS] = kept
