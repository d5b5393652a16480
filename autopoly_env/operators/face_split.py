"""`face_split`: a face cut in two along an inner diagonal, as Blender's Connect Vertex Path."""

from typing import Any

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray
from autopoly_env.mesh import Face, PolyMesh
from autopoly_env.mesh.planar_kernels import is_free_diagonal, split_imbalance, splittable_corners
from autopoly_env.operators import edit_kernels
from autopoly_env.operators.action import Choice
from autopoly_env.operators.choices import TO_CORNER
from autopoly_env.operators.deeds import Press, select
from autopoly_env.operators.elements import CORNER
from autopoly_env.operators.operator import Operator
from autopoly_env.operators.rebuilding import corner_of, corners_from_last, edited, grown, refusal
from autopoly_env.operators.wording import Gesture, Phrases, Told


def corners_with_diagonal(mesh: PolyMesh) -> BoolArray:
    """(H,) the corners that have a diagonal strictly inside their face and new to the mesh."""
    topology = mesh.topology
    mask: BoolArray = splittable_corners(mesh.vertices, topology.corners, topology.face_offsets, topology.edges)
    return mask


def _costs(mesh: PolyMesh, corner: int) -> FloatArray:
    face, i = corner_of(mesh, corner)
    costs: FloatArray = split_imbalance(mesh.vertices, np.array(mesh.faces[face]), mesh.edges, i)
    return costs


def _is_free(mesh: PolyMesh, face: Face, i: int, j: int) -> bool:
    """Of one diagonal, for a replay knows which one it was: all of them would be the square of the corners' number."""
    return bool(is_free_diagonal(mesh.vertices[list(face)], np.array(face), mesh.edges, i, j))


def most_even_diagonal(mesh: PolyMesh, corner: int) -> int | None:
    """The corner of the same face with the most even split; of equals (to 1e-12) the first in the face."""
    costs = _costs(mesh, corner)
    least = costs.min()
    if least == np.inf:
        return None
    start = mesh.topology.first_corner(corner_of(mesh, corner)[0])
    return start + int(np.flatnonzero(costs <= least + 1e-12)[0])


def split(mesh: PolyMesh, corner: int, choice: Choice | None) -> PolyMesh:
    """The face cut along the diagonal to corner `choice`.

    The part that keeps the face's last half-edge (from its last corner to its first) keeps its id and place.
    """
    if choice is None:
        raise refusal("face_split", "corner", corner, "no diagonal from it runs inside its face; choose another")
    if not isinstance(choice, int | np.integer):
        raise refusal("face_split", "corner", corner, f"{choice!r} is no corner; give the corner to split to")
    f, i = corner_of(mesh, corner)
    face, j = mesh.faces[f], int(choice) - mesh.topology.first_corner(f)
    if not 0 <= j < len(face) or not _is_free(mesh, face, i, j):
        raise refusal(
            "face_split",
            "corner",
            corner,
            f"the way to corner {choice} is no free diagonal of its face; choose another",
        )
    packed, _ = edited(mesh, edit_kernels.SPLIT, corner, int(choice))
    return grown(mesh, (), packed, 1)


def _inner(_mesh: PolyMesh, _corner: int) -> bool:
    return False


def _other_end(step: Told) -> int:
    return int(step.choice["to"]) if step.choice else 0


def _blender(mesh: PolyMesh, corner: int, choice: Choice | None) -> list[Any]:
    assert isinstance(choice, int | np.integer)
    face, i = corner_of(mesh, corner)
    _, j = corner_of(mesh, int(choice))
    ends = [mesh.vertex_ids[mesh.faces[face][k]] for k in (i, j)]
    return [mesh.face_ids[face], *corners_from_last(mesh, face, *ends)]


face_split = Operator(
    "face_split",
    CORNER,
    "a face cut in two along an inner diagonal from a corner",
    ((0, 1, 1),),
    corners_with_diagonal,
    split,
    choose=most_even_diagonal,
    choice=TO_CORNER,
    shows=_inner,
    phrases=Phrases(
        "Split a face",
        lambda step: (
            f"Face {step.element['face']} is cut in two between vertex {step.element['vertex']} "
            f"and vertex {_other_end(step)}; the other part is face {step.created['faces'][0]}."
        ),
        lambda step: (
            select("vertex", (step.element["vertex"],), (_other_end(step),)),
            Press(("J",), effect="joins them with an edge"),
        ),
        "Vertex › Connect Vertex Path",
        "mesh.vert_connect_path",
        lambda _: Gesture("K", n_selected=2),
        "Each half of the face can change on its own now.",
    ),
    blender=_blender,
)
