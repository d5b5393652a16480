"""What is wrong with a mesh that is valid all the same: edges that cross, hairlines, flipped or empty faces."""

from autopoly_env.mesh import geometry_kernels
from autopoly_env.mesh.polymesh import PolyMesh


def defects_of(mesh: PolyMesh) -> tuple[int, int]:
    """(crossings and hairlines, flipped or empty faces) as the refit counts them.

    A hairline is a pair of boundary edges that share no vertex and come closer than `CLEARANCE` without meeting: a
    corridor or a slit that shows in no picture, or two vertices as good as in one place.
    """
    topology = mesh.topology
    crossings, flipped = geometry_kernels.defects(
        mesh.vertices, topology.edges, topology.is_boundary_edge, topology.corners, topology.face_offsets
    )
    return int(crossings), int(flipped)


def is_sane(mesh: PolyMesh) -> bool:
    """Whether no edges cross, there are no hairlines, and no face is flipped or empty."""
    return defects_of(mesh) == (0, 0)
