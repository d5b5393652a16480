"""What the alpha channel says about the object: what is opaque, whether that means anything, and soft shadows."""

from dataclasses import dataclass

import numpy as np

from autopoly_env.arrays import BoolArray, Float32Array
from autopoly_env.errors import SilhouetteError
from autopoly_env.silhouette.connectivity import grown, shrunk
from autopoly_env.silhouette.loading import Picture
from autopoly_env.silhouette.options import ObjectOptions

OPAQUE = 0.5  # of the most opaque pixel
SOLID, FAINT = 0.9, 0.1  # half transparent is what lies between
CLEAR_SHARE = 0.005  # of the picture inside its margin has to be clear: then alpha is about the object
MARGIN_SHARE = 1 / 64  # of a side
WIDE_SHARE = 0.02  # of the opaque pixels: half transparent ones that are no edges are worth a word
SHADOW_DARK, SHADOW_DARKER = 0.3, 0.08  # grey of a shadow at most, and how much darker than the object it is


@dataclass(frozen=True, eq=False)
class Alpha:
    """The opaque part (H, W) of a picture, how it was found, and whether it may be the object (or just the page)."""

    opaque: BoolArray
    notes: tuple[str, ...]
    decides: bool


def read_alpha(picture: Picture, options: ObjectOptions) -> Alpha | None:
    """What alpha says; None where there is none, or where it is the same all over.

    Raises SilhouetteError for a picture that is transparent everywhere, and for --object alpha without alpha.
    """
    opacity = picture.opacity
    if opacity is not None and not opacity.any():
        advice = "expected an object that differs from its background: give another image"
        raise SilhouetteError(f"{picture.label} is transparent everywhere: there is no object; {advice}")
    if opacity is None or opacity.min() == opacity.max():
        if options.object == "alpha" or options.alpha_threshold is not None:
            what = "no alpha channel" if opacity is None else "the same alpha everywhere"
            asked = "object 'alpha'" if options.object == "alpha" else f"alpha_threshold {options.alpha_threshold:g}"
            raise SilhouetteError(f"{picture.label} has {what}, so that {asked} finds nothing; leave that option out")
        return None
    relative = opacity / opacity.max()
    cut = options.alpha_threshold or OPAQUE
    opaque = relative >= np.float32(cut)
    if opaque.all() and options.alpha_threshold is None and picture.is_flat:  # nothing but alpha can tell
        cut = 0.5 * float(1 + relative.min())
        opaque = relative >= np.float32(cut)
    level = int(np.ceil(255 * cut * float(opacity.max()) - 1e-4))
    notes = [f"object is what alpha shows as opaque ({level} or more)"]
    if options.alpha_threshold is None and picture.grey is not None:
        opaque, how = _without_shadow(picture.grey, relative, opaque)
        notes += how
    return Alpha(opaque, tuple(notes), options.object == "alpha" or _is_about_the_object(opaque))


def _is_about_the_object(opaque: BoolArray) -> bool:
    """Whether a real share of the picture is clear: not just its corners, or a soft line around a page."""
    height, width = opaque.shape
    down, right = int(MARGIN_SHARE * height), int(MARGIN_SHARE * width)
    inner = opaque[down : height - down, right : width - right]
    return bool(opaque.any()) and float(1 - inner.mean()) > CLEAR_SHARE


def _without_shadow(grey: Float32Array, relative: Float32Array, opaque: BoolArray) -> tuple[BoolArray, list[str]]:
    """The opaque part without a dark, half transparent shadow, and notes on what is half transparent."""
    half = (relative > FAINT) & (relative < SOLID)
    if half.sum() < WIDE_SHARE * opaque.sum():
        return opaque, []
    wide = shrunk(half)
    n_wide, n_opaque = int(wide.sum()), int(opaque.sum())
    solid = relative >= SOLID
    if n_wide < WIDE_SHARE * n_opaque or not solid.any():
        return opaque, []
    of_object = (wide & opaque).sum() / n_opaque
    shade, own = float(np.median(grey[wide])), float(np.median(grey[solid]))
    if shade < SHADOW_DARK and shade < own - SHADOW_DARKER and solid.sum() > 0.2 * n_opaque:
        if not of_object:
            return opaque, ["a faint shadow is not part of the object: --alpha-threshold 0.1 takes it in"]
        edge = opaque & grown(solid) & ~grown(wide)
        return solid | edge, ["a soft shadow is not part of the object: --alpha-threshold 0.5 takes it in"]
    if of_object > WIDE_SHARE:
        return opaque, [f"{of_object:.0%} of the object is half transparent: --alpha-threshold 0.9 leaves it out"]
    share = (wide & ~opaque).sum() / n_opaque
    return opaque, [f"what is fainter, {share:.0%} of the object, is left out: --alpha-threshold 0.1 takes it in"]
