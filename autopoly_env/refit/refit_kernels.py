"""The refit as a whole: the near phase up the pyramid, the far phase if it is asked for, the best sane mesh kept.

A call refits one mesh from several starts and says what the best of them is worth, for most of what asks for refits
asks for that next. Letters: see `shape_kernels`; S starts.
"""

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray, IntArray
from autopoly_env.compute import kernel, uncounted_kernel
from autopoly_env.details.hairline_kernels import count_hairlines
from autopoly_env.mesh.corner_kernels import LEAST_TURN, n_flat_faces
from autopoly_env.mesh.geometry_kernels import count_defects
from autopoly_env.mesh.topology_kernels import links_in
from autopoly_env.raster.raster_kernels import Picture, Pixels, Workspace, overlap_counts
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
    starts: FloatArray, packed: IntArray, bound: IntArray, axis: float, asked: float,
    coverages: FloatArray, sums: FloatArray,
    first_level: int, n_near: int, n_far: int, stiffness: float, damping: float, tolerance: float, keep_defects: bool,
    mask: BoolArray, mask_sum: FloatArray, weight_sum: FloatArray, by_area: bool,
    shown: FloatArray, width: float, least: float,
    work: Workspace, results: FloatArray,
) -> tuple[int, float, float, int, int, int, int, int, float, float, int]:  # fmt: skip
    """Fit all vertices to the target from each of the `starts` (S, V, 2); write `results`, alike.

    The arguments are those of `shape_of`, those of `picture_in`, those of `Settings`, those of `Pixels`, and those of
    `count_hairlines`, which numbers cross into a kernel sooner than tuples. Returned are the start k that led to the
    fewest defects, and of those to the least loss; of it the loss before and after, the evaluations, what
    `count_defects` finds, the `overlap_counts` of the pixels and the hairlines in `shown`; 0 where these are empty.

    The loss is the sum of squared coverage errors at the finest level. A result has no larger loss than its start, and
    no more crossings, hairlines or flipped faces unless `keep_defects` is true. Of a start that is not finite nothing
    is written; k is -1 where all are.
    """
    shape = shape_of(packed, bound, axis, asked)
    pyramid = (
        picture_in(coverages, sums, 0), picture_in(coverages, sums, 1), picture_in(coverages, sums, 2),
        picture_in(coverages, sums, 3),
    )  # fmt: skip
    settings = Settings(first_level, n_near, n_far, stiffness, damping, tolerance, keep_defects)
    boxes = np.empty((shape.edges.shape[0], 4))
    best, n_defects = -1, 0
    before, after, n_evaluations = np.nan, np.nan, 0
    crossings, uncertain, hairlines, flipped = 0, 0, 0, 0
    for k in range(starts.shape[0]):
        if not is_finite(starts[k]):
            continue
        first, last, n_made = _fit(starts[k], shape, pyramid, settings, boxes, work, results[k])
        found = count_defects(results[k], shape.edges, shape.sides, shape.corners, shape.offsets, boxes)
        n_found = found[0] + found[2] + found[3]
        if asked > 0.0:
            n_found += n_flat_faces(results[k], shape.corners, shape.offsets, LEAST_TURN)
        if best < 0 or n_found < n_defects or (n_found == n_defects and last < after):
            best, n_defects = k, n_found
            before, after, n_evaluations = first, last, n_made
            crossings, uncertain, hairlines, flipped = found
    inside, filled, n_slits = 0.0, 0.0, 0
    if best >= 0 and mask.shape[0] > 0:
        inside, filled = overlap_counts(
            results[best], links_in(packed).boundary, Pixels(mask, mask_sum, weight_sum, by_area), work
        )
    if best >= 0 and shown.shape[0] > 0:
        n_slits = count_hairlines(results[best], links_in(packed).boundary, shown, width, least)
    return best, before, after, n_evaluations, crossings, uncertain, hairlines, flipped, inside, filled, n_slits


@uncounted_kernel
def is_finite(points: FloatArray) -> bool:
    """Whether all of the points (V, 2) are."""
    for v in range(points.shape[0]):
        if not (np.isfinite(points[v, 0]) and np.isfinite(points[v, 1])):
            return False
    return True


@kernel
def _fit(
    start: FloatArray, shape: Shape, pyramid: tuple[Picture, ...], settings: Settings, boxes: FloatArray,
    work: Workspace, result: FloatArray,
) -> tuple[float, float, int]:  # fmt: skip
    """Fit all vertices to the target; write (V, 2) `result`; return (loss before, loss after, evaluations)."""
    n = shape.boundary.shape[0]
    unknowns, scratch = np.empty((n, 2)), np.empty((n, 2))
    low, high = 0.0, 1.0
    for k in range(n):
        v = shape.boundary[k]
        for axis in range(2):
            unknowns[k, axis] = start[v, axis]
            low, high = min(low, start[v, axis]), max(high, start[v, axis])
    fine = pyramid[len(pyramid) - 1]
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
