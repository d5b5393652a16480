"""What hangs together in a picture: parts and holes, and where two parts meet in nothing but the corner of a pixel.

Pixels hang together with their 8 neighbours, as a line one pixel wide does, and the background with its 4. Two parts
that are wider than a line and meet in a corner only stay two: nothing of a width joins them.

Letters: R pixels a side.
"""

import numpy as np

from autopoly_env.arrays import AnyArray, BoolArray, FloatArray, IntArray
from autopoly_env.silhouette import area_kernels

LEVEL = 0.4990123  # of coverage, about half; a pixel covered by just this much would make contours touch, and none is


def areas(mask: BoolArray, *, with_corners: bool = False) -> tuple[IntArray, int]:
    """Labels (H, W) of what hangs together in a mask by 4 neighbours, or 8, 1.., 0 elsewhere; and how many there are.

    They are numbered in the order of their first pixels, row by row.
    """
    labels, count = area_kernels.label_areas(_copy(mask), with_corners)
    return labels, int(count)


def distances_within(mask: BoolArray) -> FloatArray:
    """(H, W) how far each pixel of a mask is from the nearest that is not in it, in pixels; infinite where none is."""
    distances: FloatArray = area_kernels.distances_within(_copy(mask))
    return distances


def _copy(mask: BoolArray) -> BoolArray:
    """Writable and in rows: Numba takes anything else for another type, and would compile for it."""
    return np.array(mask, np.bool_, order="C")


def grown(mask: BoolArray) -> BoolArray:
    """The mask (H, W) and the 8 neighbours of its pixels."""
    wider = mask.copy()
    wider[1:] |= mask[:-1]
    wider[:-1] |= mask[1:]
    grown = wider.copy()
    grown[:, 1:] |= wider[:, :-1]
    grown[:, :-1] |= wider[:, 1:]
    return grown


def shrunk(mask: BoolArray) -> BoolArray:
    """The pixels of the mask (H, W) all 8 neighbours of which are in it; beyond the picture nothing is."""
    return ~grown(np.pad(~mask, 1, constant_values=True))[1:-1, 1:-1]


def torn_corners(coverage: FloatArray) -> BoolArray:
    """Mask (R-1, R-1) of the corners between four pixels where two filled ones meet diagonally and are apart.

    They do unless they are of two parts, neither of them one pixel wide there, or are so faint that a surface through
    the four values is below the level in the middle (the asymptotic decider of Nielson and Hamann 1991).
    """
    filled = coverage > LEVEL
    thick = _thick(filled)
    parts = areas(filled)[0]
    torn = np.zeros((len(coverage) - 1, len(coverage) - 1), np.bool_)
    for falling in (True, False):
        (a, b), (c, d) = _diagonals(coverage, falling=falling)
        meets = (a > LEVEL) & (b > LEVEL) & (c <= LEVEL) & (d <= LEVEL)
        with np.errstate(divide="ignore", invalid="ignore"):
            faint = meets & ((a * b - c * d) / (a + b - c - d) < LEVEL)
        (first, second), _ = _diagonals(parts, falling=falling)
        (is_thick, is_too), _ = _diagonals(thick, falling=falling)
        torn |= meets & (faint | ((first != second) & is_thick & is_too))
    return torn


def label_parts(coverage: FloatArray) -> IntArray:
    """The parts, 1.., of a picture of coverages (R, R); 0 is background."""
    filled = coverage > LEVEL
    return _joined(areas(filled)[0], filled, ~torn_corners(coverage))


def label_holes(coverage: FloatArray) -> IntArray:
    """The holes, 1.., of a picture of coverages (R, R): background that does not reach the border; 0 elsewhere."""
    padded = np.pad(coverage, 1)
    empty = padded <= LEVEL
    labels = _joined(areas(empty)[0], empty, torn_corners(padded))
    names, numbers = np.unique(np.where(labels == labels[0, 0], 0, labels), return_inverse=True)
    assert names[0] == 0  # the background around
    return numbers.reshape(labels.shape)[1:-1, 1:-1]


def meets_in_corners(mask: BoolArray) -> bool:
    """Whether two pixels of a mask (H, W) meet diagonally and have none in common beside them."""
    ways = (_diagonals(mask, falling=falling) for falling in (True, False))
    return any(bool((a & b & ~c & ~d).any()) for (a, b), (c, d) in ways)


def is_slanting_line(mask: BoolArray) -> bool:
    """Whether a mask (R, R) is nothing but lines one pixel wide, some of which hang together by corners alone."""
    if _thick(mask).any():
        return False
    return int(areas(mask)[0].max()) > int(label_parts(mask.astype(np.float64)).max())


def _joined(labels: IntArray, among: BoolArray, open_corners: BoolArray) -> IntArray:
    """The labels, those of areas that meet across an open corner made the same, and numbered anew from 1."""
    pairs = []
    for falling in (True, False):
        (a, b), (c, d) = _diagonals(among, falling=falling)
        meets = a & b & ~c & ~d & open_corners
        (first, second), _ = _diagonals(labels, falling=falling)
        pairs.append(np.stack((first[meets], second[meets])))
    groups = _groups(int(labels.max()) + 1, *np.concatenate(pairs, axis=1))
    joined: IntArray = np.unique(groups, return_inverse=True)[1][labels]
    return joined


def _groups(n: int, first: IntArray, second: IntArray) -> IntArray:
    """For each of 0..n-1 the least that it is joined to, on any way, by the pairs of `first` and `second`."""
    group = np.arange(n)
    while True:
        ends = group[first], group[second]
        low, after = np.minimum(*ends), group.copy()
        for end in ends:
            np.minimum.at(after, end, low)
        after = after[after]
        if np.array_equal(after, group):
            return group
        group = after


def _diagonals(grid: AnyArray, *, falling: bool) -> tuple[tuple[AnyArray, AnyArray], tuple[AnyArray, AnyArray]]:
    """The two pixels on one diagonal of every corner between four pixels, and the two on the other."""
    pairs = (grid[:-1, :-1], grid[1:, 1:]), (grid[:-1, 1:], grid[1:, :-1])
    return pairs if falling else pairs[::-1]


def _thick(filled: BoolArray) -> BoolArray:
    """The pixels of 2 x 2 filled blocks."""
    blocks = filled[:-1, :-1] & filled[:-1, 1:] & filled[1:, :-1] & filled[1:, 1:]
    thick = np.zeros_like(filled)
    for rows in (slice(None, -1), slice(1, None)):
        for columns in (slice(None, -1), slice(1, None)):
            thick[rows, columns] |= blocks
    return thick
