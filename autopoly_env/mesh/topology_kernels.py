"""A Numba kernel that says all that follows from which vertices make which faces, in one packed array.

Each array that a kernel hands back, or is given, costs more than the work on it: so kernels are given all of a topology
as one, and find its parts themselves (`links_in`).

Letters as in `topology`: V vertices, E edges, F faces, H half-edges (= corners), B boundary half-edges, L boundary
loops, N boundary vertices, K others.
"""

from typing import NamedTuple

import numpy as np

from autopoly_env.arrays import IntArray
from autopoly_env.compute import inlined, kernel


class Links(NamedTuple):
    """The half-edges, the edges and the boundary as arrays, all int64; numbered as `Topology` says."""

    corners: IntArray  # (H,) the vertices of all faces, face by face
    offsets: IntArray  # (F+1,) where each face begins in `corners`
    half_edges: IntArray  # (H, 2) from, to
    owners: IntArray  # (H,) the face of each
    following: IntArray  # (H,) the next around the same face
    twins: IntArray  # (H,) the one that runs the other way, -1 on the boundary
    edges: IntArray  # (E, 2)
    sides: IntArray  # (E, 2) the half-edge of the lower face and that of the other, -1 on the boundary
    edge_of: IntArray  # (H,) the edge of each half-edge
    rim: IntArray  # (B,) the half-edges of the boundary, loop by loop
    boundary: IntArray  # (B, 2) from, to of each of these
    loop_ends: IntArray  # (L,) where each loop ends in `rim`
    outer: IntArray  # (N,) the vertices of the boundary as the loops pass them
    loops: IntArray  # (B, 2) the half-edges of `rim` between rows of `outer`
    inner: IntArray  # (K,) the other vertices, ascending
    neighbours: IntArray  # vertices joined to each of these, one after the other, ascending
    neighbour_offsets: IntArray  # (K+1,)


PAIRS = ("half_edges", "edges", "sides", "boundary", "loops")  # those with rows of two
_N_PARTS = len(Links._fields)


@kernel
def packed_links(corners: IntArray, offsets: IntArray, n_vertices: int) -> IntArray:
    """What follows from the faces' `corners` (H,), face f being offsets[f]:offsets[f+1]: all of `Links` in one array.

    It begins with where each part begins, and the last one ends. Empty where there is no vertex of some number.
    """
    n = len(corners)
    half_edges, owners, following = np.empty((n, 2), np.int64), np.empty(n, np.int64), np.empty(n, np.int64)
    for f in range(len(offsets) - 1):
        for h in range(offsets[f], offsets[f + 1]):
            if not 0 <= corners[h] < n_vertices:
                return np.empty(0, np.int64)
            owners[h] = f
            following[h] = h + 1 if h + 1 < offsets[f + 1] else offsets[f]
            half_edges[h, 0] = corners[h]
            half_edges[h, 1] = corners[following[h]]
    order = _by_edge(half_edges, n_vertices)
    twins, edges, sides, edge_of = _paired(half_edges, order)
    rim, loop_ends = _rim(following, twins)
    outer, boundary, loops, row_of = _outline(half_edges, rim, n_vertices)
    inner, neighbours, neighbour_offsets = _inside(edges, row_of, len(outer))
    parts = (
        corners.copy(), offsets.copy(), half_edges.reshape(-1), owners, following, twins, edges.reshape(-1),
        sides.reshape(-1), edge_of, rim, boundary.reshape(-1), loop_ends, outer, loops.reshape(-1), inner, neighbours,
        neighbour_offsets,
    )  # fmt: skip
    end = _N_PARTS + 1
    for part in parts:
        end += len(part)
    packed = np.empty(end, np.int64)
    end = _N_PARTS + 1
    for k, part in enumerate(parts):
        packed[k] = end
        for value in part:
            packed[end] = value
            end += 1
    packed[_N_PARTS] = end
    return packed


@inlined
def links_in(packed: IntArray) -> Links:
    """The parts of a packed topology, which share its memory."""
    return Links(
        part_of(packed, 0), part_of(packed, 1), pairs_of(packed, 2), part_of(packed, 3), part_of(packed, 4),
        part_of(packed, 5), pairs_of(packed, 6), pairs_of(packed, 7), part_of(packed, 8), part_of(packed, 9),
        pairs_of(packed, 10), part_of(packed, 11), part_of(packed, 12), pairs_of(packed, 13), part_of(packed, 14),
        part_of(packed, 15), part_of(packed, 16),
    )  # fmt: skip


@inlined
def part_of(packed: IntArray, k: int) -> IntArray:
    """Part k of an array that begins with where each of its parts begins, and the last one ends."""
    return packed[packed[k] : packed[k + 1]]


@inlined
def pairs_of(packed: IntArray, k: int) -> IntArray:
    """The same in rows of two."""
    return packed[packed[k] : packed[k + 1]].reshape((-1, 2))


@kernel
def _by_edge(half_edges: IntArray, n_vertices: int) -> IntArray:
    """(H,) the half-edges by their lower vertex, their higher one, and number."""
    ends = np.zeros(n_vertices + 1, np.int64)
    for h in range(len(half_edges)):
        ends[min(half_edges[h, 0], half_edges[h, 1]) + 1] += 1
    for v in range(n_vertices):
        ends[v + 1] += ends[v]
    starts, order = ends.copy(), np.empty(len(half_edges), np.int64)
    for h in range(len(half_edges)):
        low, high = min(half_edges[h, 0], half_edges[h, 1]), max(half_edges[h, 0], half_edges[h, 1])
        k = ends[low]
        while k > starts[low] and max(half_edges[order[k - 1], 0], half_edges[order[k - 1], 1]) > high:
            order[k] = order[k - 1]
            k -= 1
        order[k] = h
        ends[low] += 1
    return order


@kernel
def _paired(half_edges: IntArray, order: IntArray) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    """Twins (H,), edges (E, 2), their sides (E, 2), and the edge (H,) of each half-edge."""
    n = len(order)
    edge_of = np.empty(n, np.int64)
    twins, edges, sides = np.full(n, -1, np.int64), np.empty((n, 2), np.int64), np.empty((n, 2), np.int64)
    n_edges, begin = 0, 0
    while begin < n:
        first = order[begin]
        low, high = min(half_edges[first, 0], half_edges[first, 1]), max(half_edges[first, 0], half_edges[first, 1])
        end, along, against = begin, -1, -1  # the last that runs from low to high, and from high to low
        while end < n:
            h = order[end]
            if min(half_edges[h, 0], half_edges[h, 1]) != low or max(half_edges[h, 0], half_edges[h, 1]) != high:
                break
            if half_edges[h, 0] == low:
                along = h
            else:
                against = h
            end += 1
        edges[n_edges, 0], edges[n_edges, 1] = low, high
        for k in range(begin, end):
            h = order[k]
            edge_of[h] = n_edges
            twins[h] = against if half_edges[h, 0] == low else along
            if twins[h] < 0 or h < twins[h]:
                sides[n_edges, 0], sides[n_edges, 1] = h, twins[h]
        n_edges += 1
        begin = end
    return twins, edges[:n_edges].copy(), sides[:n_edges].copy(), edge_of


@kernel
def _rim(following: IntArray, twins: IntArray) -> tuple[IntArray, IntArray]:
    """The half-edges (B,) of the boundary and where each loop (L,) of them ends.

    At a vertex the walk turns through the fan that it came in by.
    """
    n = len(twins)
    seen, rim, ends = np.zeros(n, np.bool_), np.empty(n, np.int64), np.empty(n, np.int64)
    n_rim, n_loops = 0, 0
    for start in range(n):
        h = start
        if twins[h] >= 0 or seen[h]:
            continue
        while not seen[h]:
            seen[h] = True
            rim[n_rim] = h
            n_rim += 1
            h = following[h]
            while twins[h] >= 0:
                h = following[twins[h]]
        ends[n_loops] = n_rim
        n_loops += 1
    return rim[:n_rim].copy(), ends[:n_loops].copy()


@kernel
def _outline(half_edges: IntArray, rim: IntArray, n_vertices: int) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    """The boundary's vertices (N,), its half-edges (B, 2) between all and between these, the row (V,) of each or -1."""
    row_of, outer, n_outer = np.full(n_vertices, -1, np.int64), np.empty(n_vertices, np.int64), 0
    boundary, loops = np.empty((len(rim), 2), np.int64), np.empty((len(rim), 2), np.int64)
    for k in range(len(rim)):
        v = half_edges[rim[k], 0]
        boundary[k, 0], boundary[k, 1] = v, half_edges[rim[k], 1]
        if row_of[v] < 0:
            row_of[v] = n_outer
            outer[n_outer] = v
            n_outer += 1
    for k in range(len(rim)):
        loops[k, 0], loops[k, 1] = row_of[boundary[k, 0]], row_of[boundary[k, 1]]
    return outer[:n_outer].copy(), boundary, loops, row_of


@kernel
def _inside(edges: IntArray, row_of: IntArray, n_outer: int) -> tuple[IntArray, IntArray, IntArray]:
    """The vertices (K,) off the boundary, what is joined to them, and where the neighbours of each begin (K+1,)."""
    inner, n_inner = np.empty(len(row_of) - n_outer, np.int64), 0
    numbers = np.full(len(row_of), -1, np.int64)
    for v in range(len(row_of)):
        if row_of[v] < 0:
            inner[n_inner] = v
            numbers[v] = n_inner
            n_inner += 1
    offsets = np.zeros(n_inner + 1, np.int64)
    for e in range(len(edges)):
        for side in range(2):
            if numbers[edges[e, side]] >= 0:
                offsets[numbers[edges[e, side]] + 1] += 1
    for k in range(n_inner):
        offsets[k + 1] += offsets[k]
    filled, neighbours = offsets.copy(), np.empty(offsets[n_inner], np.int64)
    for e in range(len(edges)):
        for side in range(2):
            k = numbers[edges[e, side]]
            if k >= 0:
                neighbours[filled[k]] = edges[e, 1 - side]
                filled[k] += 1
    return inner, neighbours, offsets
