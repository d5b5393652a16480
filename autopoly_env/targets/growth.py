"""How a random construction grows: an action that shows in the outline, then every vertex moved, then the next.

Lengths are in extents, the longer side of the mesh's bounding box, unless they say otherwise: a shape is put into the
picture when it is finished.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from autopoly_env.arrays import FloatArray
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import HOLE_SIDES, OPERATORS, Action, Choice, HoleChoice, plan_hole
from autopoly_env.raster import workspace
from autopoly_env.targets import construction_kernels
from autopoly_env.targets.construction_kernels import clearance
from autopoly_env.targets.dice import Dice

# What can change the outline by itself. `face_split` cannot: it comes with a `face_delete` of one of the two parts.
OUTLINE_OPERATORS = ("edge_subdivide", "edge_extrude", "face_delete", "face_hole", "vertex_dissolve")
N_DRAWS = 40  # actions drawn for a step before the construction is given up
N_SHAKES = 6  # random translations tried for an action, each a little smaller
N_POINTS = 12  # tried for the middle of a hole
SHAKE = 0.05  # how far a translation takes a vertex, in square roots of the shape's area

MIN_GAP = 0.05  # between edges that do not meet: 2 pixels at 64 x 64 in the smallest shape
MIN_LENGTH = 0.08  # of an edge
MIN_BEND = 0.035  # of a corner of the outline from the line between its neighbours
MAX_COSINE = 0.92  # of the angle between edges that meet: 23 degrees
MIN_AREA = 0.2  # of the shape, in square extents
OVERLAP_RESOLUTION = 32  # pixels a side of the picture that shows whether faces overlap


class Grown(NamedTuple):
    """A step: an action, what was left free by it, and the mesh after it and a random translation."""

    action: Action
    choice: Choice | None
    mesh: PolyMesh


def grow(dice: Dice, operators: Sequence[str], n_changes: int) -> tuple[PolyMesh, list[Grown]] | None:
    """A random rectangle and the steps from it, with `n_changes` of the outline; None where it grew into a corner.

    No two changes leave outlines with the same number of loops and corners, so that none undoes another.
    """
    mesh = start = _rectangle(dice)
    outlines, steps = {_outline(mesh)}, list[Grown]()
    useful = [operator for operator in operators if operator in OUTLINE_OPERATORS]
    if {"face_split", "face_delete"} <= set(operators):
        useful.append("face_split")
    for _ in range(n_changes):
        change = _change(dice, useful, mesh, outlines)
        if not change:
            return None
        steps += change
        mesh = steps[-1].mesh
        outlines.add(_outline(mesh))
    return start, steps


def _rectangle(dice: Dice) -> PolyMesh:
    """A rectangle in the unit square, up to 10 degrees from upright."""
    width, height = dice.between(0.25, 0.6), dice.between(0.25, 0.6)
    x, y, turn = dice.between(0.4, 0.6), dice.between(0.4, 0.6), np.radians(dice.between(-10.0, 10.0))
    along = np.array([np.cos(turn), np.sin(turn)])
    across = np.array([-along[1], along[0]])
    corners = [(x, y) + 0.5 * (i * width * along + j * height * across) for i, j in _CORNERS]
    return PolyMesh.from_faces(corners, [(0, 1, 2, 3)])


_CORNERS = ((-1, -1), (1, -1), (1, 1), (-1, 1))


def _outline(mesh: PolyMesh) -> tuple[int, ...]:
    """The number of corners of each loop of the outline."""
    ends = mesh.topology.arrays.loop_ends.tolist()
    return tuple(sorted(end - begin for begin, end in pairwise((0, *ends))))


def _change(dice: Dice, operators: Sequence[str], mesh: PolyMesh, outlines: set[tuple[int, ...]]) -> list[Grown]:
    """One or two steps that leave an outline not in `outlines`; none if no drawn action can."""
    for _ in range(N_DRAWS):
        operator = dice.pick(operators)
        if operator == "face_split":
            change = _split_and_delete(dice, mesh, outlines)
        else:
            step = _step(dice, operator, mesh, outlines)
            change = [step] if step else []
        if change:
            return change
    return []


def _split_and_delete(dice: Dice, mesh: PolyMesh, outlines: set[tuple[int, ...]]) -> list[Grown]:
    """A face split, and one of the two parts deleted; nothing if that fails."""
    split = _step(dice, "face_split", mesh, set())
    if split is None:
        return []
    face, _ = mesh.topology.corner(split.action.element)
    rest = _step(dice, "face_delete", split.mesh, outlines, dice.pick((face, len(mesh.faces))))
    return [split, rest] if rest else []


def _step(
    dice: Dice, operator: str, mesh: PolyMesh, outlines: set[tuple[int, ...]], element: int | None = None
) -> Grown | None:
    """A step on `element`, by default a random legal one; None if it fails."""
    legal = np.flatnonzero(OPERATORS[operator].legal_mask(mesh)).tolist()
    if not legal:
        return None
    action = Action(operator, dice.pick(legal) if element is None else element)
    is_hole = operator == "face_hole"
    choice = _hole(dice, mesh, action) if is_hole else OPERATORS[operator].choose(mesh, action.element)
    if is_hole and choice is None:
        return None
    made = OPERATORS[operator].apply(mesh, action.element, choice)
    if _outline(made) in outlines:
        return None
    size = np.sqrt(mesh.face_areas().sum())
    for attempt in range(N_SHAKES):
        shaken = _shaken(dice, mesh, made, action, (1.0 - attempt / N_SHAKES) * SHAKE * size)
        if is_sound(shaken):
            return Grown(action, choice, shaken)
    return None


def _hole(dice: Dice, mesh: PolyMesh, action: Action) -> HoleChoice | None:
    """A regular hole about the roomiest of a few random points in the face; None if it does not fit.

    The operator's own choice would do, but it hangs on a search in GEOS that differs from version to version.
    """
    face, sides = divmod(action.element, len(HOLE_SIDES))
    ring = mesh.vertices[list(mesh.faces[face])]
    low, high = ring.min(axis=0), ring.max(axis=0)
    points = 0.5 * (low + high) + 0.5 * (high - low) * dice.array(N_POINTS, 2)
    room, middle = max((clearance(ring, x, y), (x, y)) for x, y in points.tolist())
    if room <= 0.0:
        return None
    angles = 2.0 * np.pi * (dice.between(0.0, 1.0) + np.arange(HOLE_SIDES[sides])) / HOLE_SIDES[sides]
    radius = dice.between(0.4, 0.75) * room
    return plan_hole(mesh, face, middle + radius * np.column_stack((np.cos(angles), np.sin(angles))))


def _shaken(dice: Dice, mesh: PolyMesh, made: PolyMesh, action: Action, length: float) -> PolyMesh:
    """Every vertex of `made` at a new place: those that the action made far away, the others within `length`."""
    vertices = made.vertices.copy()
    n_new = made.next_vertex_id - mesh.next_vertex_id
    if action.operator in _MOVES:
        vertices[-n_new:] = _MOVES[action.operator](dice, mesh, action.element, vertices[-n_new:])
    return made.with_vertices(vertices + length * dice.array(*vertices.shape))


def _edge(mesh: PolyMesh, edge: int) -> tuple[FloatArray, FloatArray]:
    """The vector along a boundary edge, and the one as long that points out of the mesh."""
    tail, head = mesh.topology.ends(mesh.topology.sides(edge)[0])
    along = mesh.vertices[head] - mesh.vertices[tail]
    return along, np.array([along[1], -along[0]])


def _pull_midpoint(dice: Dice, mesh: PolyMesh, edge: int, points: FloatArray) -> FloatArray:
    """The new vertex far off its edge, to either side."""
    along, outwards = _edge(mesh, edge)
    far = dice.between(0.2, 0.6) * (1.0 if dice.chance(0.6) else -1.0)
    return points + far * outwards + dice.between(-0.3, 0.3) * along


def _stretch_quad(dice: Dice, mesh: PolyMesh, edge: int, points: FloatArray) -> FloatArray:
    """The new edge farther out, wider or narrower, shifted."""
    along, outwards = _edge(mesh, edge)
    middle = points.mean(axis=0) + dice.between(0.0, 1.0) * outwards + dice.between(-0.35, 0.35) * along
    return middle + dice.between(0.35, 1.3) * (points - points.mean(axis=0))


_MOVES: dict[str, Callable[[Dice, PolyMesh, int, FloatArray], FloatArray]] = {
    "edge_subdivide": _pull_midpoint,
    "edge_extrude": _stretch_quad,
}


def is_sound(mesh: PolyMesh) -> bool:
    """Whether nothing crosses, overlaps or is flipped, and all that there is can be seen."""
    limits, size = (MIN_AREA, MIN_GAP, MIN_LENGTH, MIN_BEND, MAX_COSINE), OVERLAP_RESOLUTION
    work = workspace(size, len(mesh.topology.boundary_half_edges))
    packed = mesh.topology.packed
    return bool(construction_kernels.is_sound(mesh.vertices, packed, *limits, work, np.empty((size, size))))
