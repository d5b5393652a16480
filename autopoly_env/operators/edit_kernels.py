"""Numba kernels of the operators that only take faces apart and put them together: packed topologies in and out.

What a new vertex is named, and where it lies, is the caller's. Letters: V vertices, F faces, H half-edges; `packed` is
what `topology_kernels.packed_links` makes, with V vertices, and so is what comes out.
"""

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray, IntArray
from autopoly_env.compute import kernel, uncounted_kernel
from autopoly_env.mesh.planar_kernels import clear_extrusion
from autopoly_env.mesh.topology_kernels import Links, links_in, packed_links
from autopoly_env.operators.hole_kernels import HOLE_SIDES

SUBDIVIDE, EXTRUDE, DELETE, DISSOLVE, SPLIT, HOLE = range(6)  # what an edit does
OFFSET = 0.25  # of the edge's length, of an extrusion
INSET = 0.25
MAX_HALVINGS = 12
_MOST_NEW = 16  # corners that an edit brings, at most: a hole of four has twelve


@uncounted_kernel
def extrusion(points: FloatArray, edges: IntArray, a: int, b: int) -> tuple[float, float, float, float]:
    """Where vertices V and V + 1 of an extrusion begin: (x, y, x, y), outside of edge a-b and parallel to it.

    They stand off by `OFFSET` of the edge's length, halved up to `MAX_HALVINGS` times while the new face meets another
    of the `edges` (E, 2), be it straight or narrowed by `INSET` of the edge's length at either end.
    """
    offset, inset = clear_extrusion(points, edges, a, b, OFFSET, INSET, MAX_HALVINGS)
    ax, ay, bx, by = points[a, 0], points[a, 1], points[b, 0], points[b, 1]
    in_x, in_y = inset * (bx - ax), inset * (by - ay)
    out_x, out_y = offset * (by - ay), offset * (ax - bx)
    return ax + in_x + out_x, ay + in_y + out_y, bx - in_x + out_x, by - in_y + out_y


@kernel
def edited(packed: IntArray, n_vertices: int, edit: int, element: int, ends: IntArray) -> tuple[IntArray, IntArray]:
    """The topology after an edit, and which vertex each of its own was; new ones count on from V.

    One kernel for all, for each that Python calls is a file to be loaded. `element` is the operator's, as in Python;
    `ends` (1,) the other corner of a split, (4,) of a hole its bridges, see `_holed`.
    """
    links = links_in(packed)
    corners, offsets = np.empty(len(links.corners) + _MOST_NEW, np.int64), np.empty(len(links.offsets) + 1, np.int64)
    n, n_faces = n_vertices, len(links.offsets) - 1
    if edit == SUBDIVIDE:
        _subdivided(links, n, element, corners, offsets)
        n += 1
    elif edit == EXTRUDE:
        _extruded(links, n, element, corners, offsets)
        n, n_faces = n + 2, n_faces + 1
    elif edit == HOLE:
        n_sides = HOLE_SIDES[element % len(HOLE_SIDES)]
        _holed(links, n, element // len(HOLE_SIDES), n_sides, ends, corners, offsets)
        n, n_faces = n + n_sides, n_faces + 1
    elif edit == SPLIT:
        _split(links, element, ends[0], corners, offsets)
        n_faces += 1
    elif edit == DELETE:
        _without(links, links.offsets[element], links.offsets[element + 1], corners, offsets)
        for f in range(element, n_faces):  # the face that is left without corners
            offsets[f] = offsets[f + 1]
        n_faces -= 1
    else:
        corner = lone_corners(packed, n_vertices)[element]
        _without(links, corner, corner + 1, corners, offsets)
    kept = np.arange(n)
    if edit == DELETE or edit == DISSOLVE:
        n = _renumber(corners, offsets[n_faces], kept)
    return packed_links(corners[: offsets[n_faces]], offsets[: n_faces + 1], n), kept[:n].copy()


@uncounted_kernel
def _subdivided(links: Links, n_vertices: int, edge: int, corners: IntArray, offsets: IntArray) -> None:
    """Vertex number V after the tail of each half-edge of an edge."""
    first, second, end = links.sides[edge, 0], links.sides[edge, 1], 0
    for f in range(len(links.offsets) - 1):
        offsets[f] = end
        for h in range(links.offsets[f], links.offsets[f + 1]):
            corners[end] = links.corners[h]
            end += 1
            if h == first or h == second:
                corners[end] = n_vertices
                end += 1
    offsets[len(links.offsets) - 1] = end


@uncounted_kernel
def _extruded(links: Links, n_vertices: int, edge: int, corners: IntArray, offsets: IntArray) -> None:
    """A face (b, a, V, V + 1) more on the edge a-b, as its lower face runs."""
    side, n = links.sides[edge, 0], len(links.corners)
    for h in range(n):
        corners[h] = links.corners[h]
    for f in range(len(links.offsets)):
        offsets[f] = links.offsets[f]
    corners[n], corners[n + 1] = links.half_edges[side, 1], links.half_edges[side, 0]
    corners[n + 2], corners[n + 3] = n_vertices, n_vertices + 1
    offsets[len(links.offsets)] = n + 4


@uncounted_kernel
def _split(links: Links, corner: int, other: int, corners: IntArray, offsets: IntArray) -> None:
    """The face of two corners (= half-edges) cut between them; the part without its last half-edge is the last face."""
    low, high = min(corner, other), max(corner, other)
    _without(links, low + 1, high, corners, offsets)
    n_faces = len(links.offsets) - 1
    end = offsets[n_faces]
    for h in range(low, high + 1):
        corners[end] = links.corners[h]
        end += 1
    offsets[n_faces + 1] = end


@uncounted_kernel
def _holed(
    links: Links, n_vertices: int, face: int, n_sides: int, bridges: IntArray, corners: IntArray, offsets: IntArray
) -> None:
    """A face cut in two around a hole with the corners V, V + 1, ...; the part that has its last half-edge stays.

    `bridges` (4,) are two pairs (position in the face, position in the hole), by the first of them.
    """
    begin, n_faces, end = links.offsets[face], len(links.offsets) - 1, 0
    i, h, j, k = begin + bridges[0], bridges[1], begin + bridges[2], bridges[3]
    for f in range(n_faces):
        offsets[f] = end
        for corner in range(links.offsets[f], links.offsets[f + 1]):
            if f != face or corner <= i or corner >= j:
                corners[end] = links.corners[corner]
                end += 1
            if corner == i:
                end = _around(n_vertices, n_sides, h, k, corners, end)
    offsets[n_faces] = end
    for corner in range(i, j + 1):
        corners[end] = links.corners[corner]
        end += 1
    offsets[n_faces + 1] = _around(n_vertices, n_sides, k, h, corners, end)


@uncounted_kernel
def _around(n_vertices: int, n_sides: int, first: int, last: int, corners: IntArray, end: int) -> int:
    """Append the hole's corners from one down to another, against its winding; where they end."""
    for step in range((first - last) % n_sides + 1):
        corners[end] = n_vertices + (first - step) % n_sides
        end += 1
    return end


@uncounted_kernel
def _without(links: Links, first: int, last: int, corners: IntArray, offsets: IntArray) -> None:
    """All faces without the corners first..last-1, which are those of one face."""
    end = 0
    for f in range(len(links.offsets) - 1):
        offsets[f] = end
        for h in range(links.offsets[f], links.offsets[f + 1]):
            if h < first or h >= last:
                corners[end] = links.corners[h]
                end += 1
    offsets[len(links.offsets) - 1] = end


@uncounted_kernel
def _renumber(corners: IntArray, n_corners: int, kept: IntArray) -> int:
    """Leave out the vertices that no corner has any more; write those that are left to `kept`, and say how many."""
    for v in range(len(kept)):
        kept[v] = -1
    for h in range(n_corners):
        kept[corners[h]] = 0
    n_kept = 0
    for v in range(len(kept)):
        if kept[v] == 0:
            kept[v] = n_kept
            n_kept += 1
    for h in range(n_corners):
        corners[h] = kept[corners[h]]
    for v in range(len(kept)):
        if kept[v] >= 0:
            kept[kept[v]] = v  # which is no further on, so that none is overwritten that is still to be read
    return n_kept


@kernel
def lone_corners(packed: IntArray, n_vertices: int) -> IntArray:
    """(V,) the corner of each vertex that has but one (a boundary vertex of valence 2), else -1."""
    links = links_in(packed)
    found = np.full(n_vertices, -1, np.int64)
    for h in range(len(links.corners)):
        v = links.corners[h]
        found[v] = h if found[v] == -1 else -2
    for v in range(n_vertices):
        found[v] = max(found[v], -1)
    return found


@kernel
def dissolvable(packed: IntArray, n_vertices: int) -> BoolArray:
    """(V,) the vertices with but one corner, of no triangle, whose neighbours are not joined already."""
    links = links_in(packed)
    corners = lone_corners(packed, n_vertices)
    mask = np.zeros(n_vertices, np.bool_)
    for v in range(n_vertices):
        h = corners[v]
        if h >= 0:
            face = links.owners[h]
            first, last = links.offsets[face], links.offsets[face + 1]
            before, after = links.corners[h - 1 if h > first else last - 1], links.half_edges[h, 1]
            mask[v] = last - first > 3 and not _are_joined(links.edges, before, after)
    return mask


@uncounted_kernel
def _are_joined(edges: IntArray, a: int, b: int) -> bool:
    for e in range(len(edges)):
        if (edges[e, 0] == a and edges[e, 1] == b) or (edges[e, 0] == b and edges[e, 1] == a):
            return True
    return False


@kernel
def joinable(packed: IntArray) -> BoolArray:
    """(E,) the edges between two faces that have no vertex in common but its ends."""
    links = links_in(packed)
    mask = np.zeros(len(links.edges), np.bool_)
    for e in range(len(mask)):
        h, g = links.sides[e, 0], links.sides[e, 1]
        if g >= 0:
            mask[e] = _n_common(links.corners, links.offsets, links.owners[h], links.owners[g]) == 2
    return mask


@uncounted_kernel
def _n_common(corners: IntArray, offsets: IntArray, one: int, other: int) -> int:
    n_common = 0
    for h in range(offsets[one], offsets[one + 1]):
        for g in range(offsets[other], offsets[other + 1]):
            n_common += corners[h] == corners[g]
    return n_common
