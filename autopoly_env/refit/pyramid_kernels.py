"""Numba kernels of the pyramid that a refit climbs: all its levels in two packed arrays, for each array costs a call.

Letters: R_k pixels a side of level k, coarse to fine.
"""

import numpy as np

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.compute import inlined, kernel
from autopoly_env.raster.raster_kernels import Picture
from autopoly_env.silhouette.target_kernels import row_sums, with_background

N_LEVELS = 4
_HEAD = N_LEVELS + 1  # of the sums: R_k of each level, and 1 where pixels have weights, 0 where each weighs 1


@kernel
def packed_sums(
    sizes: IntArray, coverages: FloatArray, weights: FloatArray, background: float, steps: float
) -> FloatArray:
    """The sums along the rows of all levels, where a pixel outside the silhouette weighs `background`.

    `coverages` are the levels' (R_k, R_k) one after the other, and so are `weights`, unless they are empty: then pixels
    weigh 1 beforehand. Weights are rounded to multiples of 1 / `steps`.
    """
    is_weighted = background != 1.0 or len(weights) > 0
    end = _HEAD
    for k in range(N_LEVELS):
        end += (3 if is_weighted else 2) * sizes[k] * (sizes[k] + 1)
    packed = np.empty(end)
    packed[N_LEVELS] = 1.0 if is_weighted else 0.0
    first, end = 0, _HEAD
    for k in range(N_LEVELS):
        size = sizes[k]
        packed[k] = size
        covered = coverages[first : first + size * size].reshape((size, size))
        counted = weights[:0].reshape((0, 0))
        if len(weights) > 0:
            counted = weights[first : first + size * size].reshape((size, size))
        first += size * size
        if background != 1.0:
            sums = row_sums(covered, with_background(covered, counted, background, steps))
        else:
            sums = row_sums(covered, counted)
        for part in sums:
            for value in part.flat:
                packed[end] = value
                end += 1
    return packed


@inlined
def picture_in(coverages: FloatArray, sums: FloatArray, level: int) -> Picture:
    """One level of the pyramid; its arrays share the memory of the packed ones."""
    is_weighted = sums[N_LEVELS] > 0.0
    first, begin = 0, _HEAD
    for k in range(level):
        size = int(sums[k])
        first += size * size
        begin += (3 if is_weighted else 2) * size * (size + 1)
    size = int(sums[level])
    n = size * (size + 1)
    last = begin + 2 * n
    return Picture(
        coverages[first : first + size * size].reshape((size, size)),
        sums[begin : begin + n].reshape((size, size + 1)),
        sums[begin + n : last].reshape((size, size + 1)),
        sums[last : last + n].reshape((size, size + 1)) if is_weighted else sums[last:last].reshape((0, 0)),
    )
