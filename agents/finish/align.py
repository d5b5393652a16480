"""Regular shapes: what is nearly upright, level, parallel or of equal length becomes exactly so.

Each regularity is an equation in the places of the vertices. Those that are nearly met are imposed together, the
nearest first, by Newton steps of least length, as long as the IoU loses no more than `MOST_LOST`, no defect comes of
it, and what is bound by guidance stays as it is. Then the vertices move in what freedom is left, while the IoU gains.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray
from autopoly_env.mesh import PolyMesh
from autopoly_env.simulator import MANY_VERTICES, Simulator

MOST_LOST = 0.001  # of the IoU, for all regularities together
NEAR_ANGLE = np.radians(4.0)  # within which an edge is nearly upright or level, and two are nearly parallel
NEAR_LENGTH = 0.05  # share of their length by which two edges of nearly equal length differ
NEAR_PLACE = 0.006  # distance (unit square) within which two lines are nearly one
_MOST_MOVED = 0.012  # unit square, by any vertex
_N_NEWTON = 12
_N_FITS = 20
_EXACT = 1e-11
_DEPENDENT = 1e-3  # singular value beside the largest, below which equations say the same
_LEAST_WAY = 0.05  # of a coordinate, that is left to it by what has been imposed

_Edge = tuple[int, int]


@dataclass(frozen=True)
class Regularity:
    """An equation. `kind` is "x" or "y" (the same coordinate of two vertices), "parallel" or "equal" (two edges)."""

    kind: str
    vertices: tuple[int, ...]
    off: float  # how far it is from being met, in the unit square

    def has_sides(self, points: FloatArray) -> bool:
        """Whether the edges that it is about have a length."""
        if self.kind in ("x", "y"):
            return True
        a, b, c, d = self.vertices
        return bool((points[a] != points[b]).any() and (points[c] != points[d]).any())

    def residual(self, points: FloatArray) -> tuple[float, FloatArray]:
        """(what is missing, its derivatives by `points` (V, 2))."""
        slope = np.zeros_like(points)
        if self.kind in ("x", "y"):
            a, b = self.vertices
            axis = int(self.kind == "y")
            slope[a, axis], slope[b, axis] = 1.0, -1.0
            return float(points[a, axis] - points[b, axis]), slope
        a, b, c, d = self.vertices
        u, w = points[b] - points[a], points[d] - points[c]
        long, other = float(np.hypot(*u)), float(np.hypot(*w))
        if self.kind == "equal":
            by_u, by_w, missing = u / long, -w / other, long - other
        else:
            by_u, by_w = np.array([w[1], -w[0]]) / other, np.array([-u[1], u[0]]) / long
            missing = float(u[0] * w[1] - u[1] * w[0]) / np.sqrt(long * other)
            by_u, by_w = by_u * np.sqrt(other / long), by_w * np.sqrt(long / other)
        for vertex, part in ((a, -by_u), (b, by_u), (c, -by_w), (d, by_w)):
            slope[vertex] += part
        return float(missing), slope


def aligned(simulator: Simulator, mesh: PolyMesh, wanted: Sequence[Regularity] = ()) -> PolyMesh:
    """The mesh made regular where it nearly is; itself where nothing can be done, or it has many vertices.

    What is `wanted` is imposed first, whatever it costs of the IoU, as long as no defect comes of it.
    """
    if len(mesh.vertices) > MANY_VERTICES:
        return mesh
    frame = _Frame(simulator, mesh)
    if wanted:
        frame.insist(wanted)
    frame.impose(sorted(regularities(mesh), key=lambda regularity: regularity.off))
    return frame.fitted()


def regularities(mesh: PolyMesh) -> list[Regularity]:
    """All that are nearly met: of edges, of opposite sides of quads, and of edges that lie nearly on one line."""
    points = mesh.vertices
    edges = [(int(a), int(b)) for a, b in mesh.edges]
    upright, level = _near_axis(points, edges, 0), _near_axis(points, edges, 1)
    found = [Regularity("x", edge, abs(float(points[edge[0], 0] - points[edge[1], 0]))) for edge in upright]
    found += [Regularity("y", edge, abs(float(points[edge[0], 1] - points[edge[1], 1]))) for edge in level]
    for kind, lines, axis in (("x", upright, 0), ("y", level, 1)):
        for one, other in combinations(lines, 2):
            off = abs(float(points[list(one), axis].mean() - points[list(other), axis].mean()))
            if off <= NEAR_PLACE and not set(one) & set(other):
                found.append(Regularity(kind, (one[0], other[0]), off))
    turned = set(map(frozenset, (*upright, *level)))
    for face in mesh.faces:
        if len(face) == 4:
            a, b, c, d = face
            for one, other in (((a, b), (d, c)), ((b, c), (a, d))):
                found += _of_sides(points, one, other, turned)
    return found


def _near_axis(points: FloatArray, edges: Sequence[_Edge], axis: int) -> list[_Edge]:
    """Edges along which that coordinate hardly changes."""
    ways = np.abs([points[b] - points[a] for a, b in edges])
    return [edges[k] for k in np.flatnonzero(ways[:, axis] <= np.tan(NEAR_ANGLE) * ways[:, 1 - axis]).tolist()]


def _of_sides(points: FloatArray, one: _Edge, other: _Edge, turned: set[frozenset[int]]) -> list[Regularity]:
    """What two opposite sides of a quad nearly are to each other."""
    u, w = points[one[1]] - points[one[0]], points[other[1]] - points[other[0]]
    long, short = float(np.hypot(*u)), float(np.hypot(*w))
    if not min(long, short) > 0.0:
        return []
    found = []
    sine = abs(float(u[0] * w[1] - u[1] * w[0])) / (long * short)
    if sine <= np.sin(NEAR_ANGLE) and not turned.issuperset(map(frozenset, (one, other))):
        found.append(Regularity("parallel", (*one, *other), sine * min(long, short)))
    if abs(long - short) <= NEAR_LENGTH * max(long, short):
        found.append(Regularity("equal", (*one, *other), abs(long - short)))
    return found


class _Frame:
    """A mesh and what has been imposed on it."""

    def __init__(self, simulator: Simulator, mesh: PolyMesh) -> None:
        self.mesh = mesh
        self._simulator, self._start = simulator, mesh
        self._least_iou, self._most_moved = simulator.final_score(mesh).iou - MOST_LOST, _MOST_MOVED
        self._most_off = simulator.off(mesh)
        self._imposed: list[Regularity] = []
        bonds = simulator.guidance.bonds(mesh)
        self._locked = np.zeros(len(mesh.vertices), np.bool_) if bonds is None else bonds.locked
        self._pairs = [] if bonds is None else [(i, int(j)) for i, j in enumerate(bonds.images) if 0 <= i <= j]
        self._axis = 0.0 if bonds is None else bonds.axis

    def impose(self, regularities: Sequence[Regularity]) -> None:
        """As many of them as can be, the first ones first."""
        if not regularities:
            return
        wanted = [*self._imposed, *regularities]
        points = self._met(self._start.vertices, wanted)
        if points is not None and self._iou(points) >= self._least_iou and self._may_be(points):
            self._imposed, self.mesh = wanted, self.mesh.with_vertices(points)
        elif len(regularities) > 1:
            half = len(regularities) // 2
            self.impose(regularities[:half])
            self.impose(regularities[half:])

    def insist(self, regularities: Sequence[Regularity]) -> None:
        """All of them but those that would bring a defect; then as good a fit as they allow."""
        self._least_iou, self._most_moved = 0.0, 1.0
        self.impose(regularities)
        for _ in range(_N_FITS):
            before = self.mesh
            self.mesh = self.fitted()
            if self.mesh is before:
                break
        self._start = self.mesh
        self._least_iou, self._most_moved = self._iou(self.mesh.vertices) - MOST_LOST, _MOST_MOVED

    def fitted(self) -> PolyMesh:
        """The mesh with vertices moved by fractions of a pixel while the IoU gains, as what was imposed lets them."""
        if not self._imposed:
            return self.mesh
        best, pixel = self.mesh.vertices, 1.0 / self._simulator.finest
        ways = self._free_ways(best)
        iou = self._iou(best)
        for step in (1.0, 0.5, 0.25):
            for way in (sign * step * pixel * way for way in ways for sign in (1.0, -1.0)):
                moved = best + way
                gained = self._iou(moved)
                if gained > iou and self._may_be(moved):
                    best, iou = moved, gained
        met = self._met(best, self._imposed)
        if met is not None and self._iou(met) > self._iou(self.mesh.vertices) and self._may_be(met):
            return self.mesh.with_vertices(met)
        return self.mesh

    def _free_ways(self, points: FloatArray) -> list[FloatArray]:
        """Ways (V, 2) that the vertices may go together, one for each coordinate; the longest step is 1."""
        slopes = np.array([slope for _, slope in self._equations(self._imposed, points)])
        slopes[:, self._locked] = 0.0
        flat = slopes.reshape(len(slopes), -1)
        free = np.eye(points.size) - np.linalg.pinv(flat, rcond=_DEPENDENT) @ flat
        free[np.repeat(self._locked, 2)] = 0.0
        ways: dict[bytes, FloatArray] = {}
        for way in free:
            longest = np.abs(way).max()
            if longest > _LEAST_WAY:
                scaled = way / way[np.argmax(np.abs(way) > 0.999 * longest)]
                ways[np.round(scaled, 6).tobytes()] = scaled.reshape(-1, 2)
        return list(ways.values())

    def _iou(self, points: FloatArray) -> float:
        return self._simulator.final_score(self.mesh.with_vertices(points)).iou

    def _equations(self, wanted: Sequence[Regularity], points: FloatArray) -> list[tuple[float, FloatArray]]:
        return [regularity.residual(points) for regularity in wanted] + list(self._bound(points))

    def _met(self, points: FloatArray, wanted: Sequence[Regularity]) -> FloatArray | None:
        """The places (V, 2) nearest to `points` that meet the equations; None where none are near the start."""
        for _ in range(_N_NEWTON):
            if not all(regularity.has_sides(points) for regularity in wanted):
                return None
            rows = self._equations(wanted, points)
            missing, slopes = np.array([m for m, _ in rows]), np.array([slope for _, slope in rows])
            if np.abs(missing).max() <= _EXACT:
                return _ties_made_exact(points, wanted, self._locked)
            slopes[:, self._locked] = 0.0
            step = np.linalg.lstsq(slopes.reshape(len(rows), -1), missing, rcond=_DEPENDENT)[0]
            points = points - step.reshape(-1, 2)
            if np.abs(points - self._start.vertices).max() > self._most_moved:
                return None
        return None

    def _bound(self, points: FloatArray) -> list[tuple[float, FloatArray]]:
        """The equations of the mirror."""
        rows = []
        for i, j in self._pairs:
            for axis, sign in ((0, 1.0), (1, -1.0)):
                slope = np.zeros_like(points)
                slope[i, axis] += 1.0
                slope[j, axis] += sign
                missing = points[i, axis] + sign * points[j, axis] - (2.0 * self._axis if axis == 0 else 0.0)
                rows.append((float(missing), slope))
        return rows

    def _may_be(self, points: FloatArray) -> bool:
        """Whether the vertices may lie there, whatever the IoU."""
        if ((points < 0.0) | (points > 1.0)).any():
            return False
        mesh = self.mesh.with_vertices(points)
        return self._simulator.is_sane(mesh) and self._simulator.off(mesh) <= self._most_off


def _ties_made_exact(points: FloatArray, wanted: Sequence[Regularity], locked: BoolArray) -> FloatArray:
    """Coordinates that are tied to each other the same to the last bit: their mean, or that of a locked vertex."""
    exact = points.copy()
    for axis, kind in enumerate("xy"):
        group = np.arange(len(points))
        for regularity in wanted:
            if regularity.kind == kind:
                a, b = regularity.vertices
                group[group == group[a]] = group[b]
        for name in np.unique(group):
            tied = group == name
            if tied.sum() > 1:
                held = tied & locked
                exact[tied, axis] = points[held if held.any() else tied, axis].mean()
    return exact
