"""Where an action's new vertices start: at what the rendering still misses, or shows too much of.

A refit finds the nearest optimum, so it matters where a new vertex begins. Every pixel in which rendering and target
disagree is blamed on the nearest boundary edge; the connected region with most of an edge's blame says how far to pull
a subdivided edge out or in, how wide and deep to extrude it, and where a face wants a hole.
"""

from collections.abc import Iterator
from functools import cached_property

import numpy as np
import shapely

from autopoly_env.arrays import FloatArray
from autopoly_env.errors import IllegalActionError
from autopoly_env.mesh import PolyMesh, defects_of
from autopoly_env.operators import HOLE_SIDES, OPERATORS, Action, Choice, HoleChoice, n_elements, plan_hole
from autopoly_env.placement import blame_kernels as placement_kernels
from autopoly_env.placement.blame_kernels import (
    AREA,
    COV_XY,
    DEEP_X,
    DEEP_Y,
    DEPTH,
    FAR_X,
    FAR_Y,
    HIGH,
    LOW,
    MASS,
    MEAN_X,
    MEAN_Y,
    RADIUS,
    VAR_X,
    VAR_Y,
)
from autopoly_env.raster import coverage
from autopoly_env.silhouette import Silhouette

RESOLUTION = 64  # at which disagreement is looked at
THRESHOLD = 0.3  # of a pixel's coverage, above which it disagrees
_SHRINKING = (1.0, 0.7, 0.4, 0.15)  # shares of a proposed move, tried until the mesh stays sane
_MISSING, _EXCESS = 0, 1

Start = tuple[Choice | None, PolyMesh]


class Disagreement:
    """What separates a mesh's rendering from the target, and which boundary edges and faces are to blame."""

    def __init__(self, mesh: PolyMesh, silhouette: Silhouette) -> None:
        self.mesh = mesh
        covered = np.minimum(coverage(mesh, RESOLUTION), 1.0)
        target = silhouette.target(RESOLUTION)
        self.difference: FloatArray = target.coverage - covered
        if target.weights is None:
            self.labels, self.n_regions = placement_kernels.regions_of(self.difference, THRESHOLD)
        else:  # what weighs nothing is no reason to act; the rest counts as much as it weighs
            seen = np.where(target.weights > 0.0, self.difference, 0.0)
            self.labels, self.n_regions = placement_kernels.regions_of(seen, THRESHOLD)
            self.difference = self.difference * target.weights

    @cached_property
    def blame(self) -> FloatArray:
        """(B, 2, 6) see `placement_kernels.blame_edges`; rows as `Topology.boundary_half_edges`."""
        edges = self.mesh.topology.boundary_half_edges
        table: FloatArray = placement_kernels.blame_edges(
            self.mesh.vertices, edges, self.difference, self.labels, self.n_regions
        )
        return table

    @cached_property
    def row_of_edge(self) -> dict[int, int]:
        """Row of `blame` by edge index."""
        directed = self.mesh.topology.boundary_half_edges.tolist()
        return {self.mesh.edge_index(a, b): row for row, (a, b) in enumerate(directed)}

    @cached_property
    def regions(self) -> FloatArray:
        """(L, 9) see `placement_kernels.measure_regions`."""
        found: FloatArray = placement_kernels.measure_regions(self.difference, self.labels, self.n_regions)
        return found

    @cached_property
    def defects(self) -> tuple[int, int]:
        """(crossings, flipped faces) of the mesh."""
        return defects_of(self.mesh)

    def excess_in(self, face: int) -> FloatArray | None:
        """The largest region (9,) that the rendering shows too much of and whose deepest pixel lies in the face."""
        polygon = shapely.Polygon(self.mesh.vertices[list(self.mesh.faces[face])])
        regions = self.regions[self.regions[:, AREA] < 0.0]
        if len(regions) == 0 or not polygon.is_valid:
            return None
        regions = regions[shapely.contains_xy(polygon, regions[:, DEEP_X], regions[:, DEEP_Y])]
        return regions[np.argmin(regions[:, AREA])] if len(regions) else None


def starts(disagreement: Disagreement, action: Action) -> list[Start]:
    """The meshes from which to refit after `action`, each with the operator's choice that made it: one or more.

    None has more crossings or flipped faces than the operator's own result. Raises IllegalActionError as the operator.
    """
    mesh, operator = disagreement.mesh, OPERATORS[action.operator]
    if not 0 <= action.element < n_elements(mesh, operator.element):
        operator.apply(mesh, action.element)  # raises
    if action.operator == "face_hole":
        hole = _hole_choice(disagreement, action.element)
        return [(hole, operator.apply(mesh, action.element, hole))]
    choice = operator.choose(mesh, action.element)
    plain = operator.apply(mesh, action.element, choice)
    row = disagreement.row_of_edge.get(action.element, -1)
    if row < 0 or action.operator not in ("edge_subdivide", "edge_extrude"):
        return [(choice, plain)]
    if action.operator == "edge_subdivide":
        moved = _pull_vertex(disagreement, plain, row)
    else:
        moved = _stretch_quad(disagreement, plain, row)
    return [(choice, start) for start in (*moved, plain)]


def _pull_vertex(disagreement: Disagreement, plain: PolyMesh, row: int) -> Iterator[PolyMesh]:
    """The new vertex at the far end of what is missing beside the edge and of what is too much, the larger first."""
    for entry in sorted(disagreement.blame[row], key=lambda side: -float(side[MASS])):
        if entry[MASS] > 0.0:
            yield from _sane_move(disagreement, plain, entry[[FAR_X, FAR_Y]][None])


def _stretch_quad(disagreement: Disagreement, plain: PolyMesh, row: int) -> Iterator[PolyMesh]:
    """The new edge across the far end of the missing region that the edge answers for, as wide as the region."""
    entry = disagreement.blame[row, _MISSING]
    if entry[MASS] == 0.0:
        return
    a, b = disagreement.mesh.vertices[disagreement.mesh.topology.boundary_half_edges[row]]
    along = b - a
    outward = np.array([along[1], -along[0]]) / np.hypot(*along)
    middle, half = 0.5 * (entry[LOW] + entry[HIGH]), max(0.05, 0.5 * (entry[HIGH] - entry[LOW]))
    corners = [a + s * along + entry[DEPTH] * outward for s in (middle - half, middle + half)]
    yield from _sane_move(disagreement, plain, np.array(corners))


def _sane_move(disagreement: Disagreement, plain: PolyMesh, goal: FloatArray) -> Iterator[PolyMesh]:
    """The last len(goal) vertices moved to `goal`, or as far towards it as leaves no new crossing or flip."""
    n = len(goal)
    for share in _SHRINKING:
        vertices = plain.vertices.copy()
        vertices[-n:] += share * (goal - vertices[-n:])
        moved = plain.with_vertices(vertices)
        crossings, flipped = defects_of(moved)
        if crossings <= disagreement.defects[0] and flipped <= disagreement.defects[1]:
            yield moved
            return


def _hole_choice(disagreement: Disagreement, element: int) -> HoleChoice | None:
    """A hole over the largest excess in the face; where that does not fit, or there is none, the operator's own."""
    face, n_sides = element // len(HOLE_SIDES), HOLE_SIDES[element % len(HOLE_SIDES)]
    region = disagreement.excess_in(face)
    if region is not None:
        for points in hole_shapes(region, n_sides):
            planned = plan_hole(disagreement.mesh, face, points)
            if planned is not None:
                return planned
    choice = OPERATORS["face_hole"].choose(disagreement.mesh, element)
    if not isinstance(choice, HoleChoice):
        raise IllegalActionError(f"face_hole cannot work on face {face}: no hole with two bridges fits into it")
    return choice


def hole_shapes(region: FloatArray, n_sides: int) -> Iterator[FloatArray]:
    """Holes to try: one with the region's principal axes, then a regular one in its inscribed circle."""
    moments = np.array([[region[VAR_X], region[COV_XY]], [region[COV_XY], region[VAR_Y]]])
    spread, axes = np.linalg.eigh(moments)
    unit = _BOX if n_sides == 4 else _TRIANGLE
    yield _wound(region[[MEAN_X, MEAN_Y]] + 0.9 * unit * np.sqrt(3.0 * np.maximum(spread, 1e-6)) @ axes.T)
    angles = 2.0 * np.pi * np.arange(n_sides) / n_sides
    around = np.column_stack((np.cos(angles), np.sin(angles)))
    yield region[[DEEP_X, DEEP_Y]] + 0.8 * region[RADIUS] * around


_BOX = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
_TRIANGLE = np.array([(-1.0, -0.7), (1.0, -0.7), (0.0, 1.2)])


def _wound(ring: FloatArray) -> FloatArray:
    """The ring with positive shoelace area."""
    x, y = ring.T
    return ring if x @ np.roll(y, -1) > y @ np.roll(x, -1) else ring[::-1]


def leaves_outline_alone(mesh: PolyMesh, action: Action) -> bool:
    """Whether the action changes nothing that shows in the rendering, so that a refit has nothing to gain."""
    if action.operator in ("face_split", "edge_dissolve"):
        return True
    return action.operator == "edge_subdivide" and not bool(mesh.topology.is_boundary_edge[action.element])
