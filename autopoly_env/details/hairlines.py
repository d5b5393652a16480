"""Hairlines: parts that are apart in the picture and joined in the mesh by what nobody sees, and rings that are slit.

A corridor of no width between two parts saves a face and shows in no pixel; so does a slit from a hole to the outside.
"""

from autopoly_env.arrays import FloatArray
from autopoly_env.details import hairline_kernels
from autopoly_env.mesh import PolyMesh
from autopoly_env.silhouette import Target

FINEST = 256  # pixels a side, for the widths below: on finer pictures they are no narrower
_WIDTH = 1.5  # pixels: what is narrower has to be in the picture
_LEAST = 0.125  # pixels: what is narrower does not show, whatever the picture has


def hairlines(mesh: PolyMesh, target: Target) -> int:
    """Boundary edges of a mesh beside a corridor or a slit that is narrower than 1.5 pixels and not in the target.

    Asked for is the target at the picture's own resolution. Corridors and slits narrower than an eighth of a pixel
    count in any case: `mesh.is_sane` knows no picture, and refuses what is narrower still.
    """
    rim = mesh.topology.boundary_half_edges
    return int(hairline_kernels.count_hairlines(mesh.vertices, rim, *hairline_arguments(target)))


def hairline_arguments(target: Target) -> tuple[FloatArray, float, float]:
    """What `hairline_kernels.count_hairlines` is to be called with for a target: its coverage, and two widths."""
    pixel = 1.0 / min(target.resolution, FINEST)
    return target.coverage, _WIDTH * pixel, _LEAST * pixel
