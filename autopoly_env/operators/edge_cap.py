"""`edge_cap`: a triangle on a boundary edge, as Blender's Extrude Edges with the far edge merged at its centre."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from autopoly_env.arrays import FloatArray
from autopoly_env.mesh import PolyMesh, mirrored
from autopoly_env.mesh.planar_kernels import clear_extrusion
from autopoly_env.operators.action import Choice, Start
from autopoly_env.operators.deeds import NOTHING, Deed, Press, Pull, select
from autopoly_env.operators.edge_extrude import boundary_edges
from autopoly_env.operators.edit_kernels import INSET, MAX_HALVINGS
from autopoly_env.operators.elements import EDGE
from autopoly_env.operators.evidence import Evidence, missing_mass, sane_move
from autopoly_env.operators.mirroring import again, moved
from autopoly_env.operators.operator import Mirroring, Operator
from autopoly_env.operators.rebuilding import ends_along_face, grown, refusal
from autopoly_env.operators.wording import Gesture, Phrases, Told, begun_with

HEIGHT = 0.5  # of the edge's length


def cap(mesh: PolyMesh, edge: int, _choice: Choice | None) -> PolyMesh:
    """A new triangle (b, a, new) outside boundary edge a-b, whose tip stands above the middle of a-b.

    It is `HEIGHT` of the edge's length high, halved as the quad of `edge_extrude` is, in which it lies.
    """
    if mesh.topology.sides(edge)[1] >= 0:
        raise refusal("edge_cap", "edge", edge, "it lies between two faces; choose a boundary edge")
    a, b = ends_along_face(mesh, edge)
    height, _ = clear_extrusion(mesh.vertices, mesh.edges, a, b, HEIGHT, INSET, MAX_HALVINGS)
    (ax, ay), (bx, by) = mesh.vertices[[a, b]].tolist()
    tip = (0.5 * (ax + bx) + height * (by - ay), 0.5 * (ay + by) + height * (ax - bx))
    return grown(mesh, [tip], (*mesh.faces, (b, a, len(mesh.vertex_ids))), 1)


def _begin(evidence: Evidence, edge: int) -> Iterator[Start]:
    """The tip at the far end of the missing region that the edge answers for."""
    plain = edge_cap.apply(evidence.mesh, edge)
    blame = evidence.missing(edge)
    if blame is not None and blame.mass:
        for mesh in sane_move(evidence, plain, np.array([(blame.far_x, blame.far_y)])):
            yield Start(None, mesh)
    yield Start(None, plain)


def _mirror(of: Mirroring, start: Start) -> Iterator[Start]:
    """Two triangles; one, and its tip on the axis, where the edge crosses it."""
    new, first = len(of.mesh.vertices), start.mesh
    a, b = of.images[of.mesh.edges[of.action.element]].tolist()
    if of.mesh.edge_index(a, b) == of.action.element:
        yield Start(start.choice, moved(first, {new: np.array((of.axis, first.vertices[new, 1]))}))
        return
    second, halfway = again(edge_cap, first, first.edge_index(a, b))
    yield Start(start.choice, moved(second, {new + 1: mirrored(first.vertices[new], of.axis)}), halfway)
    yield Start(start.choice, moved(second, {new: mirrored(second.vertices[new + 1], of.axis)}), halfway)


def _sources(before: PolyMesh, edge: int, _choice: Choice | None, _made: PolyMesh) -> FloatArray:
    middle: FloatArray = before.vertices[before.edges[edge]].mean(axis=0, keepdims=True)
    return middle


def _blender(mesh: PolyMesh, edge: int, _choice: Choice | None) -> list[Any]:
    return [mesh.vertex_ids[v] for v in ends_along_face(mesh, edge)]


def _deeds(step: Told) -> tuple[Deed, ...]:
    ends: tuple[int, ...] = tuple(step.element["edge"])
    (tip,) = step.created["vertices"]
    return (
        select("edge", ends),
        Pull(ends, (-1, -2), middle=tip),
        Press(("M",), "At Center", leaves=NOTHING, effect="makes one point of it"),
    )


edge_cap = Operator(
    "edge_cap",
    EDGE,
    "a new triangle on a boundary edge",
    ((1, 2, 1),),
    boundary_edges,
    cap,
    begin=_begin,
    promise=missing_mass,
    mirror=_mirror,
    sources=_sources,
    phrases=Phrases(
        "Cap an edge",
        lambda step: (
            f"{begun_with(step)} gets a triangle, face {step.created['faces'][0]}, "
            f"with its tip at vertex {step.created['vertices'][0]}."
        ),
        _deeds,
        "Edge › Extrude Edges, then Mesh › Merge › At Center",
        "mesh.merge",
        lambda _: Gesture("KPBBKPBB", drags=True),
        "The shape runs out to a point here.",
    ),
    blender=_blender,
)
