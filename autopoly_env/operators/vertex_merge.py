"""`vertex_merge`: two boundary vertices become one, as Blender's Merge at Last does with them."""

from collections import defaultdict
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from autopoly_env.arrays import BoolArray
from autopoly_env.errors import IllegalActionError
from autopoly_env.mesh import PolyMesh
from autopoly_env.mesh.planar_kernels import cross
from autopoly_env.operators.action import Choice, Start
from autopoly_env.operators.choices import TO_VERTEX
from autopoly_env.operators.deeds import Press, select
from autopoly_env.operators.elements import VERTEX
from autopoly_env.operators.evidence import Evidence
from autopoly_env.operators.mirroring import again, moved
from autopoly_env.operators.operator import Mirroring, Operator
from autopoly_env.operators.rebuilding import refusal, rim_defect, shrunk
from autopoly_env.operators.wording import Gesture, Phrases, Told, element_words

N_STARTS = 2  # vertices to merge with: those across most of what is missing


class _Around(NamedTuple):
    """What lies around the vertices of a mesh, by vertex."""

    mesh: PolyMesh
    faces: defaultdict[int, set[int]]
    neighbours: defaultdict[int, set[int]]
    after: defaultdict[int, list[int]]  # the next vertices on the boundary; several at a pinch
    before: defaultdict[int, list[int]]


def _around(mesh: PolyMesh) -> _Around:
    around = _Around(mesh, defaultdict(set), defaultdict(set), defaultdict(list), defaultdict(list))
    for f, face in enumerate(mesh.faces):
        for v in face:
            around.faces[v].add(f)
    for a, b in mesh.edges.tolist():
        around.neighbours[a].add(b)
        around.neighbours[b].add(a)
    for a, b in mesh.topology.boundary_half_edges.tolist():
        around.after[a].append(b)
        around.before[b].append(a)
    return around


def mergeable_vertices(mesh: PolyMesh) -> BoolArray:
    """(V,) the boundary vertices with another across a corner that is missing."""
    around = _around(mesh)
    return np.array([bool(_partners(mesh, v, around)) for v in range(len(mesh.vertex_ids))], np.bool_)


def partners(mesh: PolyMesh, vertex: int) -> list[int]:
    """The vertices that `vertex` can be merged with across a corner that is missing, the nearest first."""
    return _partners(mesh, vertex, _around(mesh))


def _partners(mesh: PolyMesh, vertex: int, around: _Around) -> list[int]:
    at = mesh.vertices
    across = [(u, (w, vertex, u)) for w in around.after[vertex] for u in around.after[w]]
    across += [(u, (w, u, vertex)) for w in around.before[vertex] for u in around.before[w]]
    found = {u for u, (w, p, q) in across if cross(*at[w], *at[p], *at[q]) > 0.0 and not _defect(vertex, u, around)}
    return sorted(found, key=lambda u: (float(((at[u] - at[vertex]) ** 2).sum()), u))


def nearest_partner(mesh: PolyMesh, vertex: int) -> int | None:
    """The nearest vertex across a missing corner; of equals the lower index."""
    found = partners(mesh, vertex)
    return found[0] if found else None


def merge(mesh: PolyMesh, vertex: int, choice: Choice | None) -> PolyMesh:
    """The mesh with vertex index `choice`, where it lies, in the place of `vertex` in all faces.

    The two end the sides of a corner, which become one edge with a face on either side.
    """
    if choice is None:
        raise refusal("vertex_merge", "vertex", vertex, "no missing corner lies between it and another; choose another")
    if not isinstance(choice, int | np.integer) or not 0 <= choice < len(mesh.vertex_ids):
        raise refusal("vertex_merge", "vertex", vertex, f"{choice!r} is no vertex; give the one to merge with")
    other = int(choice)
    defect = _defect(vertex, other, _around(mesh))
    if defect:
        raise refusal("vertex_merge", "vertex", vertex, defect)
    faces = [tuple(other if v == vertex else v for v in face) for face in mesh.faces]
    return shrunk(mesh, faces, mesh.face_ids)


def _defect(vertex: int, other: int, around: _Around) -> str:
    """Why two vertices cannot become one; empty if they can."""
    if vertex == other or around.faces[vertex] & around.faces[other]:
        return f"vertex {other} is a corner of the same face; choose one of another face"
    common = around.neighbours[vertex] & around.neighbours[other]
    if not common:
        return f"no corner lies between it and vertex {other}, they would only touch; choose the two ends of a corner"
    for w in common:
        is_along = w in around.after[vertex] and other in around.after[w]
        is_against = w in around.before[vertex] and other in around.before[w]
        if not is_along and not is_against:
            return f"an edge of more than two faces would lead to vertex {w}; choose another"
    ends = [(p, q) for w in common for v in (vertex, other) for p, q in ((v, w), (w, v)) if q in around.after[p]]
    defect = rim_defect(around.mesh, ends)
    if defect:
        return f"{defect}; choose another"
    return ""


# --- where it starts


def _begin(evidence: Evidence, vertex: int) -> Iterator[Start]:
    """The vertices across most of what is missing, then the operator's own."""
    mesh = evidence.mesh
    found = partners(mesh, vertex)
    if not found:
        yield Start(None, vertex_merge.apply(mesh, vertex))
    best = sorted(found[1:], key=lambda other: -_missing(evidence, vertex, other))[: N_STARTS - 1]
    for other in (*best, *found[:1]):
        yield Start(other, vertex_merge.apply(mesh, vertex, other))


def _missing(evidence: Evidence, vertex: int, other: int) -> float:
    """What is missing in the corners between two vertices, as far as their sides answer for it (unit square)."""
    mesh, around = evidence.mesh, _around(evidence.mesh)
    ends = [(v, w) for w in around.neighbours[vertex] & around.neighbours[other] for v in (vertex, other)]
    blames = [evidence.missing(mesh.edge_index(v, w)) for v, w in ends]
    return sum(blame.mass for blame in blames if blame is not None)


def _promise(evidence: Evidence, vertex: int) -> float:
    other = nearest_partner(evidence.mesh, vertex)
    return 0.0 if other is None else _missing(evidence, vertex, other)


def _mirror(of: Mirroring, start: Start) -> Iterator[Start]:
    """Two merges; one, where the vertices lie on the axis or are each other's mirror images, which meet on it."""
    mesh, first, vertex = of.mesh, start.mesh, of.action.element
    assert isinstance(start.choice, int | np.integer)
    other = int(start.choice)
    image, image_of_other = of.images[[vertex, other]].tolist()
    merged = first.vertex_index(mesh.vertex_ids[other])
    if image == other:
        yield Start(start.choice, moved(first, {merged: np.array((of.axis, first.vertices[merged, 1]))}))
    elif image == vertex:
        if image_of_other == other:
            yield start
    else:
        pair = [first.vertex_index(mesh.vertex_ids[v]) for v in (image, image_of_other)]
        try:
            second, halfway = again(vertex_merge, first, *pair)
        except IllegalActionError:  # another choice may leave room for its mirror image
            return
        yield Start(start.choice, second, halfway)


# --- how it is told


def _other_end(step: Told) -> int:
    return int(step.choice["to"]) if step.choice else 0


def _blender(mesh: PolyMesh, vertex: int, choice: Choice | None) -> list[Any]:
    assert isinstance(choice, int | np.integer)
    return [mesh.vertex_ids[vertex], mesh.vertex_ids[int(choice)]]


vertex_merge = Operator(
    "vertex_merge",
    VERTEX,
    "two boundary vertices made one, which closes the corner between them",
    ((-1, -1, 0),),
    mergeable_vertices,
    merge,
    choose=nearest_partner,
    choice=TO_VERTEX,
    begin=_begin,
    promise=_promise,
    mirror=_mirror,
    takes="vertex",
    phrases=Phrases(
        "Merge two vertices",
        lambda step: f"{element_words(step).capitalize()} is merged into vertex {_other_end(step)}.",
        lambda step: (
            select("vertex", (step.element["vertex"],), (_other_end(step),)),
            Press(("M",), "At Last", leaves=select("vertex", (_other_end(step),)), effect="makes one of them"),
        ),
        "Mesh › Merge › At Last",
        "mesh.merge",
        lambda _: Gesture("KPBB", n_selected=2),
        "The gap between the two corners closes.",
    ),
    blender=_blender,
)
