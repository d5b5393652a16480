"""Numba kernels for `edge_fill`: which boundary edges a new face can join, and how narrow the gap between them is.

Letters: V vertices, E edges, B boundary half-edges. A face between the half-edges a-b and c-d has the corners b, a, d,
c; where d is a, or c is b, it is the triangle of the other three. Only +, -, *, / and comparisons are used.
"""

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray, IntArray
from autopoly_env.compute import kernel
from autopoly_env.mesh.planar_kernels import cross, point_on_segment, segments_touch

LEAST_SINE_SQUARED = 1e-4  # of the angle at a corner
_FREE, _TAKEN = -1, -2  # of an ordered pair of vertices: no edge joins them, or a face runs that way, or two have it


@kernel
def fillable(vertices: FloatArray, edges: IntArray, rim: IntArray, labels: IntArray) -> BoolArray:
    """(B,) the rows of `rim` (B, 2) that a good face joins with another, see `fill_costs`; `labels` of the topology."""
    pairs = _pairs(len(vertices), edges, rim)
    mask = np.zeros(len(rim), np.bool_)
    for i in range(len(rim)):
        for j in range(i):
            if not (mask[i] and mask[j]) and _cost(vertices, edges, rim, labels, pairs, i, j) < np.inf:
                mask[i] = mask[j] = True
    return mask


@kernel
def fill_costs(vertices: FloatArray, edges: IntArray, rim: IntArray, labels: IntArray, i: int) -> FloatArray:
    """(B,) of a face between row i of `rim` (B, 2) and each other: how long its new sides are (squared) by its area.

    inf where it would be no good: not strictly convex, wound the other way, over another edge or vertex, on an edge
    that has two faces, or a handle, which no mesh in the plane has.
    """
    pairs = _pairs(len(vertices), edges, rim)
    costs = np.full(len(rim), np.inf)
    for j in range(len(rim)):
        costs[j] = _cost(vertices, edges, rim, labels, pairs, i, j)
    return costs


@kernel
def _pairs(n: int, edges: IntArray, rim: IntArray) -> IntArray:
    """(V, V) the row of `rim` that runs against each ordered pair of vertices; else whether an edge joins them."""
    pairs = np.full((n, n), _FREE)
    for e in range(len(edges)):
        pairs[edges[e, 0], edges[e, 1]] = pairs[edges[e, 1], edges[e, 0]] = _TAKEN
    for h in range(len(rim)):
        pairs[rim[h, 1], rim[h, 0]] = h
    return pairs


@kernel
def _cost(
    vertices: FloatArray, edges: IntArray, rim: IntArray, labels: IntArray, pairs: IntArray, i: int, j: int
) -> float:
    a, b, c, d = rim[i, 0], rim[i, 1], rim[j, 0], rim[j, 1]
    if a == c or b == d:  # which also is i == j
        return np.inf
    face = np.array([b, a, d, c])
    if d == a:
        face = np.array([b, a, c])
    elif c == b:
        face = np.array([b, a, d])
    n, n_new, new = len(face), 0, 0.0
    for k in range(n):
        v, w = face[k], face[(k + 1) % n]
        if pairs[v, w] == _TAKEN or not _turns(vertices, v, w, face[(k + 2) % n]):
            return np.inf
        if pairs[v, w] == _FREE:
            n_new += 1
            new += (vertices[w, 0] - vertices[v, 0]) ** 2 + (vertices[w, 1] - vertices[v, 1]) ** 2
        for m in range(k):
            one, two = pairs[v, w], pairs[face[m], face[m + 1]]
            if one >= 0 and two >= 0 and labels[one, 0] != labels[two, 0] and labels[one, 1] == labels[two, 1]:
                return np.inf  # it would join two loops of one part, which is a handle
    if n_new == 0 and _n_around(labels, pairs, face) == n:  # no boundary would be left
        return np.inf
    if not _is_clear(vertices, edges, face, pairs):
        return np.inf
    area = 0.0
    for k in range(1, n - 1):
        area += 0.5 * _turn(vertices, face[0], face[k], face[k + 1])
    return new / area


@kernel
def _n_around(labels: IntArray, pairs: IntArray, face: IntArray) -> int:
    """How many boundary half-edges the parts have that a face of boundary sides alone lies between."""
    n, n_rows = len(face), 0
    for part in labels[:, 1]:
        for k in range(n):
            if labels[pairs[face[k], face[(k + 1) % n]], 1] == part:
                n_rows += 1
                break
    return n_rows


@kernel
def _turn(vertices: FloatArray, u: int, v: int, w: int) -> float:
    return cross(vertices[u, 0], vertices[u, 1], vertices[v, 0], vertices[v, 1], vertices[w, 0], vertices[w, 1])


@kernel
def _turns(vertices: FloatArray, u: int, v: int, w: int) -> bool:
    """Whether u, v, w is a corner of a convex face, and no needle."""
    turn = _turn(vertices, u, v, w)
    before = (vertices[v, 0] - vertices[u, 0]) ** 2 + (vertices[v, 1] - vertices[u, 1]) ** 2
    after = (vertices[w, 0] - vertices[v, 0]) ** 2 + (vertices[w, 1] - vertices[v, 1]) ** 2
    return bool(turn > 0.0 and turn * turn > LEAST_SINE_SQUARED * before * after)


@kernel
def _is_clear(vertices: FloatArray, edges: IntArray, face: IntArray, pairs: IntArray) -> bool:
    """Whether no vertex lies in the convex face or on its rim, and no edge meets one of its new sides."""
    n = len(face)
    for p in range(len(vertices)):
        if not _has(face, p) and _covers(vertices, face, p):
            return False
    for k in range(n):
        v, w = face[k], face[(k + 1) % n]
        if pairs[v, w] != _FREE:
            continue
        vx, vy, wx, wy = vertices[v, 0], vertices[v, 1], vertices[w, 0], vertices[w, 1]
        for e in range(len(edges)):
            p, q = edges[e, 0], edges[e, 1]
            if p == v or q == v or p == w or q == w:
                continue
            if segments_touch(vx, vy, wx, wy, vertices[p, 0], vertices[p, 1], vertices[q, 0], vertices[q, 1]):
                return False
    return True


@kernel
def _has(face: IntArray, p: int) -> bool:
    for k in range(len(face)):
        if face[k] == p:
            return True
    return False


@kernel
def _covers(vertices: FloatArray, face: IntArray, p: int) -> bool:
    n, inside = len(face), True
    for k in range(n):
        v, w = face[k], face[(k + 1) % n]
        if _turn(vertices, v, w, p) <= 0.0:
            inside = False
        vx, vy, wx, wy = vertices[v, 0], vertices[v, 1], vertices[w, 0], vertices[w, 1]
        if point_on_segment(vertices[p, 0], vertices[p, 1], vx, vy, wx, wy):
            return True
    return inside
