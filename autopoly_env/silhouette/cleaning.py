"""The mask made fit for use: dirt dropped, what is unusual said, padded to a square."""

import numpy as np

from autopoly_env.arrays import BoolArray, IntArray
from autopoly_env.silhouette.background import border
from autopoly_env.silhouette.options import ObjectOptions

MIN_SPECK, SPECK_SHARE = 4, 2e-5  # smaller components are specks, smaller holes pinholes: pixels, of the picture's area
SMALL_SHARE = 0.0025  # of a small picture's area, in which a pixel is a detail
FEW = 8  # parts
PATTERN = 0.5  # of the object: so many specks are no dirt, they are what is drawn


def clean(mask: BoolArray, options: ObjectOptions) -> tuple[BoolArray, list[str]]:
    """Drop specks and fill pinholes, unless they are the object: if nothing else, or as much else, were left.

    What has fewer pixels than `options.min_speck` is dirt; by default 4 or 2e-5 of the picture's area, and less in a
    small picture (down to none: below 25 x 25 a pixel counts). Object pixels are joined over corners too (8
    neighbours), those of the background over sides (4). The notes say what was done, and what a user may not expect of
    the mask: several parts, holes, the image's border touched.
    """
    least = 0 if options.keep_specks else options.min_speck
    if least is None:
        least = max(round(SPECK_SHARE * mask.size), min(MIN_SPECK, round(SMALL_SHARE * mask.size)))
    notes = []
    labels, n_parts = parts(mask)
    specks, n_specks = _smaller_than(least, labels, n_parts)
    if n_specks and (specks != mask).any():
        if options.min_speck is None and specks.sum() >= PATTERN * mask.sum():
            notes.append(f"{counted(n_specks, 'speck')} of less than {least} pixels kept, they are half of the object")
        else:
            mask, n_parts = mask & ~specks, n_parts - n_specks
            notes.append(f"{counted(n_specks, 'speck')} of less than {least} pixels dropped")
    labels, n_holes = holes(mask)
    pinholes, n_pinholes = _smaller_than(least, labels, n_holes)
    if n_pinholes and (pinholes == mask).any():
        mask, n_holes = mask | pinholes, n_holes - n_pinholes
        notes.append(f"{counted(n_pinholes, 'pinhole')} of less than {least} pixels filled")
        n_parts = parts(mask)[1]  # what lay in a pinhole is joined now
    if n_parts > 1:
        notes.append(f"object has {n_parts} separate parts")
    if n_holes:
        notes.append(f"object has {counted(n_holes, 'hole')}")
    if border(mask).any():
        notes.append("object touches the border of the image")
    return mask, notes


def square(mask: BoolArray) -> tuple[BoolArray, list[str]]:
    """The mask in the middle of a square of background, as large as its longer side."""
    height, width = mask.shape
    side = max(height, width)
    if height == width:
        return mask, []
    above, left = (side - height) // 2, (side - width) // 2
    padded = np.pad(mask, ((above, side - height - above), (left, side - width - left)))
    return padded, [f"padded from {width}x{height} to {side}x{side}"]


def parts(mask: BoolArray) -> tuple[IntArray, int]:
    """Component labels (H, W) of the object, 1.., 0 elsewhere; 8 neighbours. And how many there are."""
    from skimage.measure import label

    labels, count = label(mask, connectivity=2, return_num=True)
    return labels, int(count)


def holes(mask: BoolArray) -> tuple[IntArray, int]:
    """Labels (H, W) of background that does not reach the border, 1.., 0 elsewhere; 4 neighbours. And how many."""
    from skimage.measure import label

    labels, count = label(~mask, connectivity=1, return_num=True)
    enclosed = np.ones(count + 1, dtype=bool)
    enclosed[0] = False
    enclosed[border(labels)] = False
    n_holes = int(enclosed.sum())
    numbers: IntArray = np.cumsum(enclosed) * enclosed
    return (numbers[labels] if n_holes else np.zeros_like(labels)), n_holes


def counted(count: int, noun: str) -> str:
    """Such as "1 hole", "2 holes"."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _smaller_than(n_pixels: int, labels: IntArray, count: int) -> tuple[BoolArray, int]:
    """Where the labelled parts with fewer than `n_pixels` pixels are, and how many of them there are."""
    if n_pixels <= 1 or count == 0:
        return np.zeros(labels.shape, dtype=bool), 0
    if count <= FEW:  # much quicker than to count them all
        sizes = np.array([0, *(np.count_nonzero(labels == number) for number in range(1, count + 1))])
    else:
        sizes = np.bincount(labels.ravel(), minlength=count + 1)
    small = sizes < n_pixels
    small[0] = False
    return small[labels] if small.any() else np.zeros(labels.shape, dtype=bool), int(small.sum())
