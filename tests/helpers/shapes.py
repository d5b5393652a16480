"""Shapes with known pictures, and two independent ways to draw a picture: shapely's, and one in exact fractions."""

from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from itertools import combinations
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.mesh import PolyMesh


def star(seed: int, n: int, center: tuple[float, float] = (0.5, 0.5), radius: float = 0.45) -> FloatArray:
    """A random simple polygon (n, 2), mostly concave, of positive area; n >= 4."""
    rng = np.random.default_rng(seed)
    angles = 2.0 * np.pi * (np.arange(n) + 0.8 * rng.random(n)) / n
    radii = radius * (0.2 + 0.8 * rng.random(n))
    return np.column_stack((center[0] + radii * np.cos(angles), center[1] + radii * np.sin(angles)))


def polygon(points: npt.ArrayLike) -> PolyMesh:
    """A mesh of one face."""
    points = np.asarray(points, np.float64)
    return PolyMesh.from_faces(points, [range(len(points))])


def frame(outer: FloatArray, inner: FloatArray) -> PolyMesh:
    """The ring of quads between two polygons of n vertices each, the inner one inside the outer one."""
    n = len(outer)
    quads = [(k, (k + 1) % n, n + (k + 1) % n, n + k) for k in range(n)]
    return PolyMesh.from_faces(np.concatenate((outer, inner)), quads)


def hourglass() -> PolyMesh:
    """Two quads that meet at the pinch vertex 2, and nowhere else."""
    points = [(0.15, 0.1), (0.45, 0.2), (0.5, 0.5), (0.2, 0.4), (0.85, 0.55), (0.9, 0.9), (0.6, 0.8)]
    return PolyMesh.from_faces(points, [(0, 1, 2, 3), (2, 4, 5, 6)])


def loop(n: int, first: int = 0) -> IntArray:
    """The directed edges (n, 2) of the closed loop first, first + 1, ..."""
    ring = np.arange(n)
    return first + np.column_stack((ring, np.roll(ring, -1)))


def shapely_coverage(shape: shapely.Geometry, resolution: int) -> FloatArray:
    """(R, R) areas of the intersections of a valid geometry (unit square) with the pixels."""
    in_pixels = shapely.transform(shape, lambda points: points * resolution)
    shapely.prepare(in_pixels)
    rows, columns = np.mgrid[:resolution, :resolution]
    pixels = shapely.box(columns, rows, columns + 1, rows + 1)
    areas = np.zeros(pixels.shape)
    near = shapely.intersects(in_pixels, pixels)
    areas[near] = shapely.area(shapely.intersection(in_pixels, pixels[near]))
    return areas


def pairs_that_meet(points: FloatArray, edges: IntArray) -> int:
    """How many pairs of edges without a common vertex intersect, by shapely; touching counts."""
    lines = [shapely.LineString(points[e]) if (points[e[0]] != points[e[1]]).any() else shapely.Point(points[e[0]])
             for e in edges]  # fmt: skip
    pairs = [(i, j) for i, j in combinations(range(len(edges)), 2) if not set(edges[i]) & set(edges[j])]
    return int(sum(shapely.intersects(lines[i], lines[j]) for i, j in pairs))


Point = tuple[Fraction, Fraction]


def exact_coverage(
    points: Iterable[Iterable[Any]], edges: Iterable[Sequence[int]], resolution: int
) -> npt.NDArray[Any]:
    """(R, R) signed areas as `Fraction`: of the triangles from the origin to every edge of any closed loops."""
    at: list[Point] = [(Fraction(x) * resolution, Fraction(y) * resolution) for x, y in points]
    image = np.full((resolution, resolution), Fraction(0), object)
    for a, b in edges:
        for row in range(resolution):
            strip = _clipped([(Fraction(0), Fraction(0)), at[a], at[b]], 1, row)
            for column in range(resolution):
                image[row, column] += _area(_clipped(strip, 0, column))
    return image


def _clipped(ring: list[Point], axis: int, low: int) -> list[Point]:
    """The part of a ring between `low` and `low` + 1 of one coordinate (Sutherland and Hodgman 1974)."""
    for bound, sign in ((low, 1), (low + 1, -1)):
        kept: list[Point] = []
        for k, q in enumerate(ring):
            p = ring[k - 1]
            before, after = sign * (p[axis] - bound), sign * (q[axis] - bound)
            if (before < 0) != (after < 0):
                t = before / (before - after)
                kept.append((p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])))
            if after >= 0:
                kept.append(q)
        ring = kept
    return ring


def _area(ring: list[Point]) -> Fraction:
    return sum((ring[k - 1][0] * q[1] - q[0] * ring[k - 1][1] for k, q in enumerate(ring)), Fraction(0)) / 2


def central_differences(function: Callable[[npt.NDArray[Any]], Any], points: npt.NDArray[Any], step: Any) -> FloatArray:
    """The gradient (V, 2) of a scalar function of positions (V, 2), from two values a coordinate."""
    gradient = np.empty(points.shape)
    for k in np.ndindex(*points.shape):
        ahead, behind = points.copy(), points.copy()
        ahead[k] += step
        behind[k] -= step
        gradient[k] = float((function(ahead) - function(behind)) / (2 * step))
    return gradient
