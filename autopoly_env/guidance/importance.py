"""The weight image: a picture that says where matching a silhouette matters, white most and black not at all."""

import numpy as np

from autopoly_env.arrays import FloatArray
from autopoly_env.errors import ConfigError, SilhouetteError
from autopoly_env.silhouette import ROUNDING, WEIGHT_STEPS, ImageSource, Silhouette, area_means, read_picture

ImportanceSource = ImageSource  # read as grey levels; an alpha channel is not looked at


def weighted(silhouette: Silhouette, importance: ImportanceSource) -> Silhouette:
    """The silhouette with the weights of an image: the same where that is grey all over, for only ratios matter.

    The image has any size, and the proportions of the silhouette's picture or of the square that this was padded to.
    It is resampled by area means; padding weighs as much as the edge of the picture next to it, and the brightest
    pixel of the image 1.

    Raises ConfigError if the image cannot be read, holds NaN, negative or too large levels, has other proportions, or
    is black all over or on all of the object.
    """
    levels = read_importance(importance)
    if np.ptp(levels) <= ROUNDING:
        return silhouette
    weights = _framed(levels / levels.max(), silhouette)
    if not (np.rint(weights * WEIGHT_STEPS) * silhouette.mask).any():
        raise ConfigError(
            f"the weight image is black on all of the object of {silhouette.name!r}: make what matters there brighter"
        )
    weights.flags.writeable = False
    return Silhouette(silhouette.mask, silhouette.name, silhouette.notes, silhouette.picture_shape, weights)


def read_importance(source: ImportanceSource) -> FloatArray:
    """The grey levels (H, W) of a weight image, 0 to 1. Raises ConfigError as `weighted`."""
    try:
        picture = read_picture(source)
    except SilhouetteError as error:
        raise ConfigError(f"weight image: {error}") from None
    levels = picture.opacity if picture.grey is None else picture.grey
    assert levels is not None
    if not levels.max() > 0.0:
        raise ConfigError("the weight image is black all over: expected brighter grey where matching matters")
    return np.clip(levels, 0.0, 1.0).astype(np.float64)


def _framed(levels: FloatArray, silhouette: Silhouette) -> FloatArray:
    """The levels on the silhouette's pixels (R, R)."""
    size = silhouette.resolution
    height, width = silhouette.picture_shape or (size, size)
    n_rows, n_columns = levels.shape
    if n_rows == n_columns:
        height = width = size  # it is for the padded square
    elif 2 * abs(n_rows * width - n_columns * height) > max(
        n_rows, n_columns, height, width
    ):  # half a pixel is rounding
        raise ConfigError(
            f"the weight image has {n_columns}x{n_rows} pixels, the picture of {silhouette.name!r} {width}x{height}: "
            "expected the same proportions, or a square over the padded picture"
        )
    on_picture = area_means(levels, (height, width))
    above, left = (size - height) // 2, (size - width) // 2
    return np.pad(on_picture, ((above, size - height - above), (left, size - width - left)), mode="edge")
