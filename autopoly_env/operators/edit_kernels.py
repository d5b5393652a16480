"""Numba kernels of the operators that only take faces apart and put them together: packed topologies in and out.

What a new vertex is named, and where it lies, is the caller's. Letters: V vertices, F faces, H half-edges; `packed` is
what `topology_kernels.packed_links` makes, with V vertices, and so is what comes out.
"""

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray, IntArray
from autopoly_env.compute import kernel, uncounted_kernel
from autopoly_env.mesh.planar_kernels import clear_extrusion
from autopoly_env.mesh.topology_kernels import links_in, packed_links

OFFSET = 0.25  # of the edge's length, of an extrusion
INSET = 0.25
MAX_HALVINGS = 12


@kernel
def subdivided(packed: IntArray, n_vertices: int, edge: int) -> IntArray:
    """Vertex number V after the tail of each half-edge of an edge."""
    links = links_in(packed)
    first, second = links.sides[edge, 0], links.sides[edge, 1]
    n_new = 1 if second < 0 else 2
    corners, offsets = np.empty(len(links.corners) + n_new, np.int64), np.empty(len(links.offsets), np.int64)
    end = 0
    for f in range(len(links.offsets) - 1):
        offsets[f] = end
        for h in range(links.offsets[f], links.offsets[f + 1]):
            corners[end] = links.corners[h]
            end += 1
            if h == first or h == second:
                corners[end] = n_vertices
                end += 1
    offsets[len(offsets) - 1] = end
    return packed_links(corners, offsets, n_vertices + 1)


@kernel
def extruded(packed: IntArray, n_vertices: int, edge: int) -> IntArray:
    """A face (b, a, V, V + 1) more on the edge a-b, as its lower face runs."""
    links = links_in(packed)
    side = links.sides[edge, 0]
    part = np.array((links.half_edges[side, 1], links.half_edges[side, 0], n_vertices, n_vertices + 1))
    return _with_face(links.corners, links.offsets, part, n_vertices + 2)


@uncounted_kernel
def extrusion(points: FloatArray, edges: IntArray, a: int, b: int) -> tuple[float, float, float, float]:
    """Where vertices V and V + 1 of `extruded` begin: (x, y, x, y), outside of edge a-b and parallel to it.

    They stand off by `OFFSET` of the edge's length, halved up to `MAX_HALVINGS` times while the new face meets another
    of the `edges` (E, 2), be it straight or narrowed by `INSET` of the edge's length at either end.
    """
    offset, inset = clear_extrusion(points, edges, a, b, OFFSET, INSET, MAX_HALVINGS)
    ax, ay, bx, by = points[a, 0], points[a, 1], points[b, 0], points[b, 1]
    in_x, in_y = inset * (bx - ax), inset * (by - ay)
    out_x, out_y = offset * (by - ay), offset * (ax - bx)
    return ax + in_x + out_x, ay + in_y + out_y, bx - in_x + out_x, by - in_y + out_y


@kernel
def split(packed: IntArray, n_vertices: int, corner: int, other: int) -> IntArray:
    """The face of two corners (= half-edges) cut between them; the part without its last half-edge is the last face."""
    links = links_in(packed)
    low, high = min(corner, other), max(corner, other)
    kept, offsets = np.empty(len(links.corners) - (high - low - 1), np.int64), links.offsets.copy()
    end = 0
    for h in range(len(links.corners)):
        if h <= low or h >= high:
            kept[end] = links.corners[h]
            end += 1
    for f in range(links.owners[corner] + 1, len(offsets)):
        offsets[f] -= high - low - 1
    return _with_face(kept, offsets, links.corners[low : high + 1], n_vertices)


@kernel
def holed(packed: IntArray, n_vertices: int, face: int, n_sides: int, bridges: IntArray) -> IntArray:
    """A face cut in two around a hole with the corners V, V + 1, ...; the part that has its last half-edge stays.

    `bridges` (4,) are two pairs (position in the face, position in the hole), by the first of them.
    """
    links = links_in(packed)
    begin = links.offsets[face]
    i, h, j, k = bridges[0], bridges[1], bridges[2], bridges[3]
    there, back = (h - k) % n_sides + 1, (k - h) % n_sides + 1  # corners of the hole on the way to the other bridge
    inner = np.empty(there + back, np.int64)
    for step in range(there):
        inner[step] = n_vertices + (h - step) % n_sides
    for step in range(back):
        inner[there + step] = n_vertices + (k - step) % n_sides
    kept = np.concatenate((links.corners[: begin + i + 1], inner[:there], links.corners[begin + j :]))
    offsets = links.offsets.copy()
    for f in range(face + 1, len(offsets)):
        offsets[f] += there - (j - i - 1)
    part = np.concatenate((links.corners[begin + i : begin + j + 1], inner[there:]))
    return _with_face(kept, offsets, part, n_vertices + n_sides)


@kernel
def without_face(packed: IntArray, n_vertices: int, face: int) -> tuple[IntArray, IntArray]:
    """One face less, and which vertices are left, ascending: those that no face has any more are gone."""
    links = links_in(packed)
    first, last = links.offsets[face], links.offsets[face + 1]
    corners, offsets = np.empty(len(links.corners) - (last - first), np.int64), links.offsets[1:].copy()
    end = 0
    for h in range(len(links.corners)):
        if h < first or h >= last:
            corners[end] = links.corners[h]
            end += 1
    for f in range(len(offsets)):
        offsets[f] = links.offsets[f] if f <= face else links.offsets[f + 1] - (last - first)
    return _renumbered(corners, offsets, n_vertices)


@kernel
def without_corner(packed: IntArray, n_vertices: int, corner: int) -> tuple[IntArray, IntArray]:
    """A face's corner (= half-edge) less, and which vertices are left, as for `without_face`."""
    links = links_in(packed)
    corners, offsets = np.empty(len(links.corners) - 1, np.int64), links.offsets.copy()
    for h in range(len(corners)):
        corners[h] = links.corners[h if h < corner else h + 1]
    for f in range(links.owners[corner] + 1, len(offsets)):
        offsets[f] -= 1
    return _renumbered(corners, offsets, n_vertices)


@kernel
def _with_face(corners: IntArray, offsets: IntArray, part: IntArray, n_vertices: int) -> IntArray:
    n = len(corners)
    more, ends = np.empty(n + len(part), np.int64), np.empty(len(offsets) + 1, np.int64)
    more[:n], more[n:] = corners, part
    ends[: len(offsets)] = offsets
    ends[len(offsets)] = len(more)
    return packed_links(more, ends, n_vertices)


@kernel
def _renumbered(corners: IntArray, offsets: IntArray, n_vertices: int) -> tuple[IntArray, IntArray]:
    number, kept, n_kept = np.full(n_vertices, -1, np.int64), np.empty(n_vertices, np.int64), 0
    for v in corners:
        number[v] = 0
    for v in range(n_vertices):
        if number[v] == 0:
            number[v] = n_kept
            kept[n_kept] = v
            n_kept += 1
    for h in range(len(corners)):
        corners[h] = number[corners[h]]
    return packed_links(corners, offsets, n_kept), kept[:n_kept].copy()


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
