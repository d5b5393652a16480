"""Silhouettes to build: shapes known in shapely, painted without the project's rasteriser, and shapeless noise."""

import numpy as np
import shapely
from skimage.filters import gaussian

from autopoly_env.silhouette import Silhouette

SQUARE = shapely.box(0.25, 0.25, 0.75, 0.75)
HOUSE = shapely.Polygon([(0.25, 0.5), (0.5, 0.2), (0.75, 0.5), (0.75, 0.85), (0.25, 0.85)])
BOTTLE = shapely.Polygon([(0.25, 0.875), (0.25, 0.5), (0.4, 0.125), (0.6, 0.125), (0.75, 0.5), (0.75, 0.875)])
L_SHAPE = shapely.box(0.25, 0.25, 0.5, 0.75) | shapely.box(0.5, 0.5, 0.75, 0.75)
FRAME = shapely.box(0.125, 0.125, 0.875, 0.875) - shapely.box(0.375, 0.375, 0.625, 0.625)
ISLAND = FRAME | shapely.box(0.4375, 0.4375, 0.5625, 0.5625)  # a square inside the frame's hole
TWO_SQUARES = shapely.box(0.125, 0.375, 0.375, 0.625) | shapely.box(0.625, 0.375, 0.875, 0.625)


def painted(shape: shapely.Geometry, resolution: int = 64) -> Silhouette:
    """The pixels whose centre lies in a shape (unit square)."""
    centres = (np.arange(resolution) + 0.5) / resolution
    return Silhouette(shapely.contains_xy(shape, *np.meshgrid(centres, centres)))


def noise(seed: int, resolution: int = 48) -> Silhouette:
    """Blurred noise cut off somewhere: blobs with holes and islands, fine or coarse, a few or many; one at least."""
    rng = np.random.default_rng(seed)
    field = gaussian(rng.random((resolution, resolution)), rng.choice((0.5, 1.0, 2.0, 4.0)), mode="wrap")
    return Silhouette(field >= np.quantile(field, rng.choice((0.2, 0.5, 0.8, 0.95))))
