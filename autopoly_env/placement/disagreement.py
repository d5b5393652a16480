"""What separates a rendering from its target, and which boundary edges and faces are to blame for it.

Every pixel in which the two disagree is blamed on the nearest boundary edge; of an edge's blame the connected region
with most of it counts.
"""

from functools import cached_property

import numpy as np
import shapely

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.mesh import PolyMesh, defects_of
from autopoly_env.operators.evidence import Blame, Region
from autopoly_env.placement import blame_kernels
from autopoly_env.placement.blame_kernels import AREA, DEEP_X, DEEP_Y, MASS
from autopoly_env.raster import coverage, workspace
from autopoly_env.raster.raster_kernels import NO_WEIGHTS
from autopoly_env.silhouette import Silhouette

RESOLUTION = 64  # at which disagreement is looked at
THRESHOLD = 0.3  # of a pixel's coverage, above which it disagrees
_MISSING, _EXCESS = 0, 1


class Disagreement:
    """What separates a mesh's rendering from the target: the `operators.evidence.Evidence` for all that follows."""

    def __init__(self, mesh: PolyMesh, silhouette: Silhouette) -> None:
        self.mesh = mesh
        self._silhouette = silhouette

    @cached_property
    def _found(self) -> tuple[FloatArray, IntArray, int, FloatArray]:
        """Only where an operator asks: many actions do not depend on it."""
        target, topology = self._silhouette.target(RESOLUTION), self.mesh.topology
        weights = NO_WEIGHTS if target.weights is None else target.weights
        work = workspace(RESOLUTION, len(topology.boundary_half_edges))
        found: tuple[FloatArray, IntArray, int, FloatArray] = blame_kernels.disagreement_of(
            self.mesh.vertices, topology.packed, target.coverage, weights, THRESHOLD, work
        )
        return found

    @property
    def target(self) -> FloatArray:
        """(R, R) the target's coverage at R = `RESOLUTION`."""
        return self._silhouette.target(RESOLUTION).coverage

    @property
    def covered(self) -> FloatArray:
        """(R, R) the mesh's, at most 1."""
        return np.minimum(coverage(self.mesh, RESOLUTION), 1.0)

    @property
    def difference(self) -> FloatArray:
        """(R, R) the target's coverage less the mesh's, at R = `RESOLUTION`, as much as each pixel weighs."""
        return self._found[0]

    @property
    def labels(self) -> IntArray:
        """(R, R) the region of each pixel in which the two disagree, -1 for the others."""
        return self._found[1]

    @property
    def n_regions(self) -> int:
        """L, of connected pixels in which the two disagree."""
        return self._found[2]

    @property
    def blame(self) -> FloatArray:
        """(B, 2, 6) see `blame_kernels.blame_edges`; rows as `Topology.boundary_half_edges`."""
        return self._found[3]

    @cached_property
    def row_of_edge(self) -> dict[int, int]:
        """Row of `blame` by edge index."""
        arrays = self.mesh.topology.arrays
        return {edge: row for row, edge in enumerate(arrays.edge_of[arrays.rim].tolist())}

    @cached_property
    def regions(self) -> FloatArray:
        """(L, 9) see `blame_kernels.measure_regions`."""
        found: FloatArray = blame_kernels.measure_regions(self.difference, self.labels, self.n_regions)
        return found

    @cached_property
    def defects(self) -> tuple[int, int]:
        """(crossings, flipped faces) of the mesh."""
        return defects_of(self.mesh)

    @cached_property
    def most(self) -> tuple[float, float]:
        """The largest masses that an edge is to blame for: what is missing, what is too much."""
        masses = self.blame[:, :, MASS]
        return float(masses[:, _MISSING].max()), float(masses[:, _EXCESS].max())

    def missing(self, edge: int) -> Blame | None:
        """What the rendering leaves bare beside an edge; None for an edge that is not on the boundary."""
        return self._beside(edge, _MISSING)

    def excess(self, edge: int) -> Blame | None:
        """What the rendering shows too much of beside an edge; None for an edge that is not on the boundary."""
        return self._beside(edge, _EXCESS)

    def _beside(self, edge: int, side: int) -> Blame | None:
        row = self.row_of_edge.get(edge, -1)
        return None if row < 0 else Blame(*self.blame[row, side].tolist())

    def excess_in(self, face: int) -> Region | None:
        """The largest region that the rendering shows too much of and whose deepest pixel lies in the face."""
        polygon = shapely.Polygon(self.mesh.vertices[list(self.mesh.faces[face])])
        regions = self.regions[self.regions[:, AREA] < 0.0]
        if len(regions) == 0 or not polygon.is_valid:
            return None
        regions = regions[shapely.contains_xy(polygon, regions[:, DEEP_X], regions[:, DEEP_Y])]
        return Region(*regions[np.argmin(regions[:, AREA])].tolist()) if len(regions) else None
