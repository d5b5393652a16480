"""`edge_extrude`: a new quad on a boundary edge, as Blender's Extrude Edges."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray
from autopoly_env.mesh import PolyMesh, mirrored
from autopoly_env.operators import edit_kernels
from autopoly_env.operators.action import Choice, Start
from autopoly_env.operators.deeds import Pull, select
from autopoly_env.operators.elements import EDGE
from autopoly_env.operators.evidence import Evidence, missing_mass, sane_move
from autopoly_env.operators.mirroring import again, moved
from autopoly_env.operators.operator import Mirroring, Operator
from autopoly_env.operators.rebuilding import edited, ends_along_face, grown, refusal
from autopoly_env.operators.wording import Gesture, Phrases, begun_with

_LEAST_WIDTH = 0.1  # of the edge's length, of an extrusion that is stretched to what is missing


def boundary_edges(mesh: PolyMesh) -> BoolArray:
    """(E,) those with one face."""
    return mesh.topology.is_boundary_edge


def extrude(mesh: PolyMesh, edge: int, _choice: Choice | None) -> PolyMesh:
    """A new quad (b, a, a', b') outside boundary edge a-b. Its far side is parallel to a-b.

    Where it begins `edit_kernels.extrusion` says.
    """
    if mesh.topology.sides(edge)[1] >= 0:
        raise refusal("edge_extrude", "edge", edge, "it lies between two faces; choose a boundary edge")
    a, b = ends_along_face(mesh, edge)
    points = np.array(edit_kernels.extrusion(mesh.vertices, mesh.edges, a, b)).reshape(2, 2)
    packed, _ = edited(mesh, edit_kernels.EXTRUDE, edge)
    return grown(mesh, points, packed, 1)


def _begin(evidence: Evidence, edge: int) -> Iterator[Start]:
    """The new edge across the far end of the missing region that the edge answers for, as wide as the region."""
    plain = edge_extrude.apply(evidence.mesh, edge)
    blame = evidence.missing(edge)
    if blame is not None and blame.mass:
        a, b = evidence.mesh.vertices[list(ends_along_face(evidence.mesh, edge))]
        along = b - a
        outward = np.array([along[1], -along[0]]) / np.hypot(*along)
        middle, half = 0.5 * (blame.low + blame.high), 0.5 * max(_LEAST_WIDTH, blame.high - blame.low)
        corners = [a + s * along + blame.depth * outward for s in (middle - half, middle + half)]
        for mesh in sane_move(evidence, plain, np.array(corners)):
            yield Start(None, mesh)
    yield Start(None, plain)


def _mirror(of: Mirroring, start: Start) -> Iterator[Start]:
    """Two quads, as the first is placed or, where that leaves no room, as the second places itself."""
    new, first, axis = len(of.mesh.vertices), start.mesh, of.axis
    a, b = of.images[of.mesh.edges[of.action.element]].tolist()
    if of.mesh.edge_index(a, b) == of.action.element:
        middle = 0.5 * (first.vertices[new] + mirrored(first.vertices[new + 1], axis))
        yield Start(start.choice, moved(first, {new: middle, new + 1: mirrored(middle, axis)}))
        return
    second, halfway = again(edge_extrude, first, first.edge_index(a, b))
    at = second.vertices  # copies of the tail and of the head; the image of an edge runs from image to image of head
    placed = {new + 2: mirrored(at[new + 1], axis), new + 3: mirrored(at[new], axis)}
    yield Start(start.choice, moved(second, placed), halfway)
    placed = {new: mirrored(at[new + 3], axis), new + 1: mirrored(at[new + 2], axis)}
    yield Start(start.choice, moved(second, placed), halfway)


def _sources(before: PolyMesh, edge: int, _choice: Choice | None, _made: PolyMesh) -> FloatArray:
    sources: FloatArray = before.vertices[list(ends_along_face(before, edge))]
    return sources


def _blender(mesh: PolyMesh, edge: int, _choice: Choice | None) -> list[Any]:
    """The ends as the edge's face runs, which is the order of the copies."""
    return [mesh.vertex_ids[v] for v in ends_along_face(mesh, edge)]


edge_extrude = Operator(
    "edge_extrude",
    EDGE,
    "a new quad on a boundary edge",
    ((2, 3, 1),),
    boundary_edges,
    extrude,
    begin=_begin,
    promise=missing_mass,
    mirror=_mirror,
    sources=_sources,
    phrases=Phrases(
        "Extrude an edge",
        lambda step: f"{begun_with(step)} is pulled out to a new quad, face {step.created['faces'][0]}.",
        lambda step: (
            select("edge", tuple(step.element["edge"])),
            Pull(tuple(step.element["edge"]), tuple(step.created["vertices"])),
        ),
        "Edge › Extrude Edges",
        "mesh.extrude_edges_move",
        lambda _: Gesture("KPBB", drags=True),
    ),
    blender=_blender,
)
