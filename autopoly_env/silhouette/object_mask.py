"""Which pixels of a picture are the object: alpha or Otsu with a border vote, then cleaning and squaring."""

import numpy as np

from autopoly_env.arrays import AnyArray, BoolArray, Float32Array, IntArray
from autopoly_env.errors import SilhouetteError
from autopoly_env.silhouette.loading import Picture

OPAQUE = 0.5  # alpha from here on (128 of 255) is the object
# A level is unclear when it is further than FAR of the distance between the class means from both of them; a
# picture with more than MAX_UNCLEAR of such pixels is called a photo. Measured: antialiased icons from 16 px
# <= 8 %, outlines blurred by 1 % of the side <= 3 %, JPEG at quality 5 <= 1 %; three photos in four > 13 %.
FAR, MAX_UNCLEAR = 0.25, 0.10
MIN_COMPONENT_PIXELS, MIN_COMPONENT_SHARE = 4, 2e-5  # smaller components are specks, smaller holes pinholes


def find_object(picture: Picture) -> tuple[BoolArray, list[str]]:
    """The (H, W) mask of the object, and notes on how it was told from the background.

    Alpha decides where it really varies: the object is what is opaque. Otherwise Otsu's threshold splits the
    grey levels, and the class that most border pixels belong to is the background (a tie: the lighter one).

    Raises SilhouetteError when the picture has one level only.
    """
    grey, opacity = picture.grey, picture.opacity
    if opacity is not None:
        opaque = opacity >= OPAQUE
        if opaque.any() and not opaque.all():
            return opaque, [] if grey is None else ["object is what alpha shows as opaque (128 or more)"]
        if grey is None:
            raise _no_object(picture, f"is {bool(opaque[0, 0])} everywhere")
        if not opaque.any():
            raise _no_object(picture, "is transparent everywhere")
    assert grey is not None
    low, high = float(grey.min()), float(grey.max())
    if low == high:
        shade = {0.0: "black", 1.0: "white"}.get(low, f"at grey level {low:g}")
        raise _no_object(picture, f"is {shade} everywhere")
    return _split_by_grey(grey)


def _no_object(picture: Picture, finding: str) -> SilhouetteError:
    advice = "expected an object that differs from its background"
    return SilhouetteError(f"{picture.label} {finding}: there is no object; {advice}: give another image")


def _split_by_grey(grey: Float32Array) -> tuple[BoolArray, list[str]]:
    from skimage.filters import threshold_otsu  # here, because scikit-image is slow to import

    threshold = float(threshold_otsu(grey))
    light = grey > threshold
    background_is_light = bool(_border(light).mean() >= 0.5)
    # the same split, written as the middle of the gap between the two classes
    threshold = 0.5 * (float(grey[~light].max()) + float(grey[light].min()))
    notes = [
        f"threshold {threshold:.2f} (Otsu)",
        f"object is {'darker' if background_is_light else 'lighter'} than the background",
    ]
    unclear = _unclear_share(grey, light)
    if unclear > MAX_UNCLEAR:
        notes.append(f"warning: more than two clear levels ({unclear:.0%} of the pixels fit neither): is it a photo?")
    return light != background_is_light, notes


def _unclear_share(grey: Float32Array, light: BoolArray) -> float:
    """The share of pixels whose level is far from the means of both classes.

    Pixels beside one of the other class do not count: an antialiased outline makes them, and in small icons
    they are many.
    """
    dark_mean, light_mean = float(grey[~light].mean()), float(grey[light].mean())
    distance = np.minimum(np.abs(grey - dark_mean), np.abs(grey - light_mean))
    unclear = distance > FAR * (light_mean - dark_mean)
    across, down = light[:, 1:] != light[:, :-1], light[1:] != light[:-1]
    for one_side, other_side, change in (
        (unclear[:, 1:], unclear[:, :-1], across),
        (unclear[1:], unclear[:-1], down),
    ):
        one_side[change] = other_side[change] = False
    return float(unclear.mean())


def clean(mask: BoolArray, min_component: int | None) -> tuple[BoolArray, list[str]]:
    """Drop specks and fill pinholes of fewer than `min_component` pixels, unless nothing else would be left.

    The default is max(4, 2e-5 of the image's area). Object pixels are joined over corners too (8 neighbours),
    those of the background over sides (4).
    """
    if min_component is None:
        min_component = max(MIN_COMPONENT_PIXELS, round(MIN_COMPONENT_SHARE * mask.size))
    notes = []
    specks, n_specks = _smaller_than(min_component, _parts(mask))
    if n_specks and (specks != mask).any():
        mask = mask & ~specks
        notes.append(f"{_counted(n_specks, 'speck')} of less than {min_component} pixels dropped")
    pinholes, n_pinholes = _smaller_than(min_component, _holes(mask))
    if n_pinholes and (pinholes == mask).any():
        mask = mask | pinholes
        notes.append(f"{_counted(n_pinholes, 'pinhole')} of less than {min_component} pixels filled")
    return mask, notes


def describe(mask: BoolArray) -> list[str]:
    """Notes on what a user may not expect of a mask: several parts, holes, the image's border touched."""
    n_parts, n_holes = int(_parts(mask).max()), int(_holes(mask).max())
    notes = []
    if n_parts > 1:
        notes.append(f"object has {n_parts} separate parts")
    if n_holes:
        notes.append(f"object has {_counted(n_holes, 'hole')}")
    if _border(mask).any():
        notes.append("object touches the border of the image")
    return notes


def square(mask: BoolArray) -> tuple[BoolArray, list[str]]:
    """The mask in the middle of a square of background, as large as its longer side."""
    height, width = mask.shape
    side = max(height, width)
    if height == width:
        return mask, []
    above, left = (side - height) // 2, (side - width) // 2
    padded = np.pad(mask, ((above, side - height - above), (left, side - width - left)))
    return padded, [f"padded from {width}x{height} to {side}x{side}"]


def _parts(mask: BoolArray) -> IntArray:
    """Component labels (H, W) of the object, 1.., 0 elsewhere; 8 neighbours."""
    from skimage.measure import label

    labels: IntArray = label(mask, connectivity=2)
    return labels


def _holes(mask: BoolArray) -> IntArray:
    """Labels (H, W) of background that does not reach the border, 1.., 0 elsewhere; 4 neighbours."""
    from skimage.measure import label

    labels: IntArray = label(~mask, connectivity=1)
    enclosed = np.ones(labels.max() + 1, dtype=bool)
    enclosed[0] = False
    enclosed[_border(labels)] = False
    numbers: IntArray = np.cumsum(enclosed) * enclosed
    return numbers[labels]


def _border(array: AnyArray) -> AnyArray:
    return np.concatenate([array[0], array[-1], array[1:-1, 0], array[1:-1, -1]])


def _smaller_than(n_pixels: int, labels: IntArray) -> tuple[BoolArray, int]:
    """Where the labelled parts with fewer than `n_pixels` pixels are, and how many of them there are."""
    small = np.bincount(labels.ravel()) < n_pixels
    small[0] = False
    return small[labels], int(small.sum())


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
