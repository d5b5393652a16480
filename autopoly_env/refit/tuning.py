"""The last touch on a mesh: vertices move by fractions of a pixel as long as the IoU itself gains."""

import numpy as np

from autopoly_env.mesh import ASKED_TURN, FaceRule, PolyMesh
from autopoly_env.raster import pixels_of, workspace
from autopoly_env.refit.refitting import Bonds
from autopoly_env.refit.tuning_kernels import tune as tune_in_place
from autopoly_env.silhouette import Target


def tune(mesh: PolyMesh, target: Target, bonds: Bonds | None = None, faces: FaceRule = "any") -> PolyMesh:
    """The mesh with boundary vertices moved by pattern search (Hooke and Jeeves 1961), steps of 2 to 1/4 pixel.

    Its IoU with the target is as large or larger; there are no new crossings, flipped faces or faces that break the
    rule `faces`, vertices in the unit square stay in it, and `bonds` hold.
    """
    points = mesh.vertices.copy()
    images = np.full(len(points), -1, np.int64)
    if bonds is not None:
        images = np.where(bonds.locked, -2, bonds.images)
    tune_in_place(
        points,
        mesh.topology.packed,
        images,
        0.5 if bonds is None else bonds.axis,
        0.0 if faces == "any" else ASKED_TURN,
        pixels_of(target),
        float(target.n_filled),
        workspace(target.resolution, len(mesh.topology.boundary_half_edges)),
    )
    return mesh.with_vertices(points)
