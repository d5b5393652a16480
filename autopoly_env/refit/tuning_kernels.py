"""Numba kernel of the last touch: vertices move by fractions of a pixel as long as the IoU itself gains.

A refit fits coverage, and the score counts pixels that are covered by half or more: what lies between the two is worth
some tenths of a point.
"""

import numpy as np

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.compute import kernel, uncounted_kernel
from autopoly_env.mesh.corner_kernels import keeps_turns
from autopoly_env.mesh.geometry_kernels import defects
from autopoly_env.mesh.topology_kernels import links_in
from autopoly_env.raster.raster_kernels import Pixels, Workspace, overlap_counts_in_rows

_STEPS = (2.0, 1.0, 0.5, 0.25)  # pixels
_N_DIRECTIONS = 8
_N_ROUNDS = 4  # with one step, at most
_LEAST_GAIN = 1e-12  # of the IoU; less is rounding of weights


@uncounted_kernel
def _rows_around(v: int, image: int, points: FloatArray, edges: IntArray, margin: float, size: int) -> tuple[int, int]:
    """The rows, first to last - 1, that edges at vertex v or at its image cross when these move by at most `margin`."""
    low, high = points[v, 1], points[v, 1]
    for edge in range(edges.shape[0]):
        a, b = edges[edge, 0], edges[edge, 1]
        if a == v or b == v or (image >= 0 and (a == image or b == image)):
            low, high = min(low, points[a, 1], points[b, 1]), max(high, points[a, 1], points[b, 1])
    first, last = int(np.floor((low - margin) * size)), int(np.ceil((high + margin) * size))
    return min(max(first, 0), size - 1), max(min(last, size), 1)


@uncounted_kernel
def _iou(inside: float, filled: float, n_filled: float) -> float:
    union = filled + n_filled - inside
    return inside / union if union > 0 else 1.0


@kernel
def tune(
    points: FloatArray, packed: IntArray, images: IntArray, axis: float, asked: float, pixels: Pixels,
    n_filled: float, work: Workspace,
) -> None:  # fmt: skip
    """Move `points` (V, 2), in place, by pattern search on the IoU.

    `packed` is their topology. `images` (V,) holds each vertex's mirror image about x = `axis`, -1 for a vertex that
    has none, -2 for one that stays; corners are to turn by a sine of `asked`, 0 where faces may have any; `n_filled` is
    what the target's pixels weigh together. No crossing, no flipped face and no corner against the rule of faces comes
    about, and nothing leaves the picture. A vertex changes the rows only that its edges cross, so those are all that is
    counted again.
    """
    size = pixels.mask.shape[0]
    links = links_in(packed)
    edges = links.boundary
    inside, filled = overlap_counts_in_rows(points, edges, pixels, work, 0, size)
    crossings, _, hairlines, flipped = defects(points, packed)
    start = points.copy()
    for step in _STEPS:
        for _round in range(_N_ROUNDS):
            n_moved = 0
            for k in range(links.outer.shape[0]):
                v = links.outer[k]
                image = images[v]
                if image == -2:
                    continue
                first, last = _rows_around(v, image, points, edges, step / size, size)
                part_inside, part_filled = overlap_counts_in_rows(points, edges, pixels, work, first, last)
                for direction in range(_N_DIRECTIONS):
                    angle = 2.0 * np.pi * direction / _N_DIRECTIONS
                    x, y = points[v, 0], points[v, 1]
                    other_x, other_y = points[image, 0], points[image, 1]
                    new_x = x if image == v else x + np.cos(angle) * step / size
                    new_y = y + np.sin(angle) * step / size
                    if not (0.0 <= new_x <= 1.0 and 0.0 <= new_y <= 1.0):
                        continue
                    points[v, 0], points[v, 1] = new_x, new_y
                    if image >= 0 and image != v:
                        points[image, 0], points[image, 1] = 2.0 * axis - new_x, new_y
                    new_inside, new_filled = overlap_counts_in_rows(points, edges, pixels, work, first, last)
                    gain_inside, gain_filled = new_inside - part_inside, new_filled - part_filled
                    iou = _iou(inside + gain_inside, filled + gain_filled, n_filled)
                    if iou > _iou(inside, filled, n_filled) + _LEAST_GAIN:
                        now_crossings, _, now_hairlines, now_flipped = defects(points, packed)
                        sane = now_crossings <= crossings and now_hairlines <= hairlines and now_flipped <= flipped
                        if sane and (asked == 0.0 or keeps_turns(points, start, links.corners, links.offsets, asked)):
                            inside, filled = inside + gain_inside, filled + gain_filled
                            n_moved += 1
                            first, last = _rows_around(v, image, points, edges, step / size, size)
                            part_inside, part_filled = overlap_counts_in_rows(points, edges, pixels, work, first, last)
                            continue
                    if image >= 0:
                        points[image, 0], points[image, 1] = other_x, other_y
                    points[v, 0], points[v, 1] = x, y
            if n_moved == 0:
                break
