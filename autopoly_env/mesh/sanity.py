"""What is wrong with a mesh that is valid all the same: edges that cross, faces flipped, empty or not allowed."""

from autopoly_env.mesh import geometry_kernels
from autopoly_env.mesh.face_rule import FaceRule, broken_faces
from autopoly_env.mesh.polymesh import PolyMesh


def defects_of(mesh: PolyMesh, faces: FaceRule = "any") -> tuple[int, int]:
    """(crossings, faces that are flipped or empty plus those that break the rule) as the refit counts them."""
    topology = mesh.topology
    crossings, flipped = geometry_kernels.defects(
        mesh.vertices, topology.edges, topology.corners, topology.face_offsets
    )
    return int(crossings), int(flipped) + len(broken_faces(mesh, faces))


def is_sane(mesh: PolyMesh, faces: FaceRule = "any") -> bool:
    """Whether no edges cross and no face is flipped, empty or against the rule."""
    return defects_of(mesh, faces) == (0, 0)
