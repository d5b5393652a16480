"""Which pixels of a picture are the object: alpha, colour and lightness are asked, the best supported believed."""

import numpy as np

from autopoly_env.arrays import BoolArray
from autopoly_env.errors import SilhouetteError
from autopoly_env.silhouette import by_colour, by_lightness
from autopoly_env.silhouette.alpha import Alpha, read_alpha
from autopoly_env.silhouette.background import NO_FRAME, Frame, border, find_frame
from autopoly_env.silhouette.colours import hex_of
from autopoly_env.silhouette.connectivity import shrunk
from autopoly_env.silhouette.inside_out import righted
from autopoly_env.silhouette.loading import Picture
from autopoly_env.silhouette.opinion import Opinion, View, are_alike, view_of
from autopoly_env.silhouette.options import DEFAULT_OPTIONS, ObjectOptions

AGREED = 0.03  # of the object: opinions that differ by less are one
TRUSTED = 0.6  # support from which the colour of the border is believed to be that of the background
UNSEEN = (
    0.5  # of what differs in colour from a noisy background: if lightness finds no more, it does not see the object
)
ADVICE = "expected an object that differs from its background"
TILE = 0.8  # of its extent: what is opaque is a tile, on which something may be drawn
NOISE_LEVELS, NOISE_SIDE, NOISE_BAND = 3, 24, (0.85, 1.15)  # see `_is_noise`


def find_object(picture: Picture, options: ObjectOptions = DEFAULT_OPTIONS) -> tuple[BoolArray, list[str]]:
    """The (H, W) mask of the object, and notes on how it was told from the background.

    Alpha decides where a real share of the picture is clear. Otherwise the object is what differs in colour from the
    background, which most of the border shows, or one side of Otsu's threshold of grey levels: where the two disagree,
    the better supported one is taken, and a note says so. `options` overrule all of that.

    Raises SilhouetteError where there is no object, and where the picture has not what the options ask for.
    """
    if picture.grey is None:
        return _given_mask(picture, options)
    alpha = read_alpha(picture, options)
    asked_otherwise = options.object not in ("auto", "alpha") or options.background or options.threshold is not None
    if alpha is not None and (options.object == "alpha" or options.alpha_threshold is not None) and not asked_otherwise:
        return alpha.opaque, list(alpha.notes)
    if alpha is not None and alpha.decides and not asked_otherwise:
        return alpha.opaque, [*alpha.notes, *_inner_notes(picture, alpha)]
    view = _view_of(picture, alpha)
    _check_varied(picture, view, alpha)
    found = _asked(picture, view, options) if asked_otherwise else _best(picture, view, alpha)
    mask = found.mask if alpha is None else found.mask & alpha.opaque
    if not mask.any() or (alpha is None and mask.all()):
        which = "everywhere" if mask.any() else "nowhere"
        raise SilhouetteError(
            f"{picture.label}: {found.notes[0]}, which is {which} in it; {ADVICE}: change that option"
        )
    return mask, list(found.notes)


def _given_mask(picture: Picture, options: ObjectOptions) -> tuple[BoolArray, list[str]]:
    assert picture.opacity is not None
    mask: BoolArray = picture.opacity >= 0.5
    if options.object != "auto" or options.background or options.threshold or options.alpha_threshold:
        raise SilhouetteError(f"{picture.label} says itself what is object; leave out the options that look for it")
    if mask.all() or not mask.any():
        raise _no_object(picture, f"is {bool(mask[0, 0])} everywhere")
    return mask, []


def _no_object(picture: Picture, finding: str) -> SilhouetteError:
    return SilhouetteError(f"{picture.label} {finding}: there is no object; {ADVICE}: give another image")


def _view_of(picture: Picture, alpha: Alpha | None) -> View:
    """The picture's levels; clear pixels look like the opaque ones around them, for nobody sees their own colour."""
    grey, colour = picture.grey, picture.colour
    assert grey is not None
    if alpha is not None and alpha.opaque.any() and not alpha.opaque.all():
        rim = _rim(alpha.opaque)
        grey = np.where(alpha.opaque, grey, np.median(grey[rim])).astype(np.float32)
        if colour is not None:
            paint = np.median(colour[rim], axis=0).astype(np.uint8)
            colour = np.where(alpha.opaque[..., None], colour, paint)
    return view_of(grey, colour)


def _rim(opaque: BoolArray) -> BoolArray:
    """The opaque pixels beside clear ones and along the picture's border."""
    return opaque & ~shrunk(opaque)


def _check_varied(picture: Picture, view: View, alpha: Alpha | None) -> None:
    """Raise SilhouetteError for a picture of one colour and for one in which every pixel differs from the next."""
    first = view.features[0, 0]
    if (view.features[::16, ::16] == first).all() and (view.features == first).all():
        assert picture.grey is not None
        low = float(picture.grey[0, 0] if alpha is None else picture.grey[alpha.opaque].min(initial=1.0))
        shade = {0.0: "black", 1.0: "white"}.get(low, f"at grey level {low:g}")
        where = "everywhere" if alpha is None else "wherever it is opaque"
        raise _no_object(picture, f"is {shade if view.is_grey else hex_of(view.features[0, 0])} {where}")
    if _is_noise(view):
        tried = "alpha, colour and lightness were tried"
        raise SilhouetteError(
            f"{picture.label} is noise, every pixel differs from the next; {tried}: give another image"
        )


def _is_noise(view: View) -> bool:
    """Whether neighbours are as unlike as any two pixels: the mean square of their difference is twice the variance."""
    if min(view.levels.shape) < NOISE_SIDE:
        return False
    sample = view.features[:512, :512, 0]
    if len(np.unique(view.levels[:512:4, :512:4])) <= NOISE_LEVELS:
        return False
    variance = float(sample.var())
    unlike = [float(np.square(np.diff(sample, axis=axis)).mean()) / max(2 * variance, 1e-12) for axis in (0, 1)]
    return all(NOISE_BAND[0] < ratio < NOISE_BAND[1] for ratio in unlike)


def _asked(picture: Picture, view: View, options: ObjectOptions) -> Opinion:
    """The object that the options describe."""
    if options.background is not None or options.object_colour is not None:
        return by_colour.asked(picture.label, view, options)
    frame = find_frame(view.features) if options.object == "auto" else NO_FRAME
    found = by_lightness.split(view.within(frame), options.object, options.threshold)
    return _reframed(found, view.levels.shape, frame)


def _best(picture: Picture, view: View, alpha: Alpha | None) -> Opinion:
    """The best supported opinion; alpha's own, of a picture that is all but opaque, where nothing else is clear."""
    frame = find_frame(view.features)
    chosen = _chosen(view.within(frame))
    if chosen is None and frame != NO_FRAME:  # there is nothing inside: it is no frame, it is the background
        frame, chosen = NO_FRAME, _chosen(view)
    if alpha is not None and alpha.opaque.any() and not alpha.opaque.all() and (chosen is None or chosen.support < 0.9):
        return Opinion(alpha.opaque, alpha.notes, 1.0)
    if chosen is None:
        raise _no_object(picture, "has no colour and no grey level that stands out")
    return _reframed(righted(chosen, view.within(frame).features), view.levels.shape, frame)


def _chosen(view: View) -> Opinion | None:
    """Colour or lightness; None if neither sees anything."""
    colour = by_colour.opinion(view)
    lightness = by_lightness.split(view) if np.ptp(view.levels) > 0 else None
    if lightness is None:
        return None if colour is None else colour.with_remarks()
    if colour is None:
        return lightness.saying("colour finds none that stands out from the border: --background COLOUR says from what")
    agreed = are_alike(colour.mask, lightness.mask, AGREED)
    if agreed and not lightness.is_clear and (colour.is_clear or colour.support >= TRUSTED):
        return colour.with_remarks()
    if agreed:
        notes = (*lightness.notes, *colour.doubts)
        return Opinion(lightness.mask, notes, max(colour.support, lightness.support))
    unseen = colour.is_even and np.count_nonzero(lightness.mask) < UNSEEN * np.count_nonzero(colour.mask)
    if colour.is_clear or unseen or colour.support >= (lightness.support if lightness.is_clear else TRUSTED):
        other = "light" if "lighter" in lightness.notes[1] else "dark"
        share = f"{_share(lightness.mask, colour.mask)} of this: --object {other}"
        return colour.with_remarks().saying(f"lightness alone would find another object, {share}")
    share = f"{_share(colour.mask, lightness.mask)} of this: --background '{colour.colour}'"
    return lightness.saying(f"colour alone would find another object, {share}")


def _share(mask: BoolArray, of: BoolArray) -> str:
    return f"{mask.sum() / max(1, of.sum()):.0%}"


def _reframed(found: Opinion, shape: tuple[int, ...], frame: Frame) -> Opinion:
    """The opinion on the whole picture, of whose frame nothing is object."""
    if frame == NO_FRAME:
        return found
    top, bottom, left, right = frame
    mask = np.pad(found.mask, ((top, bottom), (left, right)))
    said = f"a dark frame, at most {max(frame)} pixels wide, is no part of the object: --object dark takes it in"
    return Opinion(mask, (*found.notes, said), found.support)


def _inner_notes(picture: Picture, alpha: Alpha) -> list[str]:
    """A word on what is drawn inside an opaque tile: it may be what was meant."""
    assert picture.grey is not None
    top, bottom, left, right = _extent(alpha.opaque)
    if alpha.opaque[top:bottom, left:right].mean() < TILE:
        return []
    frame = (top, len(alpha.opaque) - bottom, left, alpha.opaque.shape[1] - right)
    view = _view_of(picture, alpha).within(frame)
    inner = by_colour.opinion(view)
    if inner is None or inner.support < 0.9 or border(inner.mask).mean() > 0.02:
        return []
    is_darker = np.median(view.levels[inner.mask]) < np.median(view.levels[~inner.mask])
    side, shape = ("dark", "a darker") if is_darker else ("light", "a lighter")
    return [f"there is {shape} shape inside: --object {side} takes that"]


def _extent(mask: BoolArray) -> Frame:
    """The rows and columns that a mask extends over: top, bottom, left, right, the ends not in it."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return int(rows[0]), int(rows[-1]) + 1, int(columns[0]), int(columns[-1]) + 1
