"""Silhouettes with their thin parts gone or their narrow gaps filled: other topologies to begin with."""

from collections.abc import Iterator

import numpy as np

from autopoly_env.arrays import BoolArray
from autopoly_env.silhouette import Silhouette, distances_within

_RADII = (0.012, 0.025, 0.04, 0.06)  # unit square
_RESOLUTION = 256  # pixels a side that are enough to see them by


def variants(silhouette: Silhouette, resolution: int = _RESOLUTION) -> Iterator[Silhouette]:
    """Openings and closings of the silhouette by growing discs, each that differs from the one before.

    They have `resolution` pixels a side at most.
    """
    size = min(resolution, silhouette.resolution)
    mask = silhouette.target(size).mask
    margin = int(np.ceil(_RADII[-1] * size)) + 1  # so that the border of the picture is no border of the shape
    padded = np.pad(mask, margin)
    for change in (_opened, _closed):
        last = mask
        for radius in _RADII:
            changed = change(padded, radius * size)[margin:-margin, margin:-margin]
            if changed.any() and not np.array_equal(changed, last):
                yield Silhouette(changed, silhouette.name)
            last = changed


def _opened(mask: BoolArray, radius: float) -> BoolArray:
    """What of a mask (H, W) discs of a radius in pixels cover that lie within it."""
    eroded = distances_within(mask) > radius
    opened: BoolArray = distances_within(~eroded) <= radius
    return opened


def _closed(mask: BoolArray, radius: float) -> BoolArray:
    """The mask (H, W) and all that no disc within its background covers."""
    dilated = distances_within(~mask) <= radius
    closed: BoolArray = distances_within(dilated) > radius
    return closed
