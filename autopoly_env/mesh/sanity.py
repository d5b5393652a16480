"""What is wrong with a mesh that is valid all the same: edges that cross, faces that are flipped or empty."""

from autopoly_env.mesh import geometry_kernels
from autopoly_env.mesh.polymesh import PolyMesh


def defects_of(mesh: PolyMesh) -> tuple[int, int]:
    """(crossings, flipped or empty faces) as the refit counts them."""
    topology = mesh.topology
    crossings, flipped = geometry_kernels.defects(
        mesh.vertices, topology.edges, topology.corners, topology.face_offsets
    )
    return int(crossings), int(flipped)


def is_sane(mesh: PolyMesh) -> bool:
    """Whether no edges cross and no face is flipped or empty."""
    return defects_of(mesh) == (0, 0)
