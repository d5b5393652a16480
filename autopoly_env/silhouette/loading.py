"""Reading images: any source becomes a small grey picture (and its opacity), however large it was."""

import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np
from PIL import Image, UnidentifiedImageError

from autopoly_env.arrays import AnyArray, ByteArray, Float32Array
from autopoly_env.errors import SilhouetteError

ImageSource = str | os.PathLike[str] | IO[bytes] | Image.Image | AnyArray

MAX_SIDE = 2048  # pixels; longer pictures are reduced by an integer factor
MAX_PIXELS = 500_000_000  # larger pictures are refused
STRIP_PIXELS = 2**20  # pixels converted at a time, so that a huge picture never exists twice
ROUNDING = 1e-6  # a float image may leave 0..1 by this much
LUMA = np.array([0.299, 0.587, 0.114], dtype=np.float32)  # ITU-R BT.601, as Pillow's mode "L"
GREY_MODES = ("1", "L", "LA", "La", "LAB")
DEEP_MODES = ("I", "F", "I;16", "I;16B", "I;16L", "I;16N")  # more than 8 bits a pixel
STRAY_SHARE, STRAY_REACH = (
    5e-4,
    2.0,
)  # so many levels may be dead or hot pixels, if the range is so many times that of the rest
EXIF_ORIENTATION = 0x0112
# EXIF orientation -> what rights the picture: (transpose, then reverse rows, then reverse columns)
RIGHTING = {
    2: (False, False, True),
    3: (False, True, True),
    4: (False, True, False),
    5: (True, False, False),
    6: (True, False, True),
    7: (True, True, True),
    8: (True, True, False),
}

Layers = dict[str, AnyArray]  # of some rows: "grey" and "opacity" (h, W) float32, "colour" (h, W, 3) uint8

_pillow_lock = threading.Lock()


@dataclass(frozen=True, eq=False)
class Picture:
    """What was read from a source, before anything decides which part of it is the object.

    `grey` (H, W) float32 in 0..1, None for a boolean array. `colour` (H, W, 3) uint8, sRGB, None where all is grey.
    `opacity` (H, W) float32 in 0..1: the alpha channel where there is one, and a boolean array itself. `label` names
    the source in errors.
    """

    grey: Float32Array | None
    colour: ByteArray | None
    opacity: Float32Array | None
    name: str
    label: str
    notes: tuple[str, ...]

    @property
    def is_flat(self) -> bool:
        """Whether all of it has one colour."""
        shown = self.grey if self.colour is None else self.colour
        return shown is None or bool((shown == shown[0, 0]).all())


def read_picture(source: ImageSource) -> Picture:
    """Read a path, binary file object, PIL image or array; at most MAX_SIDE pixels a side come back.

    Arrays are (H, W) or (H, W, 1 to 4: grey, grey + alpha, RGB, RGBA), uint8 or float in 0..1; boolean ones
    (H, W).

    Raises SilhouetteError when there is no such file, when it is no complete image or larger than MAX_PIXELS,
    and for arrays of another shape, dtype or range.
    """
    if isinstance(source, (str, os.PathLike)):
        return _read_path(Path(source))
    if isinstance(source, Image.Image):
        given_name = getattr(source, "filename", "")
        name = Path(given_name).stem if isinstance(given_name, (str, os.PathLike)) else ""
        return _read_pillow(source, name or "silhouette", "the given image")
    if isinstance(source, np.ndarray):
        return _read_array(source)
    if hasattr(source, "read"):
        given_name = getattr(source, "name", None)
        name = Path(given_name).stem if isinstance(given_name, str) else "silhouette"
        return _read_stream(source, name, "the given file object")
    kind = type(source).__name__
    raise SilhouetteError(f"cannot load a {kind}; expected a path, a binary file object, a PIL image or a numpy array")


def _read_path(path: Path) -> Picture:
    label = repr(str(path))
    if os.path.isdir(path):
        raise SilhouetteError(f"{label} is a directory; expected one image file: name a file in it")
    try:
        stream = path.open("rb")
    except FileNotFoundError:
        raise SilhouetteError(f"{label} does not exist; expected an image file: check the path") from None
    except (OSError, ValueError) as error:
        raise SilhouetteError(f"{label} cannot be opened ({_reason(error)}); expected a readable image file") from error
    with stream:
        return _read_stream(stream, path.stem, label)


def _read_stream(stream: IO[bytes], name: str, label: str) -> Picture:
    try:
        with _pillow_limit(None):  # the size is checked below, with our own limit and message
            image = Image.open(stream)
    except UnidentifiedImageError as error:
        advice = "expected PNG, JPEG, WebP, BMP, GIF or TIFF: export it as PNG"
        raise SilhouetteError(f"{label} is not an image that can be read; {advice}") from error
    except Exception as error:  # a damaged header makes Pillow's readers raise almost anything
        raise _undecodable(label, error) from error
    return _read_pillow(image, name, label)


def _read_pillow(image: Image.Image, name: str, label: str) -> Picture:
    width, height = image.size
    if width * height > MAX_PIXELS:
        limit = f"expected at most {MAX_PIXELS // 10**6} megapixels: scale it down first"
        raise SilhouetteError(f"{label} has {width}x{height} pixels; {limit}")
    if width * height == 0:
        raise _without_pixels(label, f"{width}x{height}")
    try:
        with _pillow_limit(MAX_PIXELS):
            animated = getattr(image, "is_animated", False)
            image.load()
        layers, notes = _reduced(lambda top, end: _pillow_layers(image, top, end), width, height)
        orientation = image.getexif().get(EXIF_ORIENTATION, 1)
    except Exception as error:  # as above
        raise _undecodable(label, error) from error
    if animated:
        notes.insert(0, "first frame of several")
    if image.mode in DEEP_MODES:
        layers["grey"] = _stretched(layers["grey"], label, notes)
    if orientation in RIGHTING:
        layers = {key: _righted(layer, *RIGHTING[orientation]) for key, layer in layers.items()}
        notes.append(f"turned upright (EXIF orientation {orientation})")
    return _picture(layers, name, label, notes)


def _read_array(array: AnyArray) -> Picture:
    label = f"the given array of shape {array.shape} and dtype {array.dtype}"
    if array.ndim not in (2, 3) or (array.ndim == 3 and array.shape[2] not in (1, 2, 3, 4)):
        raise SilhouetteError(f"{label} is no image; expected (H, W) or (H, W, 1 to 4): reshape it")
    height, width = array.shape[:2]
    if array.size == 0:
        raise _without_pixels(label, f"{width}x{height}")
    is_mask = array.dtype == np.bool_
    if is_mask and array.size != width * height:
        raise SilhouetteError(f"{label} is no mask; expected one channel: combine them, e.g. array.any(axis=2)")
    if not (is_mask or array.dtype == np.uint8 or np.issubdtype(array.dtype, np.floating)):
        raise SilhouetteError(f"{label} has no known range; expected bool, uint8 or float in 0..1: convert it")
    if np.issubdtype(array.dtype, np.floating):
        low, high = float(array.min()), float(array.max())
        if not np.isfinite(high - low):
            raise SilhouetteError(f"{label} holds NaN or infinity; expected finite values: replace them")
        if low < -ROUNDING or high > 1 + ROUNDING:
            raise SilhouetteError(f"{label} spans {low:g}..{high:g}; expected floats in 0..1: rescale it")
    layers, notes = _reduced(lambda top, end: _array_layers(array[top:end]), width, height)
    if is_mask:
        return Picture(None, None, layers["grey"], "silhouette", label, tuple(notes))
    return _picture(layers, "silhouette", label, notes)


def _picture(layers: Layers, name: str, label: str, notes: list[str]) -> Picture:
    colour = layers.get("colour")
    if colour is not None and not _is_coloured(colour):
        colour = None
    return Picture(layers["grey"], colour, layers.get("opacity"), name, label, tuple(notes))


def _is_coloured(colour: ByteArray) -> bool:
    """Whether red, green and blue differ anywhere."""
    return any((colour[..., 0] != colour[..., channel]).any() for channel in (1, 2))


def _array_layers(array: AnyArray) -> Layers:
    """Some rows of an array, in 0..1."""
    levels = array.astype(np.float32) / np.float32(255 if array.dtype == np.uint8 else 1)
    if levels.ndim == 2:
        return {"grey": levels}
    n_colours = levels.shape[2] - (levels.shape[2] in (2, 4))
    layers: Layers = {"grey": levels[..., :3] @ LUMA if n_colours == 3 else levels[..., 0]}
    if n_colours == 3:
        layers["colour"] = np.clip(np.rint(255 * levels[..., :3]), 0, 255).astype(np.uint8)
    if levels.shape[2] > n_colours:
        layers["opacity"] = levels[..., n_colours]
    return layers


def _pillow_layers(image: Image.Image, top: int, end: int) -> Layers:
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


def _reduced(layers_of_rows: Callable[[int, int], Layers], width: int, height: int) -> tuple[Layers, list[str]]:
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


def _stretched(levels: Float32Array, label: str, notes: list[str]) -> Float32Array:
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


def _righted(layer: AnyArray, transpose: bool, reverse_rows: bool, reverse_columns: bool) -> AnyArray:
    if transpose:
        layer = layer.swapaxes(0, 1)
    return layer[:: -1 if reverse_rows else 1, :: -1 if reverse_columns else 1]


@contextmanager
def _pillow_limit(n_pixels: int | None) -> Iterator[None]:
    """Set Pillow's decompression-bomb limit, a global, for as long as the block runs."""
    with _pillow_lock:
        before = Image.MAX_IMAGE_PIXELS
        Image.MAX_IMAGE_PIXELS = n_pixels
        try:
            yield
        finally:
            Image.MAX_IMAGE_PIXELS = before


def _without_pixels(label: str, size: str) -> SilhouetteError:
    return SilhouetteError(f"{label} has no pixels ({size}); expected at least 2: give another image")


def _undecodable(label: str, error: Exception) -> SilhouetteError:
    advice = "it is damaged or cut short: save or download it again"
    return SilhouetteError(f"{label} cannot be decoded ({_reason(error)}); {advice}")


def _reason(error: Exception) -> str:
    """The message of an error of another library, without line breaks; its kind where it has none."""
    return " ".join(str(getattr(error, "strerror", None) or error).split()) or type(error).__name__
