"""A Numba kernel that writes an observation: the picture of a mesh and its padded arrays, in one call.

Letters: R pixels a side, V vertices, E edges, F faces, H corners; the arrays' sizes are fixed.
"""

import numpy as np

from autopoly_env.arrays import ByteArray, Float32Array, FloatArray, Int32Array, IntArray
from autopoly_env.compute import kernel
from autopoly_env.mesh.topology_kernels import links_in
from autopoly_env.raster.raster_kernels import Workspace, coverage_image


@kernel
def observe(
    points: FloatArray,
    packed: IntArray,
    low: float,
    high: float,
    padding: int,
    work: Workspace,
    image: FloatArray,
    rendering: ByteArray,
    places: Float32Array,
    edge_rows: Int32Array,
    corner_rows: Int32Array,
    counts: Int32Array,
) -> None:
    """Write the picture (1, R, R) of a mesh, its points, its edges, its corners with their faces, and V, E, F, H.

    `image` (R, R) is scratch. Positions are clipped to `low`..`high`; rows without an element are `padding`.
    """
    links = links_in(packed)
    edges, owners, corners = links.edges, links.owners, links.corners
    size = image.shape[0]
    coverage_image(points, links.boundary, size, work, image)
    for row in range(size):
        for column in range(size):
            share = min(max(image[row, column], 0.0), 1.0)
            rendering[0, row, column] = np.uint8(255.0 * share + 0.5)
    places[:] = padding
    for v in range(len(points)):
        for axis in range(2):
            places[2 * v + axis] = min(max(points[v, axis], low), high)
    edge_rows[:] = padding
    for e in range(len(edges)):
        edge_rows[2 * e], edge_rows[2 * e + 1] = edges[e, 0], edges[e, 1]
    corner_rows[:] = padding
    for h in range(len(corners)):
        corner_rows[2 * h], corner_rows[2 * h + 1] = owners[h], corners[h]
    counts[0], counts[1], counts[2], counts[3] = len(points), len(edges), len(links.offsets) - 1, len(corners)
