"""The polygons and the silhouette that the benchmarks measure on."""

from functools import cache

import numpy as np
from skimage.data import horse

from autopoly_env.arrays import FloatArray
from autopoly_env.mesh import PolyMesh
from autopoly_env.raster import coverage
from autopoly_env.silhouette import ObjectOptions, Silhouette, Target, load_silhouette


def regular(n: int, radius: float = 0.35, centre: tuple[float, float] = (0.5, 0.5), turn: float = 0.1) -> PolyMesh:
    """A regular n-gon, turned a little so that no edge lies along the pixel grid."""
    return _around(centre, np.full(n, radius), turn)


def star(n: int) -> PolyMesh:
    """A star of n vertices: every other one half as far from the centre."""
    return _around((0.5, 0.5), np.where(np.arange(n) % 2, 0.2, 0.4), 0.1)


def random_polygon(rng: np.random.Generator) -> PolyMesh:
    """A polygon of 3 to 24 vertices around the centre, which need not be convex."""
    n = int(rng.integers(3, 25))
    return _around((0.5, 0.5), rng.uniform(0.1, 0.48, n), rng.uniform(0.0, 2.0 * np.pi))


def _around(centre: tuple[float, float], radii: FloatArray, turn: float) -> PolyMesh:
    n = len(radii)
    angles = turn + 2.0 * np.pi * np.arange(n) / n
    points = np.column_stack((centre[0] + radii * np.cos(angles), centre[1] + radii * np.sin(angles)))
    return PolyMesh.from_faces(points, [range(n)])


def wobbled(mesh: PolyMesh, n: int, size: float = 0.01) -> list[PolyMesh]:
    """n copies of a mesh with all vertices moved at random by about `size`."""
    rng = np.random.default_rng(0)
    return [mesh.with_vertices(mesh.vertices + rng.normal(0.0, size, mesh.vertices.shape)) for _ in range(n)]


def target_of(mesh: PolyMesh, resolution: int) -> Target:
    """The exact rendering of a mesh as a target."""
    return Target(coverage(mesh, resolution))


@cache
def horse_silhouette() -> Silhouette:
    """scikit-image's horse, the dark object on a light ground, padded to a square."""
    return load_silhouette(~horse(), name="horse", options=ObjectOptions(keep_specks=True))
