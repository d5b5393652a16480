"""Bodies for slicers and printers: triangles in millimetres, looked at before they are written."""

from collections import Counter
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.errors import OutputError
from autopoly_env.export.formats import Export, check_size
from autopoly_env.export.solid import check_depth, to_solid, to_triangles
from autopoly_env.mesh import PolyMesh

MILLIMETRES = 100.0  # the side of the unit square, where nobody says
TOLERANCE = 1e-4  # relative, of area and volume


@dataclass(frozen=True, eq=False)
class Body:
    """A surface of triangles, x right, y up, z towards the viewer, from z = 0 upwards; places of single precision."""

    vertices: FloatArray  # (S, 3) millimetres
    triangles: IntArray  # (T, 3) counter-clockwise, seen from outside

    @property
    def corners(self) -> FloatArray:
        """(T, 3, 3) the places of the corners of each triangle."""
        return self.vertices[self.triangles]

    @property
    def volume(self) -> float:
        """Cubic millimetres, by the divergence theorem."""
        return float(np.linalg.det(self.corners).sum() / 6.0)

    @property
    def area_from_above(self) -> float:
        """Square millimetres of what looks up, less what looks down."""
        a, b, c = np.moveaxis(self.corners[:, :, :2], 1, 0)
        return 0.5 * float(np.linalg.det(np.stack((b - a, c - a), axis=1)).sum())

    @property
    def is_closed(self) -> bool:
        """Whether two triangles run along each edge, in opposite directions, once equal places are one vertex."""
        _, merged = np.unique(self.vertices, axis=0, return_inverse=True)
        runs = Counter(pair for t in merged.ravel()[self.triangles].tolist() for pair in pairwise((*t, t[0])))
        return all(n == 1 and runs[(b, a)] == 1 for (a, b), n in list(runs.items()))


def to_body(mesh: PolyMesh, depth: float = 0.0, size: float = MILLIMETRES) -> Body:
    """The mesh, `depth` units thick, with the unit square `size` millimetres wide; flat for a depth of 0.

    Raises ConfigError for a depth or a size that is none, OutputError where the body is not closed or has another
    volume (flat, another area) than the mesh: of shapes that lie upon themselves, or are too thin for single precision.
    """
    check_depth(depth)
    solid = to_solid(mesh, depth)
    places = check_size(size) * (solid.vertices + (0.0, 0.0, depth))
    body = _without_slivers(places.astype(np.float32).astype(np.float64), to_triangles(solid))
    area = size**2 * float(mesh.face_areas().sum())
    if not depth:
        _require_same("area", body.area_from_above, area, "mm²")
    elif not body.is_closed:
        raise OutputError("the solid is not watertight: walls lie on one another; give a mesh without such places")
    else:
        _require_same("volume", body.volume, area * depth * size, "mm³")
    return body


def body_of(export: Export) -> Body:
    """The last mesh of what is to be written, as `to_body` makes it."""
    return to_body(export.sequence.final(), export.depth, MILLIMETRES if export.size is None else export.size)


def _without_slivers(vertices: FloatArray, triangles: IntArray) -> Body:
    """Without triangles two corners of which lie in one place: they have no area and close nothing."""
    _, merged = np.unique(vertices, axis=0, return_inverse=True)
    a, b, c = merged.ravel()[triangles].T
    return Body(vertices, triangles[(a != b) & (b != c) & (c != a)])


def _require_same(what: str, found: float, expected: float, unit: str) -> None:
    if not abs(found - expected) <= TOLERANCE * expected:
        raise OutputError(
            f"the {what} would be {found:.6g} {unit}, expected {expected:.6g}; give a larger size or depth, "
            "or a mesh that has no faces turned over"
        )
