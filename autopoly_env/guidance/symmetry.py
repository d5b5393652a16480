"""Left and right alike: the vertical line about which a silhouette is most symmetric, and how much so it is."""

import numpy as np

from autopoly_env.silhouette import Silhouette


def best_axis(silhouette: Silhouette) -> float:
    """x of the axis, a multiple of half a pixel, about which most of the object lies on its mirror image.

    Of several such axes it is the one nearest to the object's centre of gravity.
    """
    mask = silhouette.mask
    size = len(mask)
    # overlap with the image about (s + 1) / 2R is the number of pairs of a row's pixels whose columns add up to s
    spectrum = np.fft.rfft(mask.astype(np.float64), 2 * size, axis=1)
    overlaps = np.rint(np.fft.irfft((spectrum**2).sum(axis=0), 2 * size))[: 2 * size - 1]
    axes = (np.flatnonzero(overlaps == overlaps.max()) + 1) / (2 * size)
    centre = (np.nonzero(mask)[1].mean() + 0.5) / size
    return float(axes[np.argmin(np.abs(axes - centre))])


def asymmetry(silhouette: Silhouette, axis: float) -> float:
    """Area of the object that is not also its mirror image's about an axis, and the other way round, over its own.

    The axis counts as the nearest multiple of half a pixel.
    """
    mask = silhouette.mask
    size = len(mask)
    columns = round(2.0 * axis * size) - 1 - np.arange(size)
    inside = (columns >= 0) & (columns < size)
    image = np.zeros_like(mask)
    image[:, inside] = mask[:, columns[inside]]
    return float((mask ^ image).sum() / max(mask.sum(), 1))
