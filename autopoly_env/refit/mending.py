"""Put a mesh right that breaks a rule of faces by a little, before it is refitted under that rule."""

import numpy as np

from autopoly_env.mesh import ASKED_TURN, FaceRule, PolyMesh, broken_faces, fits_rule
from autopoly_env.refit.refitting import Bonds, shape_arguments
from autopoly_env.refit.shape_kernels import hold_vertices

_ROUNDS = 8


def mended(mesh: PolyMesh, faces: FaceRule, bonds: Bonds | None = None) -> PolyMesh | None:
    """The mesh with vertices moved about as little as makes all faces keep the rule; None where that is not found.

    `bonds` hold, and nothing leaves the unit square that was in it. Edges may cross afterwards that did not before.
    """
    if not fits_rule(mesh.topology, faces):
        return None
    if not broken_faces(mesh, faces, ASKED_TURN):
        return mesh
    points, shape = mesh.vertices.copy(), shape_arguments(mesh.topology, faces, bonds)
    low, high = min(0.0, float(points.min())), max(1.0, float(points.max()))
    for _ in range(_ROUNDS):
        hold_vertices(points, *shape, low, high)
        made = mesh.with_vertices(points)
        if not broken_faces(made, faces, ASKED_TURN):
            return made if low <= points.min() and points.max() <= high and np.isfinite(points).all() else None
    return None
