"""The picture on the mesh: as PNG, and where in it each vertex lies."""

import io
from dataclasses import dataclass, field

import numpy as np
from PIL import Image

from autopoly_env.arrays import BoolArray, ByteArray, FloatArray
from autopoly_env.silhouette import ImageSource, read_picture

OPAQUE = 0.5  # of the opacity


@dataclass(frozen=True, eq=False)
class Texture:
    """A picture of `shape` (H, W) pixels, upright and opaque, as PNG."""

    png: bytes = field(repr=False)
    shape: tuple[int, int]

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

    What is clear takes the colour of the nearest pixel that is not: the mesh is the cut-out, and its rim and walls,
    which may lie a pixel beside the object, stay whole. At most 2048 pixels a side. Raises SilhouetteError where it
    cannot be read.
    """
    picture = read_picture(source)
    shown = picture.colour
    if shown is None:
        grey = np.ones_like(picture.opacity) if picture.grey is None else picture.grey
        shown = np.repeat(_bytes(grey)[:, :, None], 3, axis=2)
    height, width = shown.shape[:2]
    if picture.opacity is not None:
        shown = _spread(shown, picture.opacity >= OPAQUE)
    stream = io.BytesIO()
    Image.fromarray(shown).save(stream, "PNG")
    return Texture(stream.getvalue(), (height, width))


def _spread(colours: ByteArray, is_opaque: BoolArray) -> ByteArray:
    """(H, W, 3) with the colour of the nearest opaque pixel where there is none."""
    from scipy.ndimage import distance_transform_edt

    if not is_opaque.any() or is_opaque.all():
        return colours
    rows, columns = distance_transform_edt(~is_opaque, return_distances=False, return_indices=True)
    return np.ascontiguousarray(colours[rows, columns])


def _bytes(shares: object) -> ByteArray:
    return np.rint(255.0 * np.asarray(shares, np.float64)).astype(np.uint8)
