"""What differs from the background: how much is enough, and where a soft edge is cut."""

from dataclasses import dataclass

import numpy as np

from autopoly_env.arrays import BoolArray, Float32Array, IntArray
from autopoly_env.silhouette.background import Background, border
from autopoly_env.silhouette.connectivity import areas

LEAST = 0.012  # no smaller difference is told from none
USUAL = 0.07  # from here on something is there, if nothing speaks against it
FAINT = 0.03  # what lossy compression leaves beside edges is less, mostly
EXACT = 0.004  # a flat background with no more noise is a drawing's: whatever differs from it at all is there
DUST = 3  # more parts at the lowest cut than at the usual one: it is no drawing, but a JPEG of one
GRAINS = 80  # more parts beside the object at a faint cut: they are the picture's grain, and none is pale
PALE = 0.35  # of the strongest difference: a paler object has a lower cut
STUDIED = 256  # pixels a side, about: the cut is chosen on so many
STEP = 1.35  # between cuts that are tried
HIGHEST = 0.65  # of the strongest difference: no higher cut is tried
SOFT = 0.35  # pixels (of 256 a side) that an outline may give way when the cut is lowered by a quarter
SHARP = 0.45  # the same in pixels of its own, of a picture so small that these are larger
PEELED = 2  # pixels of a soft edge that are taken off at most
HALF = 0.5  # covered: a pixel of the edge is object from here on
SPRITE = 200  # pixels a side: the edges of smaller pictures are one pixel wide, and so are the things in them
ASTRAY, ASTRAY_SHARE = 0.03, 0.1  # so far, and by so much of itself, a mixture may be from the line between two colours


@dataclass(frozen=True)
class Cut:
    """Where the differences are cut: `level`, how soft the outline is there (pixels of 256 a side), if not too soft."""

    level: float
    softness: float
    is_sharp: bool


def choose_cut(distances: Float32Array, background: Background) -> Cut | None:
    """The lowest level above the noise at which the outline is sharp: a soft shadow around an object is not in it.

    None where nothing differs from the background.
    """
    step = max(1, max(distances.shape) // STUDIED)
    small = distances[::step, ::step]
    noise = max(LEAST, 1.3 * background.noise)
    beyond = small[small > noise]
    if not len(beyond):
        beyond = distances[distances > noise]
        small = distances
    if not len(beyond):
        return None
    strongest = float(np.quantile(beyond, 0.9))
    level = max(noise, min(USUAL, PALE * strongest))
    if background.is_flat:
        level = _lowest(small, noise if background.noise <= EXACT else max(noise, FAINT), level)
    best: Cut | None = None
    while best is None or level <= HIGHEST * strongest:
        softness, limit = _softness(small, level)
        cut = Cut(level, softness, softness <= limit)
        if cut.is_sharp:
            return cut
        if best is None or softness < best.softness:
            best = cut
        level *= STEP
    return best


def _lowest(distances: Float32Array, faint: float, usual: float) -> float:
    """The lowest cut from a faint one to the usual one, at which there is no dust and the outline is sharp."""
    while faint < usual:
        softness, limit = _softness(distances, faint)
        if softness <= limit and not _is_dusty(distances, faint, usual):
            return faint
        faint *= STEP
    return usual


def _is_dusty(distances: Float32Array, noise: float, level: float) -> bool:
    """Whether parts of their own lie between the noise and the usual cut: what lossy compression leaves at edges."""
    faint, usual = (areas(distances > cut, with_corners=True)[1] for cut in (noise, level))
    return faint - usual > DUST


def beyond_cut(features: Float32Array, distances: Float32Array, background: Background, level: float) -> BoolArray:
    """The mask (H, W) of what lies beyond the cut, its antialiased edge cut where it is half covered.

    A pixel of the edge shows less than half of the object where one beside it is more than twice as different. In a
    sprite, in which things are a few pixels wide, it has to be a mixture of that one and the background, too.
    """
    mask: BoolArray = distances > level
    height, width = mask.shape
    is_sprite = max(mask.shape) < SPRITE
    reach = 1 if is_sprite else 2
    for _ in range(PEELED):
        rows, columns = np.divmod(np.flatnonzero(_outermost(mask)), width)  # much quicker than np.nonzero
        beside = [
            (np.clip(rows + down, 0, height - 1), np.clip(columns + right, 0, width - 1))
            for down in range(-reach, reach + 1)
            for right in range(-reach, reach + 1)
        ]
        own = distances[rows, columns]
        soft = own < HALF * np.max([distances[place] for place in beside], axis=0, initial=0.0)
        if is_sprite:
            beside = [(down[soft], right[soft]) for down, right in beside]
            soft[soft] = _are_mixtures(features, distances, background, (rows[soft], columns[soft]), beside)
        if not soft.any():
            break
        mask[rows[soft], columns[soft]] = False
    return mask


Places = tuple[IntArray, IntArray]  # rows and columns of N pixels


def _are_mixtures(
    features: Float32Array, distances: Float32Array, background: Background, places: Places, beside: list[Places]
) -> BoolArray:
    """Which pixels (N,) are less than half as different as one beside them, in the same direction."""
    own, apart = distances[places], background.differences(features, *places)
    found = np.zeros(len(own), dtype=bool)
    for place in beside:
        strong = distances[place]
        direction = background.differences(features, *place) / np.maximum(strong, LEAST)[:, None]
        along = np.einsum("nc,nc->n", apart, direction)
        astray = np.sqrt(np.maximum(own**2 - along**2, 0.0))
        found |= (own < HALF * strong) & (along > 0) & (astray < ASTRAY + ASTRAY_SHARE * own)
    return found


def paler_share(mask: BoolArray, distances: Float32Array, level: float) -> float:
    """How much larger a mask (H, W) and its holes are with all that lies beyond a lower cut: pale parts, or traces."""
    size = int(np.count_nonzero(filled(mask)))
    return int(np.count_nonzero(filled(mask | (distances > level)))) / max(1, size) - 1.0


def is_grainy(mask: BoolArray, distances: Float32Array) -> bool:
    """Whether a cut at FAINT finds grain all over a picture (H, W), apart from the mask."""
    return areas((distances > FAINT) & ~mask, with_corners=True)[1] > GRAINS


def _outermost(mask: BoolArray) -> BoolArray:
    """Pixels of the mask that have one beside them that is not in it; beyond the picture everything is."""
    inside = mask.copy()
    inside[1:] &= mask[:-1]
    inside[:-1] &= mask[1:]
    inside[:, 1:] &= mask[:, :-1]
    inside[:, :-1] &= mask[:, 1:]
    return mask & ~inside


def filled(mask: BoolArray) -> BoolArray:
    """The mask (H, W) and its holes."""
    labels, count = areas(~mask)
    outside = np.zeros(count + 1, dtype=bool)
    outside[border(labels)] = True
    outside[0] = False
    return ~outside[labels]


def _softness(distances: Float32Array, level: float) -> tuple[float, float]:
    """How many pixels (of 256 a side) an outline gives way, on average, if the cut is a quarter lower; the limit."""
    outline, wider = filled(distances > level), filled(distances > 0.75 * level)
    length = int(_outermost(outline).sum())
    if not length:
        return (0.0 if outline.all() else np.inf), SOFT
    scale = STUDIED / max(distances.shape)
    return (int(wider.sum()) - int(outline.sum())) / length * scale, max(SOFT, SHARP * scale)
