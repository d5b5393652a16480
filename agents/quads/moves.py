"""Moves between outlines that are cut into quads: besides those of `climb` whole quads come and go.

A vertex more or less makes a quad a triangle or a triangle a quad; two at once, at the ends of an edge within or of one
on the boundary, make the same mesh with a quad more or less.
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from agents.climb.moves import CLUMSY_BLAME, JITTER, blamed_rows, grown_at
from agents.quads.partition import Partition, partitioned
from agents.trace.outline import Outline
from agents.trace.rings import Ring
from autopoly_env.arrays import FloatArray
from autopoly_env.placement import Disagreement
from autopoly_env.silhouette import Silhouette

_Side = tuple[int, int]  # vertices of an outline, as a face or a ring runs


def without(outline: Outline, vertices: set[int]) -> Outline | None:
    """The outline without some of its vertices, numbered ring after ring; None where a ring has too few left."""
    rings, first = [], 0
    for ring in outline.rings:
        n = len(ring.points)
        kept = [i for i in range(n) if first + i not in vertices]
        if len(kept) < 3:
            return None
        rings.append(ring if len(kept) == n else Ring(ring.points[kept], ring.parent))
        first += n
    return Outline(tuple(rings))


def merged(outline: Outline, a: int, b: int) -> Outline | None:
    """The outline with vertex a in the middle between a and b, and no b."""
    points = outline.loops.vertices.copy()
    points[a] = 0.5 * (points[a] + points[b])
    return without(outline.moved(outline.loops.with_vertices(points)), {b})


def quad_neighbours(outline: Outline, partition: Partition, silhouette: Silhouette, n_blamed: int) -> Iterator[Outline]:
    """Outlines with a quad less or a quad more."""
    sides = {pair for cycle in outline.loops.faces for pair in pairwise((*cycle, cycle[0]))}
    rungs = {
        (min(pair), max(pair)) for face in partition.faces for pair in pairwise((*face, face[0])) if pair not in sides
    }
    pairs = sorted(rungs) + sorted(sides)
    for a, b in pairs:
        found = without(outline, {a, b})
        if found is not None:
            yield found
    for a, b in sorted(sides):
        found = merged(outline, a, b)
        if found is not None:
            yield found
    yield from _rungs_more(outline, partition, silhouette, n_blamed)


def quad_shaken(outline: Outline, silhouette: Silhouette, rng: np.random.Generator) -> Outline:
    """An outline a few random moves away, in whole quads mostly."""
    for _ in range(rng.integers(1, 3)):
        kind = rng.random()
        if kind < 0.25:
            disagreement = Disagreement(outline.loops, silhouette)
            blame = disagreement.blame[:, :, 0].max(axis=1) + CLUMSY_BLAME
            row = int(rng.choice(len(blame), p=blame / blame.sum()))
            outline = grown_at(outline, disagreement, row, "edge_extrude" if rng.random() < 0.6 else "edge_subdivide")
        elif kind < 0.4:
            n = len(outline.loops.vertices)
            outline = without(outline, {int(rng.integers(n))}) or outline
        else:
            partition = partitioned(outline)
            if partition is None:
                continue
            ways = list(quad_neighbours(outline, partition, silhouette, 8))
            outline = ways[int(rng.integers(len(ways)))] if ways else outline
    if rng.random() < 0.2:
        for k, ring in enumerate(outline.rings):
            outline = outline.with_ring(k, Ring(ring.points + rng.normal(0.0, JITTER, ring.points.shape), ring.parent))
    return outline


def _rungs_more(outline: Outline, partition: Partition, silhouette: Silhouette, n_blamed: int) -> Iterator[Outline]:
    """A vertex where an edge is to blame, and one across the quad or the strip of quads behind it."""
    loops = outline.loops
    disagreement = Disagreement(loops, silhouette)
    opposite = _opposite_sides(partition)
    rim = [(a, b) for a, b in loops.topology.boundary_half_edges.tolist()]
    for row in blamed_rows(disagreement, n_blamed):
        a, b = rim[row]
        across = _other_end_of_strip(opposite, set(rim), (a, b))
        if across is not None:
            c, d = across
            new = _added(outline, grown_at(outline, disagreement, row, "edge_subdivide"))
            share = _share_along(new, loops.vertices[a], loops.vertices[b])
            yield _with_points(
                outline, {(a, b): new, (c, d): loops.vertices[d] + share * (loops.vertices[c] - loops.vertices[d])}
            )


def _opposite_sides(partition: Partition) -> dict[_Side, _Side]:
    """Across every side of a quad, as the quad runs, the other side."""
    opposite: dict[_Side, _Side] = {}
    for face in partition.faces:
        if len(face) == 4:
            a, b, c, d = face
            opposite |= {(a, b): (c, d), (b, c): (d, a), (c, d): (a, b), (d, a): (b, c)}
    return opposite


def _other_end_of_strip(opposite: dict[_Side, _Side], rim: set[_Side], side: _Side) -> _Side | None:
    """The boundary edge at the other end of the strip of quads that begins at one; None where a triangle ends it."""
    seen = set()
    while side in opposite and side not in seen:
        seen.add(side)
        c, d = opposite[side]
        if (c, d) in rim:
            return c, d
        side = (d, c)
    return None


def _added(outline: Outline, grown: Outline) -> FloatArray:
    """The point that the second of two outlines has more than the first."""
    known = {tuple(point) for point in outline.loops.vertices.tolist()}
    [point] = [point for point in grown.loops.vertices if tuple(point.tolist()) not in known][:1]
    found: FloatArray = point
    return found


def _share_along(point: FloatArray, a: FloatArray, b: FloatArray) -> float:
    along = b - a
    length2 = float(along @ along)
    return float(np.clip((point - a) @ along / length2, 0.1, 0.9)) if length2 else 0.5


def _with_points(outline: Outline, points: dict[_Side, FloatArray]) -> Outline:
    """The outline with a vertex more in each of some boundary edges."""
    rings, first = [], 0
    for ring in outline.rings:
        n = len(ring.points)
        row = []
        for i in range(n):
            row.append(ring.points[i])
            point = points.get((first + i, first + (i + 1) % n))
            if point is not None:
                row.append(point)
        rings.append(ring if len(row) == n else Ring(np.array(row), ring.parent))
        first += n
    return Outline(tuple(rings))
