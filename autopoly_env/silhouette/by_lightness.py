"""The opinion of lightness: the object is one side of a grey level, Otsu's threshold or one that was given."""

import numpy as np
from PIL import Image

from autopoly_env.arrays import BoolArray, ByteArray, IntArray
from autopoly_env.silhouette.background import border
from autopoly_env.silhouette.opinion import Opinion, View

# A level is unclear when it is further than FAR of the distance between the class means from both of them; a
# picture with more than MAX_UNCLEAR of such pixels is called a photo. Measured: antialiased icons from 16 px
# <= 8 %, outlines blurred by 1 % of the side <= 3 %, JPEG at quality 5 <= 1 %; three photos in four > 13 %.
FAR, MAX_UNCLEAR = 0.25, 0.10
CLEAR = 0.01  # a picture with no more unclear pixels has two levels


def split(view: View, side: str = "auto", threshold: float | None = None) -> Opinion:
    """The side of a grey level that the border is not on, or the one that was asked for.

    `side` is "dark", "light" or "auto"; without `threshold` (0..1) the level is Otsu's. Where as much of the border is
    on either side, the lighter one is the background.
    """
    counts = np.array(Image.fromarray(view.levels).histogram())
    if threshold is None:
        last_dark = otsu(counts)
        notes = [f"threshold {_middle_of_gap(view, counts, last_dark):.2f} (Otsu)"]
    else:
        last_dark = int(np.floor(255 * (threshold - view.black) / (view.white - view.black)))
        notes = [f"threshold {threshold:.2f}"]
    light: BoolArray = view.levels > last_dark
    majority = float(border(light).mean())
    background_is_light = majority >= 0.5 if side == "auto" else side == "dark"
    notes.append(f"object is {'darker' if background_is_light else 'lighter'} than the background")
    unclear = unclear_share(view.levels, counts, last_dark)
    if unclear > MAX_UNCLEAR:
        words = f"more than two clear levels ({unclear:.0%} of the pixels fit neither)"
        notes.append(f"warning: {words}: is it a photo?")
    support = max(majority, 1.0 - majority) * max(0.0, 1.0 - 2.0 * unclear)
    is_clear = unclear <= CLEAR
    return Opinion(light != background_is_light, tuple(notes), support, is_clear=is_clear)


def otsu(counts: IntArray) -> int:
    """The last level of the darker class of a histogram (256,): the classes differ most, between them and not within.

    N. Otsu, "A threshold selection method from gray-level histograms", 1979; the first of several levels as good.
    """
    n_dark = np.cumsum(counts)[:-1].astype(np.float64)
    sums = np.cumsum(counts * np.arange(256)).astype(np.float64)
    n_light, light_sums = counts.sum() - n_dark, sums[-1] - sums[:-1]
    difference = sums[:-1] / np.maximum(n_dark, 1) - light_sums / np.maximum(n_light, 1)
    return int(np.argmax(n_dark * n_light * difference**2))


def _middle_of_gap(view: View, counts: IntArray, last_dark: int) -> float:
    """The same split, written as the middle between the lightest dark level and the darkest light one, in 0..1."""
    used = np.flatnonzero(counts)
    middle = 0.5 * float(used[used <= last_dark].max(initial=0) + used[used > last_dark].min(initial=255)) / 255
    return view.black + middle * (view.white - view.black)


def unclear_share(levels: ByteArray, counts: IntArray, last_dark: int) -> float:
    """The share of pixels whose level is far from the means of both classes; 0 where there are not two.

    Pixels beside one of the other class do not count: an antialiased outline makes them, and in small icons
    they are many.
    """
    dark, light = counts[: last_dark + 1], counts[last_dark + 1 :]
    if last_dark < 0 or not (dark.any() and light.any()):
        return 0.0
    dark_mean = np.average(np.arange(last_dark + 1), weights=dark)
    light_mean = np.average(np.arange(last_dark + 1, 256), weights=light)
    distance = np.minimum(np.abs(np.arange(256) - dark_mean), np.abs(np.arange(256) - light_mean))
    is_unclear = distance > FAR * (light_mean - dark_mean)
    if counts[is_unclear].sum() <= 0.1 * CLEAR * levels.size:
        return 0.0
    unclear, is_light = is_unclear[levels], levels > last_dark
    across, down = is_light[:, 1:] != is_light[:, :-1], is_light[1:] != is_light[:-1]
    for one_side, other_side, change in (
        (unclear[:, 1:], unclear[:, :-1], across),
        (unclear[1:], unclear[:-1], down),
    ):
        one_side &= ~change
        other_side &= ~change
    return float(np.count_nonzero(unclear) / unclear.size)
