"""`edge_dissolve`: the edge between two faces removed, as Blender's Dissolve Edges."""

from typing import Any

from autopoly_env.arrays import BoolArray
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import edit_kernels
from autopoly_env.operators.action import Choice
from autopoly_env.operators.deeds import Press, select
from autopoly_env.operators.elements import EDGE
from autopoly_env.operators.operator import Operator
from autopoly_env.operators.rebuilding import corner_of, refusal, shrunk, without
from autopoly_env.operators.wording import Gesture, Phrases, begun_with


def dissolvable_edges(mesh: PolyMesh) -> BoolArray:
    """(E,) the edges between two faces that share nothing else."""
    mask: BoolArray = edit_kernels.joinable(mesh.topology.packed)
    return mask


def _defect(mesh: PolyMesh, edge: int) -> str | None:
    h, g = mesh.topology.sides(edge)
    if g < 0:
        return "it has one face only; choose an edge between two faces"
    one, other = mesh.faces[corner_of(mesh, h)[0]], mesh.faces[corner_of(mesh, g)[0]]
    if len(set(one).intersection(other)) > 2:
        return "its two faces share more than this edge; choose another"
    return None


def dissolve(mesh: PolyMesh, edge: int, _choice: Choice | None) -> PolyMesh:
    """The two faces beside the edge made one, which keeps the id and the first corner of the lower."""
    defect = _defect(mesh, edge)
    if defect is not None:
        raise refusal("edge_dissolve", "edge", edge, defect)
    h, g = mesh.topology.sides(edge)
    (f, i), (other, j) = corner_of(mesh, h), corner_of(mesh, g)
    face, joined = mesh.faces[f], mesh.faces[other]
    detour = (*joined[j:], *joined[:j])[2:]  # round the other face from the end of the edge back to its start
    faces = list(mesh.faces)
    faces[f] = (*face[: i + 1], *detour, *face[i + 1 :])
    return shrunk(mesh, without(tuple(faces), other), without(mesh.face_ids, other))


def _inner(_mesh: PolyMesh, _edge: int) -> bool:
    return False


def _blender(mesh: PolyMesh, edge: int, _choice: Choice | None) -> list[Any]:
    """The ends and the face that stays."""
    return [*(mesh.vertex_ids[v] for v in mesh.edges[edge]), mesh.face_ids[mesh.topology.edge_faces[edge][0]]]


edge_dissolve = Operator(
    "edge_dissolve",
    EDGE,
    "the edge between two faces removed, the faces made one",
    ((0, -1, -1),),
    dissolvable_edges,
    dissolve,
    shows=_inner,
    takes="edge",
    phrases=Phrases(
        "Dissolve an edge",
        lambda step: f"{begun_with(step)} is dissolved: the faces beside it become one.",
        lambda step: (
            select("edge", tuple(step.element["edge"])),
            Press(
                ("X",),
                "Dissolve Edges",
                unticked=("Dissolve Vertices",),
                leaves=select("vertex", *((v,) for v in step.element["edge"])),
            ),
        ),
        "Mesh › Delete › Dissolve Edges",
        "mesh.dissolve_edges",
        lambda _: Gesture("KK"),
        "The edge is inside the shape and not needed.",
    ),
    blender=_blender,
)
