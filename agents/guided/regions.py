"""Where in the picture an action works: points to read a predicted region image at, and the true region image.

Every action has `N_POINTS` points. An edge: along it. A vertex: the vertex itself, many times. A corner: from the
vertex towards the middle of its face. A face, and a hole in one: around the face, drawn towards its middle.

Letters: A actions, P points of each, S pixels a side.
"""

from collections.abc import Sequence

import numpy as np

from agents.guided.pictures import Picture
from autopoly_env.arrays import FloatArray
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import STOP, Action, operator_named
from autopoly_env.raster import Batch, coverage_of_batch

N_POINTS = 8
_WIDTH = 0.03  # unit square: distance from an element at which its region has fallen to exp(-1/2)
_CORNER_REACH = 0.6  # share of the way from a corner to the middle of its face
_FACE_PULL = 0.4  # share of the way from a face's border to its middle
_ALONG = (np.arange(N_POINTS) + 0.5)[:, None] / N_POINTS


def action_points(mesh: PolyMesh, actions: Sequence[Action]) -> FloatArray:
    """(A, P, 2) points of each action's element, unit square."""
    points = np.empty((len(actions), N_POINTS, 2))
    of_face: dict[int, FloatArray] = {}
    for row, action in enumerate(actions):
        base, element = _place(action)
        if base == "face":
            if element not in of_face:
                of_face[element] = _face_points(mesh, element)
            points[row] = of_face[element]
        else:
            first, last = _segment(mesh, base, element)
            points[row] = first + _ALONG * (last - first)
    return points


def region_image(mesh: PolyMesh, action: Action, size: int) -> Picture:
    """(S, S) the region of an action: a face's coverage, else a soft band about the edge, vertex or corner.

    All 0 for STOP, which works nowhere.
    """
    if action == STOP:
        return np.zeros((size, size), np.float32)
    base, element = _place(action)
    if base == "face":
        return _face_coverage(mesh.vertices[list(mesh.faces[element])], size)
    first, last = _segment(mesh, base, element)
    return _band(first, last, size)


def _place(action: Action) -> tuple[str, int]:
    """What an action's element lies at, of the mesh's own: "vertex", "edge", "face" or "corner", and its index."""
    kind = operator_named(action.operator).element
    return kind.base, kind.place(action.element)


def _segment(mesh: PolyMesh, base: str, element: int) -> tuple[FloatArray, FloatArray]:
    """The ends of the straight line that stands for an edge, vertex or corner."""
    if base == "edge":
        first, last = mesh.vertices[mesh.edges[element]]
        return first, last
    if base == "vertex":
        return mesh.vertices[element], mesh.vertices[element]
    f, i = mesh.topology.corner(element)
    face = mesh.faces[f]
    corner, middle = mesh.vertices[face[i]], mesh.vertices[list(face)].mean(axis=0)
    return corner, corner + _CORNER_REACH * (middle - corner)


def _face_points(mesh: PolyMesh, face: int) -> FloatArray:
    """(P, 2) even steps around the face, each drawn towards its middle."""
    ring = mesh.vertices[list(mesh.faces[face])]
    ring = np.concatenate((ring, ring[:1]))
    length = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(ring, axis=0).T))))
    at = length[-1] * np.arange(N_POINTS) / N_POINTS
    around = np.column_stack([np.interp(at, length, ring[:, axis]) for axis in (0, 1)])
    return around + _FACE_PULL * (ring[:-1].mean(axis=0) - around)


def _face_coverage(ring: FloatArray, size: int) -> Picture:
    own = np.arange(len(ring))
    ends = np.array([0, len(ring)])
    covered = coverage_of_batch(Batch(ring, np.column_stack((own, np.roll(own, -1))), ends, ends), size)[0]
    return np.clip(covered, 0.0, 1.0).astype(np.float32)


def _band(first: FloatArray, last: FloatArray, size: int) -> Picture:
    """exp(-d^2 / 2 w^2) of the distance d of each pixel's centre from the segment."""
    centres = (np.arange(size) + 0.5) / size
    x, y = np.meshgrid(centres - first[0], centres - first[1])
    dx, dy = last - first
    share = np.clip((x * dx + y * dy) / max(dx * dx + dy * dy, 1e-12), 0.0, 1.0)
    square = (x - share * dx) ** 2 + (y - share * dy) ** 2
    return np.exp(-square / (2.0 * _WIDTH**2)).astype(np.float32)
