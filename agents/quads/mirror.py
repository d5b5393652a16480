"""Outlines that are their own mirror image about an upright axis: one half decides, the other is its image."""

from collections.abc import Iterable, Iterator
from itertools import pairwise

import numpy as np

from agents.trace.outline import Outline, nested
from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.mesh.symmetry import mirrored

_ON_AXIS = 0.002  # distance (unit square) from the axis within which a vertex is put on it


def symmetrised(outline: Outline, axis: float, side: int) -> Outline | None:
    """The half of an outline to the right (side 1) or left (-1) of x = `axis`, and its mirror image; None without it.

    An edge across the axis becomes level; what lies on the other side is forgotten.
    """
    loops = [loop for ring in outline.rings for loop in _loops_of(ring.points, axis, side)]
    return nested(loops) if loops else None


def symmetric_neighbours(outlines: Iterable[Outline], before: Outline, axis: float) -> Iterator[Outline]:
    """What neighbours of a symmetric outline come to if what changed to the right changes to the left as well.

    Those that differ from `before` to the left alone are left out: their image is another neighbour.
    """
    known = set(map(tuple, before.loops.vertices.tolist()))
    seen = set()
    for outline in outlines:
        points = set(map(tuple, outline.loops.vertices.tolist()))
        if all(x < axis - _ON_AXIS for x, _ in points ^ known):
            continue
        found = symmetrised(outline, axis, 1)
        signature = b"" if found is None else np.round(found.loops.vertices, 9).tobytes()
        if found is not None and signature not in seen:
            seen.add(signature)
            yield found


def _loops_of(points: FloatArray, axis: float, side: int) -> Iterator[FloatArray]:
    """Closed loops (n, 2): each stretch of a ring on the side with its image; a whole ring there, and its image."""
    distance = side * (points[:, 0] - axis)
    where = np.where(np.abs(distance) <= _ON_AXIS, 0, np.sign(distance)).astype(np.int64)
    placed = points.copy()
    placed[where == 0, 0] = axis
    if (where > 0).all():
        yield placed
        yield _image(placed, axis)
        return
    for stretch in _stretches(where):
        chain = placed[stretch]
        inner = chain[int(where[stretch[0]] == 0) : len(chain) - int(where[stretch[-1]] == 0)]
        loop = np.concatenate((chain, _image(inner, axis)))
        if len(loop) >= 3:
            yield loop


def _stretches(where: IntArray) -> Iterator[IntArray]:
    """Indices of each run of vertices on the side, with the neighbours that lie on the axis."""
    n = len(where)
    outside = np.flatnonzero(where <= 0)
    for a, b in pairwise([*outside.tolist(), int(outside[0]) + n]):
        if b - a > 1:
            first, last = a if where[a] == 0 else a + 1, b if where[b % n] == 0 else b - 1
            yield np.arange(first, last + 1) % n


def _image(points: FloatArray, axis: float) -> FloatArray:
    """The mirror image of a chain, run backwards."""
    return mirrored(points[::-1], axis)
