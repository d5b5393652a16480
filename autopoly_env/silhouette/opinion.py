"""What is looked at, and what one way of looking says about it."""

from dataclasses import dataclass, replace

import numpy as np

from autopoly_env.arrays import BoolArray, ByteArray, Float32Array
from autopoly_env.silhouette.background import Frame, without
from autopoly_env.silhouette.colours import oklab, oklab_lightness


@dataclass(frozen=True, eq=False)
class View:
    """A picture (H, W), or a part of it.

    `levels` (H, W) are its greys as whole levels from `black` to `white` (0..1), `features` (H, W, C) its colours where
    distances are taken: in Oklab, of which a grey picture has L alone.
    """

    levels: ByteArray
    features: Float32Array
    black: float = 0.0
    white: float = 1.0

    @property
    def is_grey(self) -> bool:
        """Whether there is no colour in it."""
        return self.features.shape[2] == 1

    def within(self, frame: Frame) -> "View":
        """The part of it inside a frame."""
        return replace(self, levels=without(self.levels, frame), features=without(self.features, frame))


def view_of(grey: Float32Array, colour: ByteArray | None) -> View:
    """A picture as it is looked at; greys (H, W) in 0..1 between those of 8 bits get levels of their own."""
    scaled = grey * np.float32(255)
    levels = np.rint(scaled).astype(np.uint8)
    sample = (slice(None, None, 3), slice(None, None, 5))
    low, high = 0.0, 1.0
    if float(np.abs(scaled[sample] - levels[sample]).max()) > 0.01:
        low, high = float(grey.min()), float(grey.max())
        levels = np.rint((grey - np.float32(low)) * np.float32(255 / max(high - low, 1e-12))).astype(np.uint8)
    is_8_bit = (low, high) == (0.0, 1.0)
    features = oklab(colour) if colour is not None else oklab_lightness(levels if is_8_bit else grey)[..., None]
    return View(levels, features, low, high)


@dataclass(frozen=True, eq=False)
class Opinion:
    """A mask (H, W) of the object, how it came about, and how well the picture supports it, 0 to 1.

    `remarks` are what is said beside `notes` where this opinion is taken, `doubts` also where another one agrees with
    it; `colour` is the background's;
    `is_clear` says that the background is flat, or that a picture has but two levels of grey; `is_even` that the
    background is flat but for noise.
    """

    mask: BoolArray
    notes: tuple[str, ...]
    support: float
    remarks: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    colour: str = ""
    is_clear: bool = False
    is_even: bool = False

    def saying(self, *words: str) -> "Opinion":
        """The same with more notes."""
        return replace(self, notes=(*self.notes, *words))

    def with_remarks(self) -> "Opinion":
        """The same with all that is to be said where it is taken."""
        return self.saying(*self.doubts, *self.remarks)


def are_alike(one: BoolArray, other: BoolArray, most: float) -> bool:
    """Whether masks differ by at most a share of the larger object, but for the pixel along a common outline."""
    differs = one ^ other
    allowed = most * max(int(np.count_nonzero(one)), int(np.count_nonzero(other)))
    if np.count_nonzero(differs) <= allowed:
        return True
    along = _beside(one & other) & _beside(~(one | other))
    return bool(np.count_nonzero(differs & ~along) <= allowed)


def _beside(mask: BoolArray) -> BoolArray:
    """Pixels of the mask and their eight neighbours."""
    wide = mask.copy()
    wide[1:] |= mask[:-1]
    wide[:-1] |= mask[1:]
    tall = wide.copy()
    wide[:, 1:] |= tall[:, :-1]
    wide[:, :-1] |= tall[:, 1:]
    return np.ascontiguousarray(wide)
