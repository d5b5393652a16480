"""The silhouette of a 3-D model from the front, the side or the top, whatever its surface is like.

Models from the wild have faces twice, faces inside, flipped, degenerate and non-manifold ones: the silhouette is the
union of all of them, each projected on its own.
"""

from dataclasses import dataclass

import numpy as np

from autopoly_env.arguments import one_of
from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.errors import ConfigError, SilhouetteError
from autopoly_env.silhouette import Silhouette, load_silhouette
from autopoly_env.targets.projection_kernels import paint_polygons

# The rows of a matrix are the picture's x (right) and y (down), for models that have +y up and face -z, as ShapeNet's.
VIEWS = {
    "front": np.array([[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]),  # seen along +z
    "side": np.array([[0.0, 0.0, -1.0], [0.0, -1.0, 0.0]]),  # seen along -x: the front is on the right
    "top": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),  # seen along -y: the front is at the top
}
SIDE = 0.86  # longer side of the silhouette's bounding box, unit square
OVERSAMPLING = 4  # samples a pixel, each way
MAX_RESOLUTION = 2048


@dataclass(frozen=True)
class Surface:
    """The polygons of a model; polygon f has the corners from number ends[f] up to ends[f + 1]."""

    vertices: FloatArray  # (V, 3)
    corners: IntArray  # (C,) which vertex each is
    ends: IntArray  # (F + 1,)


def silhouette_of(surface: Surface, view: str = "side", resolution: int = 256, name: str = "model") -> Silhouette:
    """The model seen from far away: (R, R) pixels, R = `resolution`, its box centred with a margin around it.

    A pixel is object where at least half of its 4 x 4 samples are. Specks are cleaned away as from a loaded picture.
    Raises ConfigError for another view or a resolution outside 16..2048, SilhouetteError for a model of which nothing
    shows.
    """
    check_view(view, resolution)
    used = surface.vertices[surface.corners]
    points = used @ VIEWS[view].T
    if not len(points):
        raise SilhouetteError(f"{name} has no polygons; give a model with a surface")
    low, high = points.min(axis=0), points.max(axis=0)
    extent = float((high - low).max())
    n_samples = OVERSAMPLING * resolution
    if not 0.0 < extent < np.inf:
        raise SilhouetteError(f"{name} is a point seen from the {view}; give another view")
    placed = n_samples * (0.5 + SIDE * ((points - low) - 0.5 * (high - low)) / extent)
    samples = np.zeros((n_samples, n_samples), np.bool_)
    paint_polygons(np.ascontiguousarray(placed), surface.ends, samples)
    n_set = samples.reshape(resolution, OVERSAMPLING, resolution, OVERSAMPLING).sum(axis=(1, 3))
    mask = n_set >= OVERSAMPLING**2 / 2
    if not mask.any():
        raise SilhouetteError(f"{name} shows in no pixel from the {view}: it is thinner; give another view")
    return load_silhouette(mask, name=name)


def check_view(view: str, resolution: int) -> None:
    """Raise ConfigError for a view that is unknown or a resolution outside 16..2048."""
    one_of("view", view, tuple(VIEWS))
    if not 16 <= resolution <= MAX_RESOLUTION:
        raise ConfigError(f"resolution {resolution}: expected 16 to {MAX_RESOLUTION} pixels a side")
