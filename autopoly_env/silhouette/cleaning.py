"""The mask made fit for use: dirt dropped, what is unusual said, padded to a square."""

import numpy as np

from autopoly_env.arrays import BoolArray, IntArray
from autopoly_env.shown import counted
from autopoly_env.silhouette.background import border
from autopoly_env.silhouette.connectivity import areas, grown, label_holes, label_parts, meets_in_corners, shrunk
from autopoly_env.silhouette.options import ObjectOptions

MIN_SPECK, SPECK_SHARE = 4, 2e-5  # smaller components are specks, smaller holes pinholes: pixels, of the picture's area
SMALL_SHARE = 0.0025  # of a small picture's area, in which a pixel is a detail
FEW = 8  # parts
DUST, DUST_SHARE = 10, 0.005  # times as large as a speck, and of the largest part: smaller parts may be dust
SOME = 3  # of it are worth a word
FINEST = 256  # pixels a side, at which a mesh's parts and holes are counted
DITHERED = 0.25  # of the object: so many pinholes are a pattern, of which notches along its border are a part
PATTERN = 0.5  # of the object: so many specks are no dirt, they are what is drawn


def clean(mask: BoolArray, options: ObjectOptions) -> tuple[BoolArray, list[str]]:
    """Drop specks and fill pinholes, unless they are the object: if nothing else, or as much else, were left.

    What has fewer pixels than `options.min_speck` is dirt; by default 4 or 2e-5 of the picture's area, and less in a
    small picture (down to none: below 25 x 25 a pixel counts). Object pixels are joined over corners too (8
    neighbours), those of the background over sides (4). The notes say what was done, and what a user may not expect of
    the mask: several parts, holes (as a tracer sees them, `connectivity`), the image's border touched.
    """
    least = 0 if options.keep_specks else options.min_speck
    if least is None:
        least = max(round(SPECK_SHARE * mask.size), min(MIN_SPECK, round(SMALL_SHARE * mask.size)))
    notes = []
    labels, n_parts = parts(mask)
    specks, n_specks = _smaller_than(least, labels, np.arange(1, n_parts + 1))
    if n_specks and (specks != mask).any():
        if options.min_speck is None and specks.sum() >= PATTERN * mask.sum():
            notes.append(f"{counted(n_specks, 'speck')} of less than {least} pixels kept, they are half of the object")
        else:
            mask, n_parts = mask & ~specks, n_parts - n_specks
            notes.append(f"{counted(n_specks, 'speck')} of less than {least} pixels dropped")
    elif n_specks and options.min_speck is not None:
        notes.append(f"every part has less than {least} pixels and is kept: give a lower --min-speck")
    labels, enclosed = holes(mask)
    pinholes, n_pinholes = _smaller_than(least, labels, enclosed)
    n_holes = len(enclosed) - n_pinholes
    if n_pinholes and (pinholes == mask).any():
        filled = f"{counted(n_pinholes, 'pinhole')} of less than {least} pixels filled"
        if is_dithered := pinholes.sum() >= DITHERED * mask.sum():
            filled = f"{filled}, a pattern of them is taken for grey: --keep-specks keeps it"
        mask = mask | pinholes
        if is_dithered:
            mask = _without_notches(mask)
        notes.append(filled)
        n_parts = parts(mask)[1]  # what lay in a pinhole is joined now
    if max(mask.shape) <= FINEST and meets_in_corners(mask):  # of what is larger, nobody sees these corners
        shown = square(mask)[0].astype(np.float64)
        n_parts, n_holes = int(label_parts(shown).max()), int(label_holes(shown).max())
    if n_parts > 1:
        dust = _word_on_dust(mask, least) if n_parts > SOME and options.min_speck is None else ""
        notes.append(f"object has {n_parts} separate parts{dust}")
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
    return areas(mask, with_corners=True)


def holes(mask: BoolArray) -> tuple[IntArray, IntArray]:
    """Labels (H, W) of the background, 1.., 4 neighbours, and which of them do not reach the border."""
    labels, count = areas(~mask)
    enclosed = np.ones(count + 1, dtype=bool)
    enclosed[0] = False
    enclosed[border(labels)] = False
    return labels, np.flatnonzero(enclosed)


def _word_on_dust(mask: BoolArray, least: int) -> str:
    """How many parts are hardly more than specks, which have less than `least` pixels, and what drops them, too."""
    labels, n_parts = parts(mask)
    sizes = np.sort(np.bincount(labels.ravel(), minlength=n_parts + 1)[1:])
    dust = sizes[sizes < min(DUST * least, DUST_SHARE * sizes[-1])]
    if len(dust) < SOME:
        return ""
    return f", {len(dust)} of at most {dust[-1]} pixels: --min-speck {dust[-1] + 1} drops those"


def _without_notches(mask: BoolArray) -> BoolArray:
    """The mask (H, W) with its notches filled that are a pixel wide, as a pattern has along its border."""
    return shrunk(grown(np.pad(mask, 2)))[2:-2, 2:-2]


def _smaller_than(n_pixels: int, labels: IntArray, numbers: IntArray) -> tuple[BoolArray, int]:
    """Where those of the labelled parts that have fewer than `n_pixels` pixels are, and how many of them there are."""
    if n_pixels <= 1 or len(numbers) == 0:
        return np.zeros(labels.shape, dtype=bool), 0
    if len(numbers) <= FEW:  # much quicker than to count them all
        sizes = np.array([np.count_nonzero(labels == number) for number in numbers])
    else:
        sizes = np.bincount(labels.ravel())[numbers]
    small = numbers[sizes < n_pixels]
    if not len(small):
        return np.zeros(labels.shape, dtype=bool), 0
    is_small = np.zeros(int(labels.max()) + 1, dtype=bool)
    is_small[small] = True
    return is_small.take(labels), len(small)
