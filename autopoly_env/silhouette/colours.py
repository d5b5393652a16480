"""Colours as people see them: names and hex codes, and Oklab, in which distances mean differences.

Oklab is Björn Ottosson's ("A perceptual color space for image processing", 2020): L is 0 for black and 1 for white, a
and b are 0 for greys. Distances are Euclidean there.
"""

import numpy as np

from autopoly_env.arrays import AnyArray, ByteArray, Float32Array

RGB = tuple[int, int, int]

_LEVELS = np.arange(256) / 255.0
_LINEAR = np.where(_LEVELS <= 0.04045, _LEVELS / 12.92, ((_LEVELS + 0.055) / 1.055) ** 2.4).astype(np.float32)
_LIGHTNESS = np.cbrt(_LINEAR)
_BLOCK = 2**13  # pixels: so few stay in the cache, and BLAS starts no threads for them
_TO_CONES = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ],
    dtype=np.float32,
)
_TO_LAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ],
    dtype=np.float32,
)


def parse_colour(text: str) -> RGB:
    """The sRGB levels (0..255) of a name or code. Raises ValueError for what is none."""
    from PIL import ImageColor

    red, green, blue = ImageColor.getrgb(text.strip())[:3]
    return red, green, blue


def oklab(levels: ByteArray) -> Float32Array:
    """Oklab (..., 3) of sRGB levels (..., 3); in memory L comes first, then a, then b: quicker to work on."""
    flat = levels.reshape(-1, 3).T
    lab = np.empty(flat.shape, dtype=np.float32)
    for start in range(0, flat.shape[1], _BLOCK):
        block = slice(start, start + _BLOCK)
        np.matmul(_TO_LAB, np.cbrt(_TO_CONES @ _LINEAR.take(flat[:, block])), out=lab[:, block])
    return np.moveaxis(lab.reshape(3, *levels.shape[:-1]), 0, -1)


def oklab_lightness(grey: AnyArray) -> Float32Array:
    """Oklab's L (...,) of sRGB grey levels: 0..255 if they are bytes, else 0..1."""
    if grey.dtype == np.uint8:
        return _LIGHTNESS[grey]
    level = np.clip(np.asarray(grey, dtype=np.float32), 0, 1)
    linear = np.where(level <= 0.04045, level / 12.92, ((level + 0.055) / 1.055) ** 2.4)
    return np.cbrt(linear).astype(np.float32, copy=False)


def hex_of(feature: AnyArray) -> str:
    """An Oklab colour (3,) or lightness (1,) as #rrggbb, the nearest that a screen can show."""
    lab = np.zeros(3)
    lab[: len(feature)] = feature
    linear = np.linalg.inv(_TO_CONES.astype(np.float64)) @ (np.linalg.inv(_TO_LAB.astype(np.float64)) @ lab) ** 3
    linear = np.clip(linear, 0.0, 1.0)
    levels = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return "#" + "".join(f"{round(255 * float(level)):02x}" for level in levels)
