"""`edge_fill`: a face between two boundary edges, as Blender's New Edge/Face from Vertices makes it."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray
from autopoly_env.errors import IllegalActionError
from autopoly_env.mesh import Face, PolyMesh
from autopoly_env.operators.action import Choice, Start
from autopoly_env.operators.choices import TO_EDGE
from autopoly_env.operators.deeds import Press, select
from autopoly_env.operators.elements import EDGE
from autopoly_env.operators.evidence import Evidence
from autopoly_env.operators.fill_kernels import fill_costs, fillable
from autopoly_env.operators.mirroring import again
from autopoly_env.operators.operator import Mirroring, Operator
from autopoly_env.operators.rebuilding import ends_along_face, grown, refusal, rim_defect
from autopoly_env.operators.wording import Gesture, Phrases, Told, begun_with

N_STARTS = 3  # faces to begin with: those over most of what is missing


def edges_with_partner(mesh: PolyMesh) -> BoolArray:
    """(E,) the boundary edges that a convex face with nothing in its way joins with another."""
    mask = np.zeros(mesh.topology.n_edges, np.bool_)
    rim, labels = mesh.topology.boundary_half_edges, mesh.topology.boundary_labels
    for (a, b), is_legal in zip(rim.tolist(), fillable(mesh.vertices, mesh.edges, rim, labels), strict=True):
        mask[mesh.edge_index(a, b)] = is_legal
    return mask


def partners(mesh: PolyMesh, edge: int) -> list[int]:
    """The edges that a convex face with nothing in its way joins with `edge`, the narrowest gap first."""
    rim = mesh.topology.boundary_half_edges
    rows = {mesh.edge_index(a, b): row for row, (a, b) in enumerate(rim.tolist())}
    if edge not in rows:
        return []
    costs = fill_costs(mesh.vertices, mesh.edges, rim, mesh.topology.boundary_labels, rows[edge])
    return sorted((other for other, row in rows.items() if costs[row] < np.inf), key=lambda o: (costs[rows[o]], o))


def nearest_partner(mesh: PolyMesh, edge: int) -> int | None:
    """The edge beyond the narrowest gap: the least length of new sides by the area; of equals the lower index."""
    found = partners(mesh, edge)
    return found[0] if found else None


def fill(mesh: PolyMesh, edge: int, choice: Choice | None) -> PolyMesh:
    """A new face (b, a, d, c) between the boundary edges a-b and c-d (edge index `choice`), each as its face runs.

    Where d is a, or c is b, it is the triangle of the other three corners. Sides a-d and c-b that are on the boundary
    already get the face as their second; the default choice is `nearest_partner`.
    """
    corners = _corners(mesh, edge, choice)
    if isinstance(corners, str):
        raise refusal("edge_fill", "edge", edge, corners)
    return grown(mesh, (), (*mesh.faces, corners), 1)


def _corners(mesh: PolyMesh, edge: int, other: Choice | None) -> Face | str:
    """The corners of the face between two edges, or why there can be none."""
    if mesh.topology.sides(edge)[1] >= 0:
        return "it lies between two faces; choose a boundary edge"
    if other is None:
        return "no convex face joins it with another boundary edge; choose one that faces it"
    if not isinstance(other, int | np.integer) or not 0 <= other < mesh.topology.n_edges:
        return f"{other!r} is no edge; give the boundary edge to fill to"
    if other == edge or mesh.topology.sides(int(other))[1] >= 0:
        return f"edge {other} is not another boundary edge; give one"
    (a, b), (c, d) = ends_along_face(mesh, edge), ends_along_face(mesh, int(other))
    corners = tuple(dict.fromkeys((b, a, d, c)))
    if a == c or b == d:
        return f"edge {other} runs from or to the same vertex as it does; choose another"
    sides = list(zip(corners, (*corners[1:], corners[0]), strict=True))
    if not all(_is_free(mesh, v, w) for v, w in sides):
        return f"an edge of the face to edge {other} has two faces already; choose another"
    defect = rim_defect(mesh, [(w, v) for v, w in sides])
    if defect:
        return f"{defect}; choose another"
    return corners


def _is_free(mesh: PolyMesh, v: int, w: int) -> bool:
    """Whether a new face may run from v to w: along no edge, or against the only face of one."""
    edge = mesh.topology.edge_at(v, w)
    if edge < 0:
        return True
    return mesh.topology.sides(edge)[1] < 0 and ends_along_face(mesh, edge) == (w, v)


# --- where it starts


def _begin(evidence: Evidence, edge: int) -> Iterator[Start]:
    """The faces over most of what is missing, then the operator's own."""
    mesh = evidence.mesh
    found = partners(mesh, edge)
    if not found:
        yield Start(None, edge_fill.apply(mesh, edge))
    best = sorted(found[1:], key=lambda other: -_missing(evidence, edge, other))[: N_STARTS - 1]
    for other in (*best, *found[:1]):
        yield Start(other, edge_fill.apply(mesh, edge, other))


def _missing(evidence: Evidence, edge: int, other: int) -> float:
    """What is missing between two edges (unit square), as far as they answer for it and a face would cover it."""
    corners = [v for v in _corners(evidence.mesh, edge, other) if isinstance(v, int)]
    x, y = evidence.mesh.vertices[corners].T
    area = 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
    blames = [evidence.missing(one) for one in (edge, other)]
    return min(area, sum(blame.mass for blame in blames if blame is not None))


def _promise(evidence: Evidence, edge: int) -> float:
    other = nearest_partner(evidence.mesh, edge)
    return 0.0 if other is None else _missing(evidence, edge, other)


def _mirror(of: Mirroring, start: Start) -> Iterator[Start]:
    """Two faces; one, where it is its own mirror image."""
    mesh, pair = of.mesh, (of.action.element, int(start.choice))  # type: ignore[call-overload]
    image = tuple(mesh.edge_index(*of.images[mesh.edges[edge]].tolist()) for edge in pair)
    if set(image) == set(pair):
        yield start
    elif not set(image) & set(pair):
        first = start.mesh
        edge, other = (first.edge_index(*mesh.edges[e].tolist()) for e in image)
        try:
            second, halfway = again(edge_fill, first, edge, other)
        except IllegalActionError:  # another choice may leave room for its mirror image
            return
        yield Start(start.choice, second, halfway)


# --- how it is told


def _other_edge(step: Told) -> str:
    a, b = step.choice["to"] if step.choice else (0, 0)
    return f"edge {a}–{b}"


def _done(step: Told) -> str:
    return f"{begun_with(step)} and {_other_edge(step)} are joined by a new face, face {step.created['faces'][0]}."


def _sources(_before: PolyMesh, _edge: int, _choice: Choice | None, _made: PolyMesh) -> FloatArray:
    return np.empty((0, 2))


def _blender(mesh: PolyMesh, edge: int, choice: Choice | None) -> list[Any]:
    """The two ends of either edge, as its face runs."""
    assert isinstance(choice, int | np.integer)
    return [mesh.vertex_ids[v] for e in (edge, int(choice)) for v in ends_along_face(mesh, e)]


edge_fill = Operator(
    "edge_fill",
    EDGE,
    "a new face between two boundary edges",
    ((0, 2, 1),),
    edges_with_partner,
    fill,
    choose=nearest_partner,
    choice=TO_EDGE,
    varies=lambda _mesh, _edge: (0, 2, 1),
    begin=_begin,
    promise=_promise,
    mirror=_mirror,
    sources=_sources,
    phrases=Phrases(
        "Fill between two edges",
        _done,
        lambda step: (
            select("edge", tuple(step.element["edge"]), tuple(step.choice["to"] if step.choice else ())),
            Press(("F",), leaves=select("face", tuple(step.created["faces"])), effect="fills a face between them"),
        ),
        "Vertex › New Edge/Face from Vertices",
        "mesh.edge_face_add",
        lambda _: Gesture("K", n_selected=2),
        "Between the two edges is shape, too.",
    ),
    blender=_blender,
)
