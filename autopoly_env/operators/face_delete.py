"""`face_delete`: a face removed, as Blender's Delete Faces."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from autopoly_env.arrays import BoolArray
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import edit_kernels
from autopoly_env.operators.action import Choice, Start
from autopoly_env.operators.deeds import NOTHING, Press, select
from autopoly_env.operators.elements import FACE
from autopoly_env.operators.mirroring import again
from autopoly_env.operators.operator import Mirroring, Operator
from autopoly_env.operators.rebuilding import edited, refusal, shrunk_to, without
from autopoly_env.operators.wording import Gesture, Phrases, Told, begun_with, count


def any_face_but_the_last(mesh: PolyMesh) -> BoolArray:
    """(F,) all of them, as long as there are several."""
    return np.full(len(mesh.face_ids), len(mesh.face_ids) > 1)


def delete(mesh: PolyMesh, face: int, _choice: Choice | None) -> PolyMesh:
    """The mesh without the face, and without the edges and vertices that had no other."""
    if len(mesh.face_ids) == 1:
        raise refusal("face_delete", "face", face, "it is the only face; a mesh keeps at least one")
    return shrunk_to(mesh, *edited(mesh, edit_kernels.DELETE, face), without(mesh.face_ids, face))


def _mirror(of: Mirroring, start: Start) -> Iterator[Start]:
    """Two faces; nothing where the face has no mirror image, as one with inner vertices."""
    mesh, first = of.mesh, start.mesh
    wanted = set(of.images[list(mesh.faces[of.action.element])].tolist())
    image = next((f for f, face in enumerate(mesh.faces) if set(face) == wanted), None)
    if image == of.action.element:
        yield start
    elif image is not None:
        second, halfway = again(face_delete, first, first.face_index(mesh.face_ids[image]))
        yield Start(start.choice, second, halfway)


def _done(step: Told) -> str:
    n_lost = len(step.removed["vertices"])
    others = f", and with it {count(n_lost, 'vertex')} of no other face" if n_lost else ""
    return f"{begun_with(step)} is deleted{others}."


def _blender(mesh: PolyMesh, face: int, _choice: Choice | None) -> list[Any]:
    return [mesh.face_ids[face]]


face_delete = Operator(
    "face_delete",
    FACE,
    "a face removed, with the edges and vertices that have no other",
    ((0, 0, -1),),
    any_face_but_the_last,
    delete,
    mirror=_mirror,
    takes="all",
    phrases=Phrases(
        "Delete a face",
        _done,
        lambda step: (select("face", (step.element["face"],)), Press(("X",), "Faces", leaves=NOTHING)),
        "Mesh › Delete › Faces",
        "mesh.delete",
        lambda _: Gesture("KPBB"),
        "There is no shape here.",
    ),
    blender=_blender,
)
