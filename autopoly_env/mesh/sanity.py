"""What is wrong with a valid mesh all the same: edges that cross, hairlines, faces flipped, empty or not allowed."""

from autopoly_env.mesh.face_rule import FaceRule, broken_faces
from autopoly_env.mesh.polymesh import PolyMesh


def defects_of(mesh: PolyMesh, faces: FaceRule = "any") -> tuple[int, int]:
    """(crossings and hairlines, faces that are flipped, empty or against the rule) as the refit counts them.

    A hairline is a pair of boundary edges that share no vertex and come closer than `CLEARANCE` without meeting: a
    corridor or a slit that shows in no picture, or two vertices as good as in one place.
    """
    found = mesh.defects
    return found.crossings + found.hairlines, found.flipped + len(broken_faces(mesh, faces))


def is_sane(mesh: PolyMesh, faces: FaceRule = "any") -> bool:
    """Whether no edges cross, there are no hairlines, and no face is flipped, empty or against the rule."""
    return defects_of(mesh, faces) == (0, 0)
