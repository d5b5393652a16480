"""Moves between outlines: a vertex less, one or two more where an edge is to blame, a ring less, a ring more."""

from collections.abc import Iterator, Sequence
from itertools import product

import numpy as np
import shapely

from agents.trace.outline import Outline, outline_of
from agents.trace.rings import Ring, signed_area
from autopoly_env.arrays import FloatArray
from autopoly_env.operators import operator_named
from autopoly_env.operators.face_hole import hole_shapes
from autopoly_env.placement import Disagreement
from autopoly_env.silhouette import Silhouette

_NEW_RING_SIZES = (3, 4, 5, 6, 8)
CLUMSY_BLAME = 1e-4  # area (unit square) that every edge answers for when one is drawn at random
JITTER = 0.03  # standard deviation (unit square) of a vertex that is shaken


def neighbours(
    outline: Outline, silhouette: Silhouette, contours: Sequence[Ring], n_blamed: int, *, holes: bool
) -> Iterator[Outline]:
    """All outlines that are one move away, additions at the `n_blamed` edges with most blame only."""
    disagreement = Disagreement(outline.loops, silhouette)
    for k, ring in enumerate(outline.rings):
        if len(ring.points) > 3:
            yield from (outline.with_ring(k, ring.without(i)) for i in range(len(ring.points)))
    for row in blamed_rows(disagreement, n_blamed):
        yield grown_at(outline, disagreement, row, "edge_subdivide")
        yield grown_at(outline, disagreement, row, "edge_extrude")
    yield from (outline.without_ring(k) for k in range(1, len(outline.rings)))
    yield from (_opened(outline, k) for k, ring in enumerate(outline.rings) if ring.is_hole)
    if len(outline.rings) < len(contours):
        yield from _one_ring_more(outline, contours)
    if holes:
        yield from _one_hole_more(outline, disagreement)


def relocations(outline: Outline, silhouette: Silhouette, n_blamed: int) -> Iterator[Outline]:
    """A vertex taken away here and added there."""
    disagreement = Disagreement(outline.loops, silhouette)
    for row in blamed_rows(disagreement, n_blamed):
        grown = grown_at(outline, disagreement, row, "edge_subdivide")
        for k, (old, new) in enumerate(zip(outline.rings, grown.rings, strict=True)):
            old_points = {tuple(p) for p in old.points}
            if len(new.points) > 4:
                kept = (i for i in range(len(new.points)) if tuple(new.points[i]) in old_points)
                yield from (grown.with_ring(k, new.without(i)) for i in kept)


def shaken(outline: Outline, silhouette: Silhouette, rng: np.random.Generator) -> Outline:
    """An outline a few random moves away: vertices added where edges are to blame, others taken away, all jittered."""
    for _ in range(rng.integers(1, 3)):
        if rng.random() < 0.5:
            disagreement = Disagreement(outline.loops, silhouette)
            blame = disagreement.blame[:, :, 0].max(axis=1) + CLUMSY_BLAME
            row = int(rng.choice(len(blame), p=blame / blame.sum()))
            outline = grown_at(outline, disagreement, row, "edge_subdivide" if rng.random() < 0.6 else "edge_extrude")
        if rng.random() < 0.7:
            outline = _with_one_less(outline, rng)
        if len(outline.rings) > 1 and rng.random() < 0.1:
            outline = outline.without_ring(int(rng.integers(1, len(outline.rings))))
    if rng.random() < 0.3:
        for k, ring in enumerate(outline.rings):
            outline = outline.with_ring(k, Ring(ring.points + rng.normal(0.0, JITTER, ring.points.shape), ring.parent))
    return outline


def _with_one_less(outline: Outline, rng: np.random.Generator) -> Outline:
    """The outline without a vertex drawn at random from the rings that can spare one."""
    places = [(k, i) for k, ring in enumerate(outline.rings) if len(ring.points) > 3 for i in range(len(ring.points))]
    if not places:
        return outline
    k, i = places[int(rng.integers(len(places)))]
    return outline.with_ring(k, outline.rings[k].without(i))


def blamed_rows(disagreement: Disagreement, n_most: int) -> list[int]:
    """Rows of the boundary edges with most blame, those without any left out."""
    blame = disagreement.blame[:, :, 0].max(axis=1)
    order = np.argsort(-blame, kind="stable")[:n_most]
    return [int(row) for row in order if blame[row] > 0.0]


def grown_at(outline: Outline, disagreement: Disagreement, row: int, operator: str) -> Outline:
    """One (edge_subdivide) or two (edge_extrude) vertices more in the boundary edge of that row."""
    loops = outline.loops
    a, b = loops.topology.boundary_half_edges[row].tolist()
    [start] = operator_named(operator).starts(disagreement, loops.edge_index(a, b), 1)
    new_points = start.mesh.vertices[len(loops.vertices) :]
    ends = np.cumsum([len(ring.points) for ring in outline.rings])
    k = int(np.searchsorted(ends, a, side="right"))
    ring = outline.rings[k]
    place = a - (int(ends[k]) - len(ring.points)) + 1
    return outline.with_ring(k, Ring(np.insert(ring.points, place, new_points, axis=0), ring.parent))


def _opened(outline: Outline, index: int) -> Outline:
    """The outline with a hole opened to the outside where the edges of the two rings are closest."""
    hole, parent = outline.rings[index], outline.rings[index].parent
    outer = outline.rings[parent].points
    inner = hole.points
    middles = [0.5 * (points + np.roll(points, -1, axis=0)) for points in (outer, inner)]
    gaps = np.hypot(*(middles[0][:, None] - middles[1][None]).T)  # (edges of the hole, edges of the outer ring)
    j, i = np.unravel_index(np.argmin(gaps), gaps.shape)
    points = np.concatenate((outer[: i + 1], np.roll(inner, -(j + 1), axis=0), outer[i + 1 :]))
    rings = list(outline.rings)
    rings[parent] = Ring(points, -1)
    return outline_of([ring for k, ring in enumerate(rings) if k != index], rings)


def _one_ring_more(outline: Outline, contours: Sequence[Ring]) -> Iterator[Outline]:
    """One more of the traced contours, at a few sizes: a hole where none is yet, a part outside all parts."""
    polygons = [shapely.Polygon(ring.points) for ring in outline.rings]
    for contour in contours:
        inside = [k for k, polygon in enumerate(polygons) if polygon.contains(contour.inner_point)]
        parents = [k for k in inside if not outline.rings[k].is_hole]
        if contour.is_hole and (not parents or len(inside) > len(parents)):
            continue
        if not contour.is_hole and parents:
            continue
        for size in _NEW_RING_SIZES:
            if size < len(contour.points):
                polygon = contour.contour.polygon(size)
                ring = Ring(polygon, parents[-1] if contour.is_hole else -1)
                yield outline_of([*outline.rings, ring], outline.rings)


def _one_hole_more(outline: Outline, disagreement: Disagreement) -> Iterator[Outline]:
    """A triangle or quad over the largest excess in a part."""
    for k, ring in enumerate(outline.rings):
        region = None if ring.is_hole else disagreement.excess_in(k)
        if region is not None:
            for n_sides, hole in product((3, 4), (0, 1)):
                points: FloatArray = list(hole_shapes(region, n_sides))[hole]
                if shapely.Polygon(ring.points).contains(shapely.Polygon(points)):
                    backwards = points if signed_area(points) < 0.0 else points[::-1]
                    yield outline_of([*outline.rings, Ring(backwards, k)], outline.rings)
                    break
