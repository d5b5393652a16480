"""Numba kernels that average a mask over a grid of cells and sum along its rows: what a target is made of.

Letters: N pixels a side of the mask, R cells a side.
"""

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray, IntArray
from autopoly_env.compute import kernel


@kernel
def area_average(mask: BoolArray, resolution: int) -> FloatArray:
    """(R, R) the mean of a mask (N, N) over each of R x R equal cells.

    A cell overlaps a pixel by a whole number of 1/(N * R), so that all up to the last division is exact arithmetic of
    whole numbers: a cell that is half object is exactly 0.5.
    """
    n = len(mask)
    if n % resolution == 0:
        return _block_average(mask, n // resolution)
    sums, along, average = np.zeros(resolution, np.int64), np.empty(n, np.int64), np.empty((resolution, resolution))
    for row in range(resolution):
        along[:] = 0
        first, last = row * n, (row + 1) * n  # the cell's borders, `resolution` to a pixel
        for y in range(first // resolution, (last - 1) // resolution + 1):
            weight = min(last, (y + 1) * resolution) - max(first, y * resolution)
            for x in range(n):
                along[x] += weight * mask[y, x]
        for column in range(resolution):
            sums[column] = 0
            left, right = column * n, (column + 1) * n
            for x in range(left // resolution, (right - 1) // resolution + 1):
                sums[column] += (min(right, (x + 1) * resolution) - max(left, x * resolution)) * along[x]
            average[row, column] = sums[column] / (n * n)
    return average


@kernel
def _block_average(mask: BoolArray, side: int) -> FloatArray:
    """`area_average` where every cell is so many whole pixels a side."""
    resolution = len(mask) // side
    average, sums = np.empty((resolution, resolution)), np.empty(resolution, np.int64)
    for row in range(resolution):
        sums[:] = 0
        for y in range(row * side, (row + 1) * side):
            for column in range(resolution):
                for x in range(column * side, (column + 1) * side):
                    sums[column] += mask[y, x]
        for column in range(resolution):
            average[row, column] = sums[column] / (side * side)
    return average


@kernel
def row_ends(filled: BoolArray) -> IntArray:
    """(n, 3) each row of (R, R) in which something is true, and the first and the last column there."""
    size = len(filled)
    ends, n = np.empty((size, 3), np.int64), 0
    for row in range(size):
        first, last = -1, -1
        for column in range(size):
            if filled[row, column]:
                first = column if first < 0 else first
                last = column
        if last >= 0:
            ends[n, 0], ends[n, 1], ends[n, 2] = row, first, last
            n += 1
    return ends[:n].copy()


@kernel
def row_sums(coverage: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(R, R+1) the sums along the rows, from 0, of a coverage, of its square, and of the weights.

    `weights` (R, R) are what each cell counts in the first two; where they are empty each counts once, and there are no
    sums of them.
    """
    size, is_weighted = len(coverage), len(weights) > 0
    sums, squares = np.zeros((size, size + 1)), np.zeros((size, size + 1))
    weight_sums = np.zeros((size, size + 1)) if is_weighted else np.zeros((0, 0))
    for y in range(size):
        for x in range(size):
            share = coverage[y, x]
            square = share * share
            if is_weighted:
                weight_sums[y, x + 1] = weight_sums[y, x] + weights[y, x]
                share *= weights[y, x]
                square *= weights[y, x]
            sums[y, x + 1] = sums[y, x] + share
            squares[y, x + 1] = squares[y, x] + square
    return sums, squares, weight_sums


@kernel
def filled_sums(coverage: FloatArray, weights: FloatArray) -> tuple[BoolArray, FloatArray, float]:
    """The cells (R, R) that are covered by half, the sums (R, R+1) along the rows of what these weigh, and in all."""
    size, is_weighted = len(coverage), len(weights) > 0
    mask, sums, whole = np.empty((size, size), np.bool_), np.zeros((size, size + 1)), 0.0
    for y in range(size):
        for x in range(size):
            mask[y, x] = coverage[y, x] >= 0.5
            weight = 0.0 if not mask[y, x] else weights[y, x] if is_weighted else 1.0
            sums[y, x + 1] = sums[y, x] + weight
            whole += weight
    return mask, sums, whole


@kernel
def with_background(coverage: FloatArray, weights: FloatArray, background: float, steps: float) -> FloatArray:
    """(R, R) what each cell weighs where one outside weighs `background`, in multiples of 1 / `steps`, times `weights`.

    `weights` may be empty: then each cell weighs 1 beforehand.
    """
    size = len(coverage)
    found = np.empty((size, size))
    for y in range(size):
        for x in range(size):
            weight = coverage[y, x] + background * (1.0 - coverage[y, x])
            if len(weights) > 0:
                weight *= weights[y, x]
            found[y, x] = np.rint(weight * steps) / steps
    return found
