"""A mesh of quads and triangles as a construction: every face made in its turn, every vertex at once in its place."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from agents.quads.telling import Addition, order_of
from agents.trace.construct import Builder, UnbuildableError, grow_quad
from autopoly_env.arrays import FloatArray
from autopoly_env.errors import AutoPolyError
from autopoly_env.mesh import PolyMesh
from autopoly_env.simulator import Simulator, State

OPERATORS = (
    "edge_extrude",
    "edge_cap",
    "edge_fill",
    "vertex_merge",
    "face_delete",
    "vertex_dissolve",
)  # that the telling may need
_N_STARTS = 3  # faces to begin with, the largest, that are tried until a ring can be closed
_BULGE = 0.05  # of its length, that a side of a triangle stands out while it has a corner in it
_SHY = 0.2  # share of the way to the middle of its face by which a corner stays away from the one it is welded to


def build(simulator: Simulator, mesh: PolyMesh) -> list[State]:
    """The states that build `mesh` up to numbering. Raises UnbuildableError where the operators cannot."""
    for deep in (True, False):
        for rank in range(_N_STARTS):
            try:
                return _built(simulator, mesh, order_of(mesh, rank, deep))
            except UnbuildableError as error:
                last = error
    raise last


def _built(simulator: Simulator, mesh: PolyMesh, additions: Iterator[Addition]) -> list[State]:
    first = next(additions)
    builder = Builder(simulator, PolyMesh.from_faces(mesh.vertices[list(first.face)], [range(len(first.face))]))
    id_of = dict(zip(first.face, range(len(first.face)), strict=True))
    for addition in additions:
        id_of |= _add_somehow(builder, mesh.vertices, addition, id_of)
    return builder.states


def _add_somehow(builder: Builder, points: FloatArray, addition: Addition, id_of: dict[int, int]) -> dict[int, int]:
    """`_add`, or the same face from another of its edges that is there; raises UnbuildableError if none will do."""
    kept = len(builder.states)
    turned = [(*addition.face[k:], *addition.face[:k]) for k in range(1, len(addition.face))]
    others = [replace(addition, face=face, kind="weld") for face in turned if face[0] in id_of and face[1] in id_of]
    for way in (addition, *others):
        try:
            return _add(builder, points, way, id_of)
        except AutoPolyError:
            del builder.states[kept:]
    raise UnbuildableError(f"no operator makes the face {addition.face}")


def _add(builder: Builder, points: FloatArray, addition: Addition, id_of: dict[int, int]) -> dict[int, int]:
    """Make one face; the ids of its new vertices."""
    if addition.kind == "apart":
        return _begin_part(builder, points, addition)
    a, b, *others = addition.face
    edge = builder.edge(id_of[a], id_of[b])
    if addition.kind == "fill":
        builder.do("edge_fill", edge, _edge_across(builder, addition, id_of))
        return {}
    first = builder.mesh.next_vertex_id
    new = dict(zip(others, range(first, first + len(others)), strict=True))
    known = [v for v in others if v in id_of]
    places = {name: _shy(points, addition, v) if v in known else points[v] for v, name in new.items()}
    builder.do("edge_extrude" if len(others) == 2 else "edge_cap", edge, None, places)
    for v in known:
        mesh = builder.mesh
        builder.do("vertex_merge", mesh.vertex_index(new[v]), mesh.vertex_index(id_of[v]), {id_of[v]: points[v]})
    return {v: name for v, name in new.items() if v not in id_of}


def _edge_across(builder: Builder, addition: Addition, id_of: dict[int, int]) -> int:
    """The edge that a ring is closed to: opposite in a quad, in a triangle one that is there already."""
    a, b, c, *rest = addition.face
    rim = set(map(tuple, builder.mesh.topology.boundary_half_edges.tolist()))
    for v, w in [(c, rest[0])] if rest else [(b, c), (c, a)]:
        ends = [builder.mesh.vertex_index(id_of[vertex]) for vertex in (w, v)]
        if tuple(ends) in rim:
            return builder.mesh.edge_index(*ends)
    raise UnbuildableError("a face that closes a ring has no edge across")


def _shy(points: FloatArray, addition: Addition, v: int) -> FloatArray:
    """Beside a corner, on the way to the middle of the face, where nothing else is."""
    place: FloatArray = points[v] + _SHY * (points[list(addition.face)].mean(axis=0) - points[v])
    return place


def _begin_part(builder: Builder, points: FloatArray, addition: Addition) -> dict[int, int]:
    """A quad or a triangle of its own; a triangle is a quad one of whose corners is dissolved."""
    corners = points[list(addition.face)]
    if len(corners) == 4:
        return dict(zip(addition.face, grow_quad(builder, corners), strict=True))
    (ax, ay), (bx, by) = corners[:2].tolist()
    bulge = (0.5 * (ax + bx) + _BULGE * (by - ay), 0.5 * (ay + by) - _BULGE * (bx - ax))
    ids = grow_quad(builder, np.insert(corners, 1, bulge, axis=0))
    builder.do("vertex_dissolve", builder.mesh.vertex_index(ids.pop(1)))
    return dict(zip(addition.face, ids, strict=True))
