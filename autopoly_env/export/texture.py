"""The picture on the mesh: as PNG, and where in it each vertex lies."""

import io
from dataclasses import dataclass, field

import numpy as np
from PIL import Image

from autopoly_env.arrays import ByteArray, FloatArray
from autopoly_env.silhouette import ImageSource, read_picture


@dataclass(frozen=True, eq=False)
class Texture:
    """A picture of `shape` (H, W) pixels, upright, as PNG; `has_alpha` if parts of it are clear."""

    png: bytes = field(repr=False)
    shape: tuple[int, int]
    has_alpha: bool

    def places(self, vertices: FloatArray) -> FloatArray:
        """(V, 2) u to the right and v down, 0 to 1 over the picture itself, of places in the unit square.

        A picture that is not square lies in the middle of the square, as `load_silhouette` pads it.
        """
        height, width = self.shape
        side = max(self.shape)
        corner = np.array(((side - width) // 2, (side - height) // 2), np.float64)
        return (side * vertices - corner) / (width, height)


def load_texture(source: ImageSource) -> Texture:
    """The picture of a path, file object, image or array: all that `load_silhouette` reads, its colours kept.

    At most 2048 pixels a side. Raises SilhouetteError where it cannot be read.
    """
    picture = read_picture(source)
    shown = picture.colour
    if shown is None:
        grey = np.ones_like(picture.opacity) if picture.grey is None else picture.grey
        shown = np.repeat(_bytes(grey)[:, :, None], 3, axis=2)
    height, width = shown.shape[:2]
    has_alpha = picture.opacity is not None and bool((picture.opacity < 1.0).any())
    if has_alpha:
        shown = np.dstack((shown, _bytes(picture.opacity)))
    stream = io.BytesIO()
    Image.fromarray(shown).save(stream, "PNG")
    return Texture(stream.getvalue(), (height, width), has_alpha)


def _bytes(shares: object) -> ByteArray:
    return np.rint(255.0 * np.asarray(shares, np.float64)).astype(np.uint8)
