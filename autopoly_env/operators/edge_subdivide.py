"""`edge_subdivide`: a new vertex at the middle of an edge, as Blender's Subdivide with one cut."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray
from autopoly_env.mesh import PolyMesh, mirrored
from autopoly_env.operators import edit_kernels
from autopoly_env.operators.action import Choice, Start
from autopoly_env.operators.deeds import Deed, Press, select
from autopoly_env.operators.elements import EDGE
from autopoly_env.operators.evidence import Evidence, sane_move
from autopoly_env.operators.mirroring import again, moved
from autopoly_env.operators.operator import Mirroring, Operator
from autopoly_env.operators.rebuilding import edited, ends_along_face, grown
from autopoly_env.operators.wording import Gesture, Phrases, Told, begun_with


def any_edge(mesh: PolyMesh) -> BoolArray:
    """(E,) all of them."""
    return np.ones(mesh.topology.n_edges, np.bool_)


def subdivide(mesh: PolyMesh, edge: int, _choice: Choice | None) -> PolyMesh:
    """A new vertex at the midpoint of the edge; the faces beside it keep their other corners."""
    packed, _ = edited(mesh, edit_kernels.SUBDIVIDE, edge)
    return grown(mesh, _middle(mesh, edge)[None], packed)


def _middle(mesh: PolyMesh, edge: int) -> FloatArray:
    tail, head = ends_along_face(mesh, edge)
    middle: FloatArray = 0.5 * (mesh.vertices[tail] + mesh.vertices[head])
    return middle


def _on_boundary(mesh: PolyMesh, edge: int) -> bool:
    return bool(mesh.topology.is_boundary_edge[edge])


def _begin(evidence: Evidence, edge: int) -> Iterator[Start]:
    """The new vertex at the far end of what is missing beside the edge and of what is too much, the larger first."""
    plain = edge_subdivide.apply(evidence.mesh, edge)
    sides = [blame for blame in (evidence.missing(edge), evidence.excess(edge)) if blame is not None and blame.mass]
    for blame in sorted(sides, key=lambda blame: -blame.mass):
        for mesh in sane_move(evidence, plain, np.array([(blame.far_x, blame.far_y)])):
            yield Start(None, mesh)
    yield Start(None, plain)


def _promise(evidence: Evidence, edge: int) -> float:
    missing, excess = evidence.missing(edge), evidence.excess(edge)
    return 0.0 if missing is None or excess is None else max(missing.mass, excess.mass)


def _mirror(of: Mirroring, start: Start) -> Iterator[Start]:
    """Two new vertices; one, and it on the axis, where the edge crosses it."""
    new, first = len(of.mesh.vertices), start.mesh
    a, b = of.images[of.mesh.edges[of.action.element]].tolist()
    if of.mesh.edge_index(a, b) == of.action.element:
        yield Start(start.choice, moved(first, {new: np.array((of.axis, first.vertices[new, 1]))}))
        return
    second, halfway = again(edge_subdivide, first, first.edge_index(a, b))
    yield Start(start.choice, moved(second, {new + 1: mirrored(first.vertices[new], of.axis)}), halfway)


def _sources(before: PolyMesh, edge: int, _choice: Choice | None, _made: PolyMesh) -> FloatArray:
    return _middle(before, edge)[None]


def _blender(mesh: PolyMesh, edge: int, _choice: Choice | None) -> list[Any]:
    return [mesh.vertex_ids[v] for v in mesh.edges[edge]]


def _deeds(step: Told) -> tuple[Deed, ...]:
    a, b = step.element["edge"]
    (new,) = step.created["vertices"]
    halves = select("edge", (a, new), (new, b))
    return select("edge", (a, b)), Press(("Right-click",), "Subdivide", leaves=halves, effect="both halves")


edge_subdivide = Operator(
    "edge_subdivide",
    EDGE,
    "a new vertex at the middle of an edge",
    ((1, 1, 0),),
    any_edge,
    subdivide,
    shows=_on_boundary,
    begin=_begin,
    promise=_promise,
    mirror=_mirror,
    sources=_sources,
    phrases=Phrases(
        "Subdivide an edge",
        lambda step: f"{begun_with(step)} gets vertex {step.created['vertices'][0]} in its middle.",
        _deeds,
        "Edge › Subdivide",
        "mesh.subdivide",
        lambda _: Gesture("BBPBB"),
    ),
    blender=_blender,
)
