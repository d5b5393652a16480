"""The pixels of a picture, read strip by strip into grey, opacity and colour, however large it is."""

from collections.abc import Callable

import numpy as np
from PIL import Image

from autopoly_env.arrays import AnyArray, ByteArray, Float32Array
from autopoly_env.errors import SilhouetteError

MAX_SIDE = 2048  # pixels; longer pictures are reduced by an integer factor
STRIP_PIXELS = 2**20  # pixels converted at a time, so that a huge picture never exists twice
LUMA = np.array([0.299, 0.587, 0.114], dtype=np.float32)  # ITU-R BT.601, as Pillow's mode "L"
GREY_MODES = ("1", "L", "LA", "La", "LAB")
DEEP_MODES = ("I", "F", "I;16", "I;16B", "I;16L", "I;16N")  # more than 8 bits a pixel
STRAY_SHARE, STRAY_REACH = 5e-4, 2.0  # dead and hot pixels: how many, and how much wider they make the range

Layers = dict[str, AnyArray]  # of some rows: "grey" and "opacity" (h, W) float32, "colour" (h, W, 3) uint8


def is_coloured(colour: ByteArray) -> bool:
    """Whether red, green and blue differ anywhere."""
    for part in (colour[::16, ::16], colour):  # a few pixels mostly tell
        if any((part[..., 0] != part[..., channel]).any() for channel in (1, 2)):
            return True
    return False


def array_layers(array: AnyArray) -> Layers:
    """Some rows of an array, in 0..1."""
    is_bytes = array.dtype == np.uint8
    levels = array.astype(np.float32) / np.float32(255 if is_bytes else 1)
    if levels.ndim == 2:
        return {"grey": levels}
    n_colours = levels.shape[2] - (levels.shape[2] in (2, 4))
    layers: Layers = {"grey": levels[..., :3] @ LUMA if n_colours == 3 else levels[..., 0]}
    if n_colours == 3:
        colour = array if is_bytes else np.clip(np.rint(255 * levels), 0, 255).astype(np.uint8)
        layers["colour"] = colour[..., :3]
    if levels.shape[2] > n_colours:
        layers["opacity"] = levels[..., n_colours]
    return layers


def pillow_layers(image: Image.Image, top: int, end: int) -> Layers:
    """Rows top..end of a loaded image, in 0..1 unless it is deep."""
    strip = image.crop((0, top, image.width, end))
    if strip.mode in DEEP_MODES:
        return {"grey": np.asarray(strip, dtype=np.float32)}
    layers: Layers = {}
    if strip.has_transparency_data:
        strip = strip.convert("RGBA")
        layers["opacity"] = _levels(strip.getchannel("A"))
    layers["grey"] = _levels(strip.getchannel("L") if strip.mode == "LAB" else strip.convert("L"))
    if strip.mode not in GREY_MODES:
        layers["colour"] = np.asarray(strip if strip.mode == "RGB" else strip.convert("RGB"))
    return layers


def _levels(band: Image.Image) -> Float32Array:
    return np.asarray(band, dtype=np.float32) / np.float32(255)


def reduced(layers_of_rows: Callable[[int, int], Layers], width: int, height: int) -> tuple[Layers, list[str]]:
    """Read strip by strip and average blocks of factor x factor pixels: layers with sides <= MAX_SIDE, notes."""
    factor = -(-max(width, height) // MAX_SIDE)
    rows = factor * max(1, STRIP_PIXELS // (width * factor))
    strips = []
    for top in range(0, height, rows):
        strip = layers_of_rows(top, min(top + rows, height))
        strips.append({name: _block_means(layer, factor) for name, layer in strip.items()})
    layers = {name: np.concatenate([strip[name] for strip in strips]) for name in strips[0]}
    if factor == 1:
        return layers, []
    size = f"{layers['grey'].shape[1]}x{layers['grey'].shape[0]}"
    return layers, [f"reduced from {width}x{height} to {size} (blocks of {factor}x{factor} averaged)"]


def _block_means(layer: AnyArray, factor: int) -> AnyArray:
    """Means over factor x factor blocks of (H, W, ...); the last row and column of blocks may be smaller."""
    if factor == 1:
        return layer
    means = layer.astype(np.float32)
    for axis in (0, 1):
        starts = np.arange(0, means.shape[axis], factor)
        counts = np.diff(starts, append=means.shape[axis]).astype(np.float32)
        means = np.add.reduceat(means, starts, axis=axis)
        means /= np.expand_dims(counts, tuple(i for i in range(means.ndim) if i != axis))
    return np.rint(means).astype(np.uint8) if layer.dtype == np.uint8 else means


def stretched(levels: Float32Array, label: str, notes: list[str]) -> Float32Array:
    """Levels of unknown range, scaled so that they span 0..1, but for the odd pixel that is far beyond all others."""
    low, high = float(levels.min()), float(levels.max())
    if not np.isfinite(high - low):
        raise SilhouetteError(f"{label} holds NaN or infinity; expected finite levels: replace them")
    if low == high or (low, high) == (0, 1):
        return levels
    inner_low, inner_high = (float(value) for value in np.quantile(levels, (STRAY_SHARE, 1 - STRAY_SHARE)))
    if inner_high > inner_low and high - low > STRAY_REACH * (inner_high - inner_low):
        n_stray = int(((levels < inner_low) | (levels > inner_high)).sum())
        notes.append(f"levels {inner_low:g}..{inner_high:g} scaled to 0..1, {n_stray} pixels lie beyond")
        return np.clip((levels - np.float32(inner_low)) / np.float32(inner_high - inner_low), 0, 1)
    notes.append(f"levels {low:g}..{high:g} scaled to 0..1")
    return (levels - np.float32(low)) / np.float32(high - low)


def righted(layer: AnyArray, transpose: bool, reverse_rows: bool, reverse_columns: bool) -> AnyArray:
    """The layer transposed, and its rows and columns reversed, as asked."""
    if transpose:
        layer = layer.swapaxes(0, 1)
    return layer[:: -1 if reverse_rows else 1, :: -1 if reverse_columns else 1]
