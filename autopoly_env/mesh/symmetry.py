"""Left and right alike: points in a mirror, and which boundary vertices are each other's mirror images.

Letters: V vertices. The mirror is the vertical line x = axis; an outline is symmetric if its image in the mirror is the
same outline.
"""

from functools import lru_cache

import numpy as np

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.mesh.polymesh import PolyMesh

TOLERANCE = 1e-6  # of a position in the unit square; a refit makes symmetric outlines exact


def mirrored(points: FloatArray, axis: float) -> FloatArray:
    """The mirror images of points (..., 2)."""
    return points * (-1.0, 1.0) + (2.0 * axis, 0.0)


@lru_cache(maxsize=256)
def images_of(mesh: PolyMesh, axis: float) -> IntArray | None:
    """(V,) the mirror image of each boundary vertex, -1 for the others; None if the outline is not symmetric.

    Every boundary loop, run backwards, has to be the image of a loop, vertex for vertex to `TOLERANCE`.
    """
    images = np.full(len(mesh.vertices), -1, np.int64)
    loops = list(mesh.topology.boundary_loops)
    left = list(loops)
    while left:
        loop = left[0]
        found = _image_of_loop(mesh.vertices, loop, left, axis)
        if found is None:
            return None
        other, partners = found
        left = [rest for rest in left[1:] if rest is not other]
        for one, two in ((loop, partners), (partners, loop)):
            known = images[one]
            images[one] = two
            if ((known >= 0) & (known != two)).any() or (images[one] != two).any():
                return None  # at a pinch, where the loops disagree
    images.flags.writeable = False
    return images


def middle_of(mesh: PolyMesh) -> float:
    """x of the middle of the box around the mesh: the only axis that it can be symmetric about."""
    return 0.5 * float(mesh.vertices[:, 0].min() + mesh.vertices[:, 0].max())


def axis_of(mesh: PolyMesh) -> float | None:
    """x of the axis about which the outline is its own mirror image; None where it is not."""
    axis = middle_of(mesh)
    return None if images_of(mesh, axis) is None else axis


def _image_of_loop(
    vertices: FloatArray, loop: IntArray, loops: list[IntArray], axis: float
) -> tuple[IntArray, IntArray] | None:
    """The loop that is the image of another, and the image of each of that one's vertices."""
    wanted = mirrored(vertices[loop], axis)
    best, least = None, TOLERANCE
    for other in loops:
        if len(other) != len(loop):
            continue
        backwards = other[::-1]
        for shift in np.flatnonzero(np.abs(vertices[backwards] - wanted[0]).max(axis=1) <= TOLERANCE).tolist():
            partners = np.concatenate((backwards[shift:], backwards[:shift]))
            distance = float(np.abs(vertices[partners] - wanted).max())
            if distance <= least:
                best, least = (other, partners), distance
    return best
