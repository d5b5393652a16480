"""Reading images: any source becomes a picture of at most MAX_SIDE pixels a side, or several, one for each frame."""

import os
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np
from PIL import Image, UnidentifiedImageError

from autopoly_env.arrays import AnyArray, ByteArray, Float32Array
from autopoly_env.errors import SilhouetteError
from autopoly_env.silhouette import svg
from autopoly_env.silhouette.layers import (
    DEEP_MODES,
    Layers,
    array_layers,
    is_coloured,
    pillow_layers,
    reduced,
    righted,
    stretched,
)

ImageSource = str | os.PathLike[str] | IO[bytes] | Image.Image | AnyArray

MAX_PIXELS = 500_000_000  # larger pictures are refused
MAX_FRAMES = 100  # that are looked at, of an animation
ROUNDING = 1e-6  # a float image may leave 0..1 by this much
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

NAMELESS = ""  # the name of a picture that has none, such as an array
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
    """The picture, or the first frame, of a path, binary file object, PIL image or array; see `read_frames`."""
    return next(iter(read_frames(source)))


def read_frames(source: ImageSource) -> Iterator[Picture]:
    """Read a path, binary file object, PIL image or array; at most MAX_SIDE pixels a side come back.

    Frames of an animation and pages of a file come one after the other, the first MAX_FRAMES of them. SVG is drawn,
    with the extra `svg`. Arrays are (H, W) or (H, W, 1 to 4: grey, grey + alpha, RGB, RGBA), uint8 or float in 0..1;
    boolean ones (H, W).

    Raises SilhouetteError when there is no such file, when it is no complete image or larger than MAX_PIXELS,
    and for arrays of another shape, dtype or range.
    """
    if isinstance(source, (str, os.PathLike)):
        return _read_path(Path(source))
    if isinstance(source, Image.Image):
        given_name = getattr(source, "filename", "")
        name = Path(given_name).stem if isinstance(given_name, (str, os.PathLike)) else ""
        return iter([_read_pillow(source, name, "the given image")])
    if isinstance(source, np.ndarray):
        return iter([_read_array(source)])
    if hasattr(source, "read"):
        given_name = getattr(source, "name", None)
        name = Path(given_name).stem if isinstance(given_name, str) else NAMELESS
        return _read_stream(source, name, "the given file object")
    kind = type(source).__name__
    raise SilhouetteError(f"cannot load a {kind}; expected a path, a binary file object, a PIL image or a numpy array")


def _read_path(path: Path) -> Iterator[Picture]:
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
        yield from _read_stream(stream, path.stem, label)


def _read_stream(stream: IO[bytes], name: str, label: str) -> Iterator[Picture]:
    try:
        with _pillow_limit(None):  # the size is checked below, with our own limit and message
            image: Image.Image = Image.open(stream)
    except UnidentifiedImageError as error:
        drawing = svg.read(stream, label)
        if drawing is None:
            advice = "expected a picture, such as PNG, JPEG, WebP, BMP, GIF, TIFF or SVG: export it as PNG"
            raise SilhouetteError(f"{label} is not an image that can be read; {advice}") from error
        image = drawing
    except Exception as error:  # a damaged header makes Pillow's readers raise almost anything
        raise _undecodable(label, error) from error
    if image.format == "EPS":  # a program in PostScript, which Pillow would have Ghostscript run
        raise SilhouetteError(f"{label} is PostScript, which is not run here: export it as PNG or SVG")
    yield _read_pillow(image, name, label)
    for number in range(1, min(_n_frames(image), MAX_FRAMES)):
        try:
            image.seek(number)
        except Exception:  # cut short: what came before is whole
            return
        yield _read_pillow(image, name, label)


def _n_frames(image: Image.Image) -> int:
    try:
        return int(getattr(image, "n_frames", 1))
    except Exception:  # counting reads the file to its end, which may be missing
        return 1


def _read_pillow(image: Image.Image, name: str, label: str) -> Picture:
    """The frame that the image stands at."""
    width, height = image.size
    _check_size(label, width, height)
    try:
        with _pillow_limit(MAX_PIXELS), _decoder_hushed(image):
            animated = getattr(image, "is_animated", False)
            image.load()
        layers, notes = reduced(lambda top, end: pillow_layers(image, top, end), width, height)
        orientation = image.getexif().get(EXIF_ORIENTATION, 1)
    except Exception as error:  # as above
        raise _undecodable(label, error) from error
    if animated:
        number = image.tell()
        notes.insert(0, f"frame {number + 1}, the first that shows something" if number else "first frame of several")
    if image.mode in DEEP_MODES:
        layers["grey"] = stretched(layers["grey"], label, notes)
    if orientation in RIGHTING:
        layers = {key: righted(layer, *RIGHTING[orientation]) for key, layer in layers.items()}
        notes.append(f"turned upright (EXIF orientation {orientation})")
    return _picture(layers, name, label, notes)


def _read_array(array: AnyArray) -> Picture:
    label = f"the given array of shape {array.shape} and dtype {array.dtype}"
    if array.ndim not in (2, 3) or (array.ndim == 3 and array.shape[2] not in (1, 2, 3, 4)):
        raise SilhouetteError(f"{label} is no image; expected (H, W) or (H, W, 1 to 4): reshape it")
    height, width = array.shape[:2]
    _check_size(label, width, height)
    if np.ma.is_masked(array):
        raise SilhouetteError(f"{label} has masked pixels; expected values: fill them, e.g. array.filled(0)")
    array = np.asarray(array)
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
    layers, notes = reduced(lambda top, end: array_layers(array[top:end]), width, height)
    if is_mask:
        return Picture(None, None, layers["grey"], NAMELESS, label, tuple(notes))
    return _picture(layers, NAMELESS, label, notes)


def _picture(layers: Layers, name: str, label: str, notes: list[str]) -> Picture:
    colour = layers.get("colour")
    if colour is not None and not is_coloured(colour):
        colour = None
    return Picture(layers["grey"], colour, layers.get("opacity"), name, label, tuple(notes))


@contextmanager
def _pillow_limit(n_pixels: int | None) -> Iterator[None]:
    """Set Pillow's decompression-bomb limit, a global, for as long as the block runs; its warnings are left out."""
    with _pillow_lock, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        before = Image.MAX_IMAGE_PIXELS
        Image.MAX_IMAGE_PIXELS = n_pixels
        try:
            yield
        finally:
            Image.MAX_IMAGE_PIXELS = before


@contextmanager
def _decoder_hushed(image: Image.Image) -> Iterator[None]:
    """Keep off stderr what libtiff writes there by itself of a damaged file; the error that follows tells of it."""
    try:
        before = os.dup(2) if image.format == "TIFF" else None
    except OSError:  # there is no stderr
        before = None
    if before is None:
        yield
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        os.dup2(before, 2)
        os.close(before)
        os.close(nowhere)


def _check_size(label: str, width: int, height: int) -> None:
    """Raise SilhouetteError if there are no pixels, or too many."""
    if width * height > MAX_PIXELS:
        limit = f"expected at most {MAX_PIXELS // 10**6} megapixels: scale it down first"
        raise SilhouetteError(f"{label} has {width}x{height} pixels; {limit}")
    if width * height == 0:
        raise SilhouetteError(f"{label} has no pixels ({width}x{height}); expected at least 2: give another image")


def _undecodable(label: str, error: Exception) -> SilhouetteError:
    advice = "it is damaged or cut short: save or download it again"
    return SilhouetteError(f"{label} cannot be decoded ({_reason(error)}); {advice}")


def _reason(error: Exception) -> str:
    """The message of an error of another library, without line breaks; its kind where it has none."""
    return " ".join(str(getattr(error, "strerror", None) or error).split()) or type(error).__name__
