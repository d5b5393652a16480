"""Numba kernel of the last touch: vertices move by fractions of a pixel as long as the IoU itself gains.

A refit fits coverage, and the score counts pixels that are covered by half or more: what lies between the two is worth
some tenths of a point.
"""

from typing import NamedTuple

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray, IntArray
from autopoly_env.jit import kernel
from autopoly_env.raster_kernels import Workspace, overlap_counts
from autopoly_env.refit_kernels import Shape, defects

_STEPS = (2.0, 1.0, 0.5, 0.25)  # pixels
_N_DIRECTIONS = 8
_N_ROUNDS = 4  # with one step, at most


class Pixels(NamedTuple):
    """What the IoU is counted on: see `autopoly_env.silhouette.Target`."""

    mask: BoolArray  # (R, R)
    mask_sum: IntArray | FloatArray  # (R, R+1)
    n_filled: float
    weight_sum: FloatArray | None  # (R, R+1)


@kernel
def _iou(points: FloatArray, edges: IntArray, pixels: Pixels, work: Workspace) -> float:
    size = pixels.mask.shape[0]
    inside, filled = overlap_counts(points, edges, size, pixels.mask, pixels.mask_sum, work, pixels.weight_sum)
    union = filled + pixels.n_filled - inside
    return inside / union if union > 0 else 1.0


@kernel
def tune(
    points: FloatArray, edges: IntArray, shape: Shape, images: IntArray, axis: float, pixels: Pixels, work: Workspace
) -> float:
    """Move `points` (V, 2), in place, by pattern search; return the IoU reached.

    `edges` (B, 2) are the boundary's. `images` (V,) holds each vertex's mirror image about x = `axis`, -1 for a vertex
    that has none, -2 for one that stays. No crossing and no flipped face comes about, and nothing leaves the picture.
    """
    size = pixels.mask.shape[0]
    best = _iou(points, edges, pixels, work)
    crossings, flipped = defects(points, shape)
    for step in _STEPS:
        for _round in range(_N_ROUNDS):
            before = best
            for k in range(shape.boundary.shape[0]):
                v = shape.boundary[k]
                image = images[v]
                if image == -2:
                    continue
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
                    iou = _iou(points, edges, pixels, work)
                    if iou > best:
                        now_crossings, now_flipped = defects(points, shape)
                        if now_crossings <= crossings and now_flipped <= flipped:
                            best = iou
                            continue
                    if image >= 0:
                        points[image, 0], points[image, 1] = other_x, other_y
                    points[v, 0], points[v, 1] = x, y
            if best == before:
                break
    return best
