"""Closed contours of a silhouette: outer rings and holes, in the unit square."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import shapely
from skimage.measure import find_contours

from agents.trace.simplify import Contour
from autopoly_env.arrays import BoolArray, FloatArray
from autopoly_env.silhouette import LEVEL, Silhouette, torn_corners

TRACE_RESOLUTION = 256  # contours are followed at the silhouette's own resolution, at most this


@dataclass(frozen=True)
class Ring:
    """A closed polygon. Outer rings have positive shoelace area, holes negative (y down)."""

    points: FloatArray  # (n, 2) unit square, the first not repeated
    parent: int  # for a hole the index of the outer ring around it, for an outer ring -1

    @property
    def is_hole(self) -> bool:
        return self.parent >= 0

    def without(self, index: int) -> "Ring":
        """The ring with a point less."""
        return Ring(np.concatenate((self.points[:index], self.points[index + 1 :])), self.parent)

    @cached_property
    def contour(self) -> Contour:
        """The ring as something to make polygons of."""
        return Contour(self.points)

    @cached_property
    def inner_point(self) -> shapely.Point:
        """Some point inside."""
        return shapely.Polygon(self.points).representative_point()


def signed_area(points: FloatArray) -> float:
    """Shoelace area of a closed polygon (n, 2), positive as faces are wound."""
    (x, y), (next_x, next_y) = points.T, np.concatenate((points[1:], points[:1])).T
    return float(0.5 * (x @ next_y - y @ next_x))


def trace_rings(silhouette: Silhouette) -> list[Ring]:
    """All contours at half coverage: outer rings first, the largest first, then the holes. Asked again, the same."""
    return list(_traced(silhouette))


@lru_cache(maxsize=32)
def _traced(silhouette: Silhouette) -> tuple[Ring, ...]:
    size = min(silhouette.resolution, TRACE_RESOLUTION)
    padded = np.pad(silhouette.target(size).coverage, 1)
    lines = [line[:-1] for line in find_contours(padded, LEVEL, fully_connected="high")]
    loops = [(line[:, ::-1] - 0.5) / size for line in _torn(lines, torn_corners(padded))]
    loops = [loop for loop in loops if len(loop) >= 3 and abs(signed_area(loop)) > 0.0]
    if not loops:
        return ()
    largest = max(loops, key=lambda loop: abs(signed_area(loop)))
    outward = 1.0 if signed_area(largest) > 0.0 else -1.0  # the largest contour is an outer one
    oriented = [loop if outward > 0.0 else loop[::-1] for loop in loops]
    outer = sorted((loop for loop in oriented if signed_area(loop) > 0.0), key=signed_area, reverse=True)
    polygons = np.array([shapely.Polygon(loop) for loop in outer])
    rings = [Ring(loop, -1) for loop in outer]
    for hole in sorted((loop for loop in oriented if signed_area(loop) < 0.0), key=signed_area):
        inside = np.flatnonzero(shapely.contains_xy(polygons, *hole[0]))
        if len(inside):
            rings.append(Ring(hole, int(inside[-1])))  # the smallest one around it
    return tuple(rings)


def _torn(lines: list[FloatArray], corners: BoolArray) -> list[FloatArray]:
    """The closed lines (n, 2) through pixels' centres and between them, taken apart at the corners (R-1, R-1) given.

    Two lines, or two stretches of one, pass either side of the pixels that meet there; their ends are exchanged.
    """
    if not corners.any():
        return lines
    points = np.concatenate(lines)
    ends = np.cumsum([0, *map(len, lines)])
    following = np.arange(1, len(points) + 1)
    following[ends[1:] - 1] = ends[:-1]
    rows, columns = np.floor(0.5 * (points + points[following])).astype(np.int64).T
    passing: dict[tuple[int, int], list[int]] = {}
    for k in np.flatnonzero(corners[rows, columns]).tolist():
        passing.setdefault((int(rows[k]), int(columns[k])), []).append(k)
    for first, second in passing.values():
        following[[first, second]] = following[[second, first]]
    return [points[cycle] for cycle in _cycles(following.tolist())]


def _cycles(following: list[int]) -> Iterator[list[int]]:
    """The cycles of a permutation, each from its least element."""
    seen = [False] * len(following)
    for start in range(len(following)):
        cycle, k = [], start
        while not seen[k]:
            seen[k] = True
            cycle.append(k)
            k = following[k]
        if cycle:
            yield cycle
