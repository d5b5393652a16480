"""A picture as its owner knows it, small: beside a mesh it shows at once whether the right object was found."""

import numpy as np
from PIL import Image

from autopoly_env.arrays import FloatArray
from autopoly_env.silhouette.loading import ImageSource, Picture, read_frames

CHECKS = (0.95, 0.80)  # greys of the pattern behind what is clear


def thumbnail(source: ImageSource, side: int) -> Image.Image:
    """The picture, or its first frame that is not of one colour, as RGB with at most `side` pixels a side.

    Raises SilhouetteError as `load_silhouette`.
    """
    first: Picture | None = None
    for picture in read_frames(source):
        first = first or picture
        if not picture.is_flat:
            first = picture
            break
    assert first is not None
    image = Image.fromarray(np.rint(255 * _shown(first)).astype(np.uint8))
    scale = side / max(image.size)
    size = (max(1, round(scale * image.width)), max(1, round(scale * image.height)))
    return image.resize(size, Image.Resampling.BOX if scale < 1 else Image.Resampling.NEAREST)


def _shown(picture: Picture) -> FloatArray:
    """The picture (H, W, 3) in 0..1, on checks where it is clear; a mask black on white."""
    if picture.grey is None:
        assert picture.opacity is not None
        return np.repeat(1.0 - picture.opacity[..., None].astype(np.float64), 3, axis=2)
    colours = np.repeat(picture.grey[..., None], 3, axis=2) if picture.colour is None else picture.colour / 255.0
    colours = np.clip(colours, 0.0, 1.0).astype(np.float64)
    if picture.opacity is None:
        return colours
    height, width = picture.grey.shape
    check = max(1, max(height, width) // 16)
    odd = (np.add.outer(np.arange(height) // check, np.arange(width) // check) % 2).astype(bool)
    alpha = picture.opacity[..., None]
    return alpha * colours + (1.0 - alpha) * np.where(odd, *CHECKS)[..., None]
