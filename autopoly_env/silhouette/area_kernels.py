"""Numba kernels that say which pixels of a mask hang together, and how far each is from what is not of it.

Letters: H, W pixels.
"""

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray, IntArray
from autopoly_env.compute import kernel


@kernel
def label_areas(mask: BoolArray, with_corners: bool) -> tuple[IntArray, int]:
    """Labels (H, W) of what hangs together in a mask, 1.. in the order of their first pixels, 0 elsewhere; how many.

    Pixels hang together with 4 neighbours, or with 8. Two passes, with the areas that meet in a forest in between
    (Rosenfeld and Pfaltz 1966).
    """
    height, width = mask.shape
    labels = np.zeros((height, width), np.int64)
    above = np.zeros((height * width + 1) // 2 + 1, np.int64)  # the label that each was found to be part of, or itself
    n_labels = 0
    for y in range(height):
        for x in range(width):
            if not mask[y, x]:
                continue
            label = labels[y, x - 1] if x > 0 else 0
            if y > 0:
                for step in range(-1 if with_corners and x > 0 else 0, 2 if with_corners and x + 1 < width else 1):
                    label = _joined(above, label, labels[y - 1, x + step])
            if label == 0:
                n_labels += 1
                label = n_labels
                above[label] = label
            labels[y, x] = label
    n_areas = 0
    for label in range(1, n_labels + 1):  # a root is the least of its tree, so it comes first
        if above[label] == label:
            n_areas += 1
            above[label] = n_areas
        else:
            above[label] = above[above[label]]
    for y in range(height):
        for x in range(width):
            labels[y, x] = above[labels[y, x]]
    return labels, n_areas


@kernel
def _joined(above: IntArray, first: int, second: int) -> int:
    """The root of both labels' trees, which are one from now on; 0 is no label."""
    if first == 0 or second == 0:
        return max(first, second)
    first, second = _root(above, first), _root(above, second)
    above[max(first, second)] = min(first, second)
    return min(first, second)


@kernel
def _root(above: IntArray, label: int) -> int:
    while above[label] != label:
        above[label] = above[above[label]]
        label = above[label]
    return label


@kernel
def distances_within(mask: BoolArray) -> FloatArray:
    """(H, W) how far each pixel of a mask is from the nearest that is not in it, in pixels; infinite where none is.

    The lower envelope of parabolas, along the columns and then along the rows (Felzenszwalb and Huttenlocher 2012).
    """
    height, width = mask.shape
    far = float(height + width)  # more than any distance
    depths = np.empty((height, width))
    for x in range(width):
        last = -far
        for y in range(height):
            last = last if mask[y, x] else float(y)
            depths[y, x] = min(far, y - last)
        last = 2.0 * far
        for y in range(height - 1, -1, -1):
            last = last if mask[y, x] else float(y)
            depths[y, x] = min(depths[y, x], last - y)
    places, begins, heights = np.empty(width, np.int64), np.empty(width + 1), np.empty(width)
    for y in range(height):
        n = -1
        for x in range(width):
            heights[x] = depths[y, x] * depths[y, x] if depths[y, x] < far else np.inf
            if heights[x] == np.inf:
                continue
            begin = -np.inf
            while n >= 0:
                p = places[n]
                begin = (heights[x] + x * x - heights[p] - p * p) / (2.0 * (x - p))
                if begin > begins[n]:
                    break
                n -= 1
                begin = -np.inf
            n += 1
            places[n] = x
            begins[n] = begin
        if n < 0:
            depths[y, :] = np.inf
            continue
        begins[n + 1] = np.inf
        k = 0
        for x in range(width):
            while begins[k + 1] < x:
                k += 1
            depths[y, x] = np.sqrt((x - places[k]) ** 2 + heights[places[k]])
    return depths
