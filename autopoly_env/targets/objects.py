"""Silhouettes of man-made things, each drawn anew from its seed: no two mugs are alike."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import affinity

from autopoly_env.arrays import BoolArray, FloatArray
from autopoly_env.errors import ConfigError
from autopoly_env.raster import Batch, coverage_of_batch
from autopoly_env.silhouette import Silhouette
from autopoly_env.targets.dice import Dice
from autopoly_env.targets.families import FAMILIES, FAMILIES_V0, Family
from autopoly_env.targets.pencil import Shape

SALT = 2
TILT = 6.0  # degrees from upright at most
SIDE = (0.78, 0.9)  # longer side of the bounding box, unit square
THIN = 3.0 / 256.0  # unit square; what is thinner goes, and gaps that are narrower close
SPECK = 36.0 / 256.0**2  # area in the unit square; smaller parts go and smaller holes close


@dataclass(frozen=True)
class ObjectTargets:
    """Drawings of things; the seed also says of which family. A name is "family_seed".

    `families`: names of FAMILIES, in a list or with commas between, by default those of version 0. Whoever names some
    draws among them in that order. `resolution` R: pixels a side, 64 to 2048; no part and no gap is narrower than 3
    pixels at 256.

    Raises ConfigError for settings out of range.
    """

    families: str | Sequence[str] | None = None
    resolution: int = 256
    name = "objects"

    def __post_init__(self) -> None:
        unknown = [name for name in self._names() if name not in FAMILIES]
        if unknown or not self._names():
            what = f"family {unknown[0]!r} is unknown" if unknown else "no family was given"
            raise ConfigError(f"{what}; give some of {', '.join(FAMILIES)}")
        if not 64 <= self.resolution <= 2048:
            raise ConfigError(f"resolution {self.resolution}: expected 64 to 2048 pixels a side")

    def _names(self) -> list[str]:
        if self.families is None:
            return list(FAMILIES_V0)
        return self.families.split(",") if isinstance(self.families, str) else list(self.families)

    def sample(self, seed: int) -> Silhouette:
        """The thing of this seed. Raises ConfigError for a seed outside 0..2**32 - 1."""
        dice = Dice(SALT, seed)
        family = dice.pick(self._names())
        shape = _posed(dice, FAMILIES[family])
        return Silhouette(_pixels(shape, self.resolution), f"{family}_{seed}")


def _posed(dice: Dice, family: Family) -> Shape:
    """A thing of the family, mirrored or not, turned, scaled and centred in the unit square."""
    shape = family.draw(dice)
    if dice.chance(0.5):
        shape = affinity.scale(shape, -1.0, 1.0)
    angle = dice.pick((0.0, dice.between(-TILT, TILT)))
    if family.any_angle:
        angle += dice.pick((0.0, 90.0, 45.0, -45.0, 135.0, dice.between(0.0, 360.0)))
    shape = affinity.rotate(shape, angle)
    x0, y0, x1, y1 = shape.bounds
    scale = dice.between(*SIDE) / max(x1 - x0, y1 - y0)
    placed = affinity.affine_transform(
        shape, [scale, 0.0, 0.0, scale, 0.5 - 0.5 * scale * (x0 + x1), 0.5 - 0.5 * scale * (y0 + y1)]
    )
    return _tidied(placed)


def _tidied(shape: Shape) -> Shape:
    """The shape without gaps and parts narrower than THIN; other corners stay sharp."""
    for distance in (0.5 * THIN, -THIN, 0.5 * THIN):
        shape = shape.buffer(distance, join_style="mitre", mitre_limit=1.5)
    return shape


def _pixels(shape: Shape, resolution: int) -> BoolArray:
    """(R, R) where the shape covers at least half of a pixel."""
    rings = [shapely.get_coordinates(ring)[:-1] for ring in _rings(shape)]
    n = np.array([len(ring) for ring in rings])
    first = np.repeat(np.cumsum(n) - n, n)
    own = np.arange(n.sum())
    following = np.where(own + 1 < first + np.repeat(n, n), own + 1, first)
    points: FloatArray = np.concatenate(rings)
    ends = np.array([0, len(points)])
    batch = Batch(points, np.column_stack((own, following)), ends, ends)
    return coverage_of_batch(batch, resolution)[0] >= 0.5


def _rings(shape: Shape) -> list[shapely.LinearRing]:
    """The outlines, outer ones wound positively and holes negatively; none of less than SPECK."""
    parts = [part for part in shapely.get_parts(shapely.orient_polygons(shape)) if part.area > SPECK]
    holes = [hole for part in parts for hole in part.interiors if shapely.Polygon(hole).area > SPECK]
    return [part.exterior for part in parts] + holes
