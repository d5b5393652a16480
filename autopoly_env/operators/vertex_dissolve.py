"""`vertex_dissolve`: a boundary vertex of valence 2 removed, as Blender's Dissolve Vertices."""

from collections.abc import Iterator
from typing import Any

from autopoly_env.arrays import BoolArray
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import edit_kernels
from autopoly_env.operators.action import Choice, Start
from autopoly_env.operators.deeds import NOTHING, Press, select
from autopoly_env.operators.elements import VERTEX
from autopoly_env.operators.mirroring import again
from autopoly_env.operators.operator import Mirroring, Operator
from autopoly_env.operators.rebuilding import corner_of, edited, refusal, shrunk_to
from autopoly_env.operators.wording import Gesture, Phrases, begun_with


def dissolvable_vertices(mesh: PolyMesh) -> BoolArray:
    """(V,) the boundary vertices with two edges, of no triangle, whose neighbours are not joined already."""
    mask: BoolArray = edit_kernels.dissolvable(mesh.topology.packed, len(mesh.vertex_ids))
    return mask


def _defect(mesh: PolyMesh, vertex: int) -> str | None:
    corner = mesh.topology.lone_corner(vertex)
    if corner < 0:
        return "more than two edges or one face meet there; choose a boundary vertex of valence 2"
    f, i = corner_of(mesh, corner)
    face = mesh.faces[f]
    if len(face) == 3:
        return "its face is a triangle; choose a vertex of a larger face"
    a, b = face[i - 1], face[(i + 1) % len(face)]
    if mesh.topology.edge_at(a, b) >= 0:
        return "its two neighbours are joined by an edge already; choose another"
    return None


def dissolve(mesh: PolyMesh, vertex: int, _choice: Choice | None) -> PolyMesh:
    """The mesh without the vertex; its two edges become one."""
    defect = _defect(mesh, vertex)
    if defect is not None:
        raise refusal("vertex_dissolve", "vertex", vertex, defect)
    return shrunk_to(mesh, *edited(mesh, edit_kernels.DISSOLVE, vertex), mesh.face_ids)


def _mirror(of: Mirroring, start: Start) -> Iterator[Start]:
    image = int(of.images[of.action.element])
    if image == of.action.element:
        yield start
        return
    first = start.mesh
    second, halfway = again(vertex_dissolve, first, first.vertex_index(of.mesh.vertex_ids[image]))
    yield Start(start.choice, second, halfway)


def _blender(mesh: PolyMesh, vertex: int, _choice: Choice | None) -> list[Any]:
    return [mesh.vertex_ids[vertex]]


vertex_dissolve = Operator(
    "vertex_dissolve",
    VERTEX,
    "a boundary vertex of valence 2 removed, its two edges made one",
    ((-1, -1, 0),),
    dissolvable_vertices,
    dissolve,
    mirror=_mirror,
    takes="vertex",
    phrases=Phrases(
        "Dissolve a vertex",
        lambda step: f"{begun_with(step)} is dissolved: its two edges become one.",
        lambda step: (
            select("vertex", (step.element["vertex"],)),
            Press(("X",), "Dissolve Vertices", leaves=NOTHING),
        ),
        "Mesh › Delete › Dissolve Vertices",
        "mesh.dissolve_verts",
        lambda _: Gesture("KK"),
        "The outline is straight enough without this vertex.",
    ),
    blender=_blender,
)
