"""Parts, holes and small details of a picture: which of them a mesh has."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray, IntArray
from autopoly_env.details.hairlines import FINEST
from autopoly_env.mesh import PolyMesh
from autopoly_env.raster import coverage
from autopoly_env.silhouette import Silhouette, areas, distances_within, label_holes, label_parts

_SMALL = 2  # pixels at FINEST: a place is a detail if this much can be taken off all around it
_LOW = 6  # pixels at FINEST: and it is deeper than this,
_DEEP = 0.4  # and than this share of its width: the sliver between a circle and a chord is not
_FEW = 25  # pixels a side, from which on a single pixel is none


@dataclass(frozen=True)
class Details:
    """What there is in a picture: points (x, y) inside each of P parts and each of H holes.

    They are where it is deepest and the middle of its longest row: a coarse mesh of it has one of them at least.
    """

    parts: FloatArray  # (P, 2, 2) unit square
    holes: FloatArray  # (H, 2, 2)

    @classmethod
    def of(cls, silhouette: Silhouette) -> "Details":
        """Those of a silhouette, as a tracer sees them: at its own resolution, at most 256. Asked again, the same."""
        return _details_of(silhouette)

    def kept(self, mesh: PolyMesh) -> tuple[int, int]:
        """How many of the (parts, holes) the mesh has, each as a part or a hole of its own."""
        loops = [mesh.vertices[loop] for loop in mesh.topology.boundary_loops]
        areas = np.array([_signed_area(loop) for loop in loops])
        signs = np.append(np.sign(areas), 0.0)  # the last for no loop
        parts, holes = (_innermost(points.reshape(-1, 2), loops, areas) for points in (self.parts, self.holes))
        return _n_loops(parts, signs[parts] > 0.0), _n_loops(holes, signs[holes] < 0.0)


@dataclass(frozen=True)
class Losses:
    """What of a picture a mesh has."""

    n_parts: int
    n_holes: int
    n_parts_kept: int
    n_holes_kept: int
    n_places: int  # where one stands out from the other, lost parts and holes among them

    @classmethod
    def of(cls, mesh: PolyMesh, silhouette: Silhouette) -> "Losses":
        """Compare a mesh with a silhouette."""
        details = Details.of(silhouette)
        return cls(len(details.parts), len(details.holes), *details.kept(mesh), _n_places(mesh, silhouette))


@lru_cache(maxsize=64)
def _details_of(silhouette: Silhouette) -> Details:
    shown = silhouette.target(min(silhouette.resolution, FINEST)).coverage
    parts = _points(label_parts(shown))
    if silhouette.resolution > FINEST:
        parts = _of_different_parts(parts, silhouette.mask)
    return Details(parts, _points(label_holes(shown)))


def _of_different_parts(points: FloatArray, mask: BoolArray) -> FloatArray:
    """Those (N, 2, 2) in parts of their own in the full picture: what joins them may be too thin at FINEST."""
    labels, cell = areas(mask, with_corners=True)[0], -(-len(mask) // FINEST)
    corners = np.maximum((points[:, 0] * len(mask)).astype(np.int64) - cell // 2, 0)
    names = [int(labels[y : y + cell, x : x + cell].max()) for x, y in corners.tolist()]
    return points[[k for k, name in enumerate(names) if not name or name not in names[:k]]]


def _n_loops(loops: IntArray, is_own: BoolArray) -> int:
    """How many different loops are the own ones of something, whose points have `loops` (N, 2) around them."""
    pairs = zip(loops.reshape(-1, 2).tolist(), is_own.reshape(-1, 2).tolist(), strict=True)
    return len({loop[is_fit.index(True)] for loop, is_fit in pairs if any(is_fit)})


def _points(labels: IntArray) -> FloatArray:
    """(N, 2, 2) for each label 1.. of a picture (R, R) its deepest point and the middle of its longest row."""
    return np.stack((_deepest(labels), _middles(labels)), axis=1)


def _deepest(labels: IntArray) -> FloatArray:
    depth = distances_within(np.pad(labels, 1) > 0)[1:-1, 1:-1]
    order = np.lexsort((-depth.ravel(), labels.ravel()))
    names = labels.ravel()[order]
    rows, columns = np.divmod(order[np.flatnonzero(np.diff(names, prepend=0))], len(labels))
    found: FloatArray = np.column_stack((columns + 0.5, rows + 0.5)) / len(labels)
    return found


def _middles(labels: IntArray) -> FloatArray:
    size = len(labels)
    begins = np.flatnonzero(np.diff(labels, axis=1, prepend=-1).ravel())  # every row begins anew
    lengths, names = np.diff(begins, append=size * size), labels.ravel()[begins]
    order = np.lexsort((-lengths, names))
    order = order[names[order] > 0]
    longest = order[np.flatnonzero(np.diff(names[order], prepend=0))]
    rows, columns = np.divmod(begins[longest], size)
    return np.column_stack((columns + 0.5 * lengths[longest], rows + 0.5)) / size


def _eroded(mask: BoolArray) -> BoolArray:
    """The pixels of a mask whose 4 neighbours are in it, too."""
    around = np.pad(mask, 1)
    kept: BoolArray = mask & around[:-2, 1:-1] & around[2:, 1:-1] & around[1:-1, :-2] & around[1:-1, 2:]
    return kept


def _innermost(points: FloatArray, loops: Sequence[FloatArray], areas: FloatArray) -> IntArray:
    """(P,) of each point the smallest loop around it, -1 where there is none."""
    inside = np.array([_contains(loop, points) for loop in loops])
    sizes = np.where(inside, np.abs(areas)[:, None], np.inf)
    return np.where(inside.any(axis=0), np.argmin(sizes, axis=0), -1)


def _contains(loop: FloatArray, points: FloatArray) -> BoolArray:
    """(P,) whether a closed polygon (n, 2) has each point inside."""
    (ax, ay), (bx, by) = loop.T[:, :, None], np.roll(loop, -1, axis=0).T[:, :, None]
    x, y = points.T
    passes = (ay > y) != (by > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        left = x < ax + (y - ay) * (bx - ax) / (by - ay)
    odd: BoolArray = (passes & left).sum(axis=0) % 2 == 1
    return odd


def _signed_area(loop: FloatArray) -> float:
    x, y = loop.T
    return float(0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1)))


def _n_places(mesh: PolyMesh, silhouette: Silhouette) -> int:
    """In how many places a silhouette stands out from a mesh, or a mesh from a silhouette.

    No places are seams along the boundary, and slivers, which a coarse outline leaves of a curve.
    """
    size = min(silhouette.resolution, FINEST)
    n_off = _SMALL * size // FINEST
    least = max(_LOW * size // FINEST, int(size >= _FEW))
    wanted, shown = silhouette.target(size).mask, coverage(mesh, size) >= 0.5
    n_places = 0
    for differs, beyond in ((wanted & ~shown, shown), (shown & ~wanted, ~shown)):
        for _ in range(n_off):
            differs = _eroded(differs)
        if differs.any():
            depth = _distance_to(beyond)
            n_places += sum(_stands_out(depth[place], n_off, least) for place in _places(differs))
    return n_places


def _places(mask: BoolArray) -> Iterator[tuple[IntArray, ...]]:
    """The pixels (rows, columns) of each of its parts."""
    labels = label_parts(mask.astype(np.float64))
    for name in range(1, int(labels.max(initial=0)) + 1):
        yield np.nonzero(labels == name)


def _stands_out(depth: FloatArray, n_off: int, least: int) -> bool:
    """Whether a place, `n_off` pixels taken off around it, is deep for the width along which it lies on the boundary.

    `depth` (N,) are the distances of its pixels to what lies beyond the boundary.
    """
    width = int(np.count_nonzero(depth < n_off + 2)) + 2 * n_off
    deepest = float(depth.max()) + n_off
    return deepest > least and deepest >= _DEEP * width


def _distance_to(mask: BoolArray) -> FloatArray:
    """How far every pixel is from the nearest of a mask, in pixels; infinitely where that is empty."""
    return distances_within(~mask)
