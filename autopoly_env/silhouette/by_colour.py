"""The opinion of colour: the object is what differs from the background, or what is like a colour that was given."""

import numpy as np

from autopoly_env.arrays import BoolArray, Float32Array
from autopoly_env.errors import SilhouetteError
from autopoly_env.silhouette.background import Background, find_background
from autopoly_env.silhouette.colours import hex_of, oklab, parse_colour
from autopoly_env.silhouette.difference import (
    FAINT,
    SPRITE,
    STUDIED,
    beyond_cut,
    choose_cut,
    filled,
    is_grainy,
    paler_share,
)
from autopoly_env.silhouette.opinion import Opinion, View
from autopoly_env.silhouette.options import ObjectOptions

BLURRED = 0.7  # of the support of a sharp outline
PRESENT, PRESENT_SHARE = 0.1, 1e-4  # a colour is in the picture if so many pixels are so close to it
HOLLOW, LOWERED = 0.1, 0.02  # so much of an object is hole: worth a word, if a cut so low may find more of it
PALER = {FAINT: 0.15, LOWERED: 0.2}  # of a sprite, by which a cut so low makes it larger: worth a word
LIKE = 0.12  # of the object's colour is what is this close to it, where nothing was said about the background


def opinion(view: View) -> Opinion | None:
    """What differs from most of the border; None where nothing does."""
    background = find_background(view.features)
    distances = background.distances(view.features)
    cut = choose_cut(distances, background)
    if cut is None:
        return None
    mask = beyond_cut(view.features, distances, background, cut.level)
    if not mask.any() or mask.all():
        return None
    support = background.support * (1.0 if cut.is_sharp else BLURRED)
    name = hex_of(background.colour)
    if background.field is None:
        notes = [f"object is what differs in colour from the background, {name}, by more than {cut.level:.2f}"]
        doubts = []
    else:
        notes = [f"object is what differs by more than {cut.level:.2f} from a background whose light is uneven"]
        doubts = ["warning: the light is uneven: is it a photo?"]
    remarks = []
    if not cut.is_sharp:
        remarks.append("the outline is soft: --threshold says where it is cut")
    enclosed = _enclosed_share(mask) if cut.level > LOWERED else 0.0
    if enclosed > HOLLOW:
        words = f"{enclosed:.0%} of what its outline encloses looks like the background"
        remarks.append(f"{words}: --background '{name}' --threshold {LOWERED} takes more of it")
    if max(mask.shape) < SPRITE:
        doubts += _doubts_on_pale_parts(mask, distances, cut.level, name)
    is_even = background.is_even and cut.is_sharp
    return Opinion(
        mask, tuple(notes), support, tuple(remarks), tuple(doubts), name, is_clear=background.is_flat, is_even=is_even
    )


def _doubts_on_pale_parts(mask: BoolArray, distances: Float32Array, level: float, name: str) -> list[str]:
    """A word where a lower cut would find much more: in a small picture that was compressed nobody can tell."""
    if is_grainy(mask, distances):
        return []
    for lower, most in PALER.items():
        share = paler_share(mask, distances, lower) if lower < level else 0.0
        if share > most:
            words = f"{share:.0%} more differs a little, pale parts or what compression left"
            return [f"{words}: --background '{name}' --threshold {lower} takes that in"]
    return []


def _enclosed_share(mask: BoolArray) -> float:
    """The share of holes in what the outline encloses, judged on about STUDIED pixels a side."""
    step = max(1, max(mask.shape) // STUDIED)
    small = mask[::step, ::step]
    return 1.0 - float(small.sum()) / max(1, int(filled(small).sum()))


def asked(label: str, view: View, options: ObjectOptions) -> Opinion:
    """What differs from a colour that was given for the background, or is like one that was given for the object.

    Raises SilhouetteError for a colour that is not in the picture.
    """
    for name, text in (("object", options.object_colour), ("background", options.background)):
        if text is not None and not _is_present(view, text):
            raise SilhouetteError(f"{label} shows no {text} (the {name} asked for); {_colours_of(view)}")
    given = options.threshold
    if options.object_colour is None:
        assert options.background is not None
        background = Background(_feature(view, options.background), None, 1.0, 0.02)
        distances = background.distances(view.features)
        cut = choose_cut(distances, background) if given is None else None
        level = given if given is not None else cut.level if cut is not None else 0.0
        mask = distances > level
        if given is None:
            mask = beyond_cut(view.features, distances, background, level)
        return Opinion(mask, (f"object is what differs from {options.background} by more than {level:.2f}",), 1.0)
    near = _distances(view, options.object_colour)
    if given is not None:
        return Opinion(near <= given, (f"object is what is within {given:.2f} of {options.object_colour}",), 1.0)
    if options.background is not None:
        far, other = _distances(view, options.background), options.background
    else:
        far, other = _distance_from_background(view, near)
    if other:
        said = f"object is what is closer to {options.object_colour} than to the background, {other}"
        return Opinion(near < np.minimum(far, 0.5 * near.max()), (said,), 1.0)
    return Opinion(near <= LIKE, (f"object is what is within {LIKE:.2f} of {options.object_colour}",), 1.0)


def _distance_from_background(view: View, near: Float32Array) -> tuple[Float32Array, str]:
    """How far every pixel is from the background, and its name; no name where that is the object's own colour."""
    background = find_background(view.features)
    far = background.distances(view.features)
    is_own = float(near[far <= far.min() + 0.02].min()) < LIKE
    return far, "" if is_own else hex_of(background.colour)


def _feature(view: View, text: str) -> Float32Array:
    lab = oklab(np.array(parse_colour(text), dtype=np.uint8))
    return lab[: view.features.shape[2]]


def _distances(view: View, text: str) -> Float32Array:
    """How far every pixel is from a colour."""
    return Background(_feature(view, text), None, 1.0, 0.0).distances(view.features)


def _is_present(view: View, text: str) -> bool:
    lab = oklab(np.array(parse_colour(text), dtype=np.uint8))
    if view.is_grey and float(np.hypot(lab[1], lab[2])) > PRESENT:
        return False
    close = _distances(view, text) < PRESENT
    return bool(close.sum() >= max(1, PRESENT_SHARE * close.size))


def _colours_of(view: View) -> str:
    """The colours that a picture mostly has, as advice."""
    points = view.features.reshape(-1, view.features.shape[2])
    points = points[:: max(1, len(points) // 4096)]
    _, first, counts = np.unique(np.rint(points * 10), axis=0, return_index=True, return_counts=True)
    names = [hex_of(points[first[i]]) for i in np.argsort(-counts, kind="stable")[:4]]
    return f"it mostly has {', '.join(dict.fromkeys(names))}: give one of these"
