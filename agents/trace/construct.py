"""Tell a set of rings as a construction: the outline coarse to fine, then each hole, then each further part.

Every prefix is a mesh without crossings. The outline is peeled down to a quad, one vertex at a time, and the peeling is
run backwards as subdivisions. A hole is cut as a triangle or quad with two bridges and refined likewise. A further part
is two extrusions, the second of which stays when the first is deleted.
"""

from collections.abc import Iterator, Sequence

import numpy as np
import shapely

from agents.trace.peel_kernels import peel
from agents.trace.rings import Ring
from autopoly_env.arrays import FloatArray
from autopoly_env.errors import AutoPolyError, IllegalActionError
from autopoly_env.mesh import PolyMesh, is_sane
from autopoly_env.operators import OPERATORS, Action, Choice, HoleChoice, plan_hole
from autopoly_env.simulator import Simulator, State

_N_NATURAL_TRIES = 200  # ways to grow a further part out of the mesh that are tried before it is put in place at once


class UnbuildableError(AutoPolyError):
    """A ring that the operators cannot reach without crossings."""


class Builder:
    """The states of a construction in the making. Raises UnbuildableError for a start mesh that crosses itself."""

    def __init__(self, simulator: Simulator, start: PolyMesh) -> None:
        if not is_sane(start, simulator.faces):
            raise UnbuildableError("the main outline crosses itself")
        self.simulator = simulator
        self.states = [State(start, simulator.score(start), n_refits=0)]

    @property
    def mesh(self) -> PolyMesh:
        return self.states[-1].mesh

    def attempt(self, name: str, element: int, choice: Choice | None, moves: dict[int, FloatArray]) -> PolyMesh | None:
        """The mesh after an operator and `moves` (vertex id to position), if it is legal and sane."""
        try:
            made = OPERATORS[name].apply(self.mesh, element, choice)
        except IllegalActionError:
            return None
        vertices = made.vertices.copy()
        for vertex_id, position in moves.items():
            vertices[made.vertex_index(vertex_id)] = position
        moved = made.with_vertices(vertices)
        return moved if is_sane(moved, self.simulator.faces) else None

    def do(
        self, name: str, element: int, choice: Choice | None = None, moves: dict[int, FloatArray] | None = None
    ) -> None:
        """Take the step, or raise UnbuildableError."""
        mesh = self.attempt(name, element, choice, moves or {})
        if mesh is None:
            raise UnbuildableError(f"{name} on element {element} leaves a crossing")
        if choice is None:
            choice = OPERATORS[name].choose(self.mesh, element)
        step = self.states[-1].step + 1
        action = Action(name, element)
        self.states.append(State(mesh, self.simulator.score(mesh), step, "", action, choice, n_refits=0))

    def edge(self, a: int, b: int) -> int:
        """Index of the edge between two vertex ids."""
        return self.mesh.edge_index(self.mesh.vertex_index(a), self.mesh.vertex_index(b))


def construct(simulator: Simulator, rings: Sequence[Ring]) -> list[State]:
    """The states that build as many of the rings as the simulator's operators allow; `rings[0]` is the main outline.

    A ring that cannot be built without a crossing is left out; UnbuildableError is raised where that is the main one.
    """
    main = rings[0].points
    order, coarse = _peeled(main, np.empty((0, 4)), [], 4)
    if len(coarse) == 3:
        builder = _begin_with_triangle(simulator, main)
    else:
        builder = Builder(simulator, PolyMesh.from_faces(main[coarse], [tuple(range(len(coarse)))]))
        _refine(builder, main, order, coarse, list(range(len(coarse))))
    _cut_holes(builder, [r.points for r in rings if r.parent == 0])
    for index, ring in enumerate(rings):
        if index > 0 and not ring.is_hole:
            kept = len(builder.states)
            try:
                _add_part(builder, ring.points)
            except UnbuildableError:
                del builder.states[kept:]
                continue
            _cut_holes(builder, [r.points for r in rings if r.parent == index])
    return builder.states


def _peeled(points: FloatArray, walls: FloatArray, locked: Sequence[int], n_keep: int) -> tuple[list[int], list[int]]:
    """(indices to drop in order, indices left in the polygon's order)."""
    mask = np.zeros(len(points), np.bool_)
    mask[list(locked)] = True
    order = peel(np.ascontiguousarray(points), walls, mask, min(n_keep, len(points))).tolist()
    return order, [i for i in range(len(points)) if i not in set(order)]


def _refine(builder: Builder, points: FloatArray, order: list[int], coarse: list[int], ids: list[int]) -> None:
    """Subdivide back in, last dropped first, what was peeled off; `ids` are the vertex ids of `coarse`."""
    id_of = dict(zip(coarse, ids, strict=True))
    for index in reversed(order):
        present = sorted(id_of)
        below = [i for i in present if i < index]
        above = [i for i in present if i > index]
        before, after = (below or present)[-1], (above or present)[0]
        new_id = builder.mesh.next_vertex_id
        edge = builder.edge(id_of[before], id_of[after])
        builder.do("edge_subdivide", edge, moves={new_id: points[index]})
        id_of[index] = new_id


def _begin_with_triangle(simulator: Simulator, points: FloatArray) -> Builder:
    """A triangle: a quad with one corner in the middle of an edge, which then goes."""
    corners = np.insert(points, 1, 0.5 * (points[0] + points[1]), axis=0)
    builder = Builder(simulator, PolyMesh.from_faces(corners, [(0, 1, 2, 3)]))
    if "vertex_dissolve" in simulator.operators:
        builder.do("vertex_dissolve", 1)
    return builder


def _cut_holes(builder: Builder, holes: Sequence[FloatArray]) -> None:
    """Cut the holes that can be cut, the largest first; try the others again with what has been cut to tie them to."""
    if "face_hole" not in builder.simulator.operators:
        return
    waiting, n_before = [hole[::-1] for hole in holes], len(holes) + 1  # wound as faces
    while len(waiting) < n_before:
        failed = []
        for k, hole in enumerate(waiting):
            kept = len(builder.states)
            try:
                _cut_hole(builder, hole, waiting[k + 1 :])
            except UnbuildableError:
                del builder.states[kept:]
                failed.append(hole)
        waiting, n_before = failed, len(waiting)


def _cut_hole(builder: Builder, hole: FloatArray, others: Sequence[FloatArray]) -> None:
    face = _face_around(builder.mesh, hole)
    plan = plan_hole(builder.mesh, face, hole, obstacles=others)
    if plan is None:
        raise UnbuildableError("no two bridges reach the hole")
    ring = builder.mesh.vertices[list(builder.mesh.faces[face])]
    bridges = [np.concatenate((ring[i], hole[j])) for i, j in plan.bridges]
    walls = np.vstack([_segments_of(builder.mesh), bridges, *map(_ring_segments, others)])
    order, coarse = _peeled(hole, walls, [j for _, j in plan.bridges], 4)
    if len(coarse) > 4:
        raise UnbuildableError("the hole cannot be coarsened to a quad")
    (f, h), (g, i) = plan.bridges
    points = tuple((float(x), float(y)) for x, y in hole[coarse])
    choice = HoleChoice(points, ((f, coarse.index(h)), (g, coarse.index(i))))
    first = builder.mesh.next_vertex_id
    builder.do("face_hole", 2 * face + len(coarse) - 3, choice)
    _refine(builder, hole, order, coarse, list(range(first, first + len(coarse))))


def _face_around(mesh: PolyMesh, hole: FloatArray) -> int:
    polygon = shapely.Polygon(hole)
    for face, cycle in enumerate(mesh.faces):
        if shapely.Polygon(mesh.vertices[list(cycle)]).contains(polygon):
            return face
    raise UnbuildableError("the hole lies in no single face")


def _segments_of(mesh: PolyMesh) -> FloatArray:
    """(E, 4) the mesh's edges."""
    return mesh.vertices[mesh.edges].reshape(-1, 4)


def _ring_segments(points: FloatArray) -> FloatArray:
    return np.hstack((points, np.roll(points, -1, axis=0)))


def _add_part(builder: Builder, points: FloatArray) -> None:
    """A part of its own: extrude twice, delete the quad between, refine."""
    operators = builder.simulator.operators
    if "edge_extrude" not in operators or "face_delete" not in operators:
        raise UnbuildableError("further parts need edge_extrude and face_delete")
    order, coarse = _peeled(points, _segments_of(builder.mesh), [], 4)
    triangle = len(coarse) == 3
    if len(coarse) > 4 or (triangle and "vertex_dissolve" not in operators):
        raise UnbuildableError("the part cannot be coarsened to a quad")
    quad = np.insert(points, 1, 0.5 * (points[0] + points[1]), axis=0) if triangle else points[coarse]
    ids = grow_quad(builder, quad)
    if triangle:
        builder.do("vertex_dissolve", builder.mesh.vertex_index(ids[1]))
    else:
        _refine(builder, points, order, coarse, ids)


def grow_quad(builder: Builder, quad: FloatArray) -> list[int]:
    """Make `quad` (4, 2) a part of its own; return the ids of its vertices in its order."""
    kept = len(builder.states)
    for a, b, turn in _ways_to_grow(builder.mesh, quad):
        corners = np.roll(quad, -turn, axis=0)  # corner 0 is joined to b, corner 1 to a
        first = builder.mesh.next_vertex_id
        # An extrusion of a-b makes the quad b, a, a', b'; a' = first, b' = first + 1.
        near = {first: corners[1], first + 1: corners[0]}
        far = {first + 2: corners[2], first + 3: corners[3]}
        if builder.attempt("edge_extrude", builder.edge(a, b), None, near) is None:
            continue
        builder.do("edge_extrude", builder.edge(a, b), None, near)
        if builder.attempt("edge_extrude", builder.edge(first, first + 1), None, far) is not None:
            builder.do("edge_extrude", builder.edge(first, first + 1), None, far)
            builder.do("face_delete", len(builder.mesh.faces) - 2)
            return np.roll([first + 1, first, first + 2, first + 3], turn).tolist()
        del builder.states[kept:]
    return _place_quad(builder, quad)


def _ways_to_grow(mesh: PolyMesh, quad: FloatArray) -> Iterator[tuple[int, int, int]]:
    """(vertex ids of a boundary edge, turn of the quad), the closest pairs of edges first."""
    ends = mesh.vertices[mesh.topology.boundary_half_edges]
    ways = []
    for turn in range(4):
        corners = np.roll(quad, -turn, axis=0)
        gap = np.hypot(*(ends[:, 0] - corners[1]).T) + np.hypot(*(ends[:, 1] - corners[0]).T)
        ways += [(distance, row, turn) for row, distance in enumerate(gap.tolist())]
    for _, row, turn in sorted(ways)[:_N_NATURAL_TRIES]:
        a, b = mesh.topology.boundary_half_edges[row].tolist()
        yield mesh.vertex_ids[a], mesh.vertex_ids[b], turn


def _place_quad(builder: Builder, quad: FloatArray) -> list[int]:
    """As `grow_quad` where nothing can be seen from the mesh: extrude two slivers, then move the second in place."""
    ends = builder.mesh.vertices[builder.mesh.topology.boundary_half_edges]
    longest = int(np.argmax(np.hypot(*(ends[:, 1] - ends[:, 0]).T)))
    a, b = builder.mesh.topology.boundary_half_edges[longest].tolist()
    first = builder.mesh.next_vertex_id
    builder.do("edge_extrude", builder.mesh.edge_index(a, b))
    builder.do("edge_extrude", builder.edge(first, first + 1))
    ids = [first + 1, first, first + 2, first + 3]
    builder.do("face_delete", len(builder.mesh.faces) - 2, None, dict(zip(ids, quad, strict=True)))
    return ids
