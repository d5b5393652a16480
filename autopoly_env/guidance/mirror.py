"""Actions under symmetry: an action that changes the outline is followed by its mirror image, in one transition.

An element that is its own mirror image needs one action; so does what leaves the outline alone, for inner edges need
not be symmetric. New vertices are made exact mirror images of each other here, and the refit keeps them so.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.errors import IllegalActionError
from autopoly_env.guidance.symmetry import images_of, mirrored
from autopoly_env.mesh import PolyMesh, defects_of
from autopoly_env.operators import HOLE_SIDES, OPERATORS, Action, Choice, HoleChoice, describe, plan_hole
from autopoly_env.placement import Disagreement, Start, leaves_outline_alone, starts

_HOLE_SCALES = (1.0, 0.6)  # of a hole on the axis, tried until it fits


@dataclass(frozen=True)
class Halfway:
    """Between an action and its mirror image."""

    mesh: PolyMesh  # after the action
    action: Action  # its mirror image, on that mesh
    choice: Choice | None


Beginning = tuple[Choice | None, PolyMesh, Halfway | None]


def mirrored_starts(disagreement: Disagreement, action: Action, axis: float) -> list[Beginning]:
    """As `placement.starts` under symmetry: one or more symmetric meshes, none worse than the mesh before.

    Raises IllegalActionError where the action, or its mirror image after it, is illegal, or the two have no room.
    """
    mesh = disagreement.mesh
    if images_of(mesh, axis) is None:
        raise IllegalActionError(f"the outline is not symmetric about x = {axis:g}; start from one that is")
    found = [
        beginning
        for beginning in _beginnings(mesh, action, starts(disagreement, action), axis)
        if _is_as_sane(beginning[1], disagreement) and images_of(beginning[1], axis) is not None
    ]
    if not found:
        raise IllegalActionError(f"{describe(mesh, action)} has no mirror image, or no room for it; choose another")
    return found


def _is_as_sane(made: PolyMesh, before: Disagreement) -> bool:
    return all(now <= then for now, then in zip(defects_of(made), before.defects, strict=True))


def _beginnings(mesh: PolyMesh, action: Action, plain: list[Start], axis: float) -> Iterator[Beginning]:
    if leaves_outline_alone(mesh, action):
        yield from ((choice, made, None) for choice, made in plain)
        return
    images = images_of(mesh, axis)
    assert images is not None
    for choice, made in plain:
        yield from _BOTH[action.operator](mesh, images, action, (choice, made, None), axis)


def _subdivided(mesh: PolyMesh, images: IntArray, action: Action, begun: Beginning, axis: float) -> Iterator[Beginning]:
    """Two new vertices; one, and it on the axis, where the edge crosses it."""
    choice, first, _ = begun
    new = len(mesh.vertices)
    a, b = images[mesh.edges[action.element]].tolist()
    if mesh.edge_index(a, b) == action.element:
        yield choice, _moved(first, {new: np.array((axis, first.vertices[new, 1]))}), None
        return
    second, halfway = _again(first, action, first.edge_index(a, b))
    yield choice, _moved(second, {new + 1: mirrored(first.vertices[new], axis)}), halfway


def _extruded(mesh: PolyMesh, images: IntArray, action: Action, begun: Beginning, axis: float) -> Iterator[Beginning]:
    """Two quads, as the first is placed or, where that leaves no room, as the second places itself."""
    choice, first, _ = begun
    new = len(mesh.vertices)
    a, b = images[mesh.edges[action.element]].tolist()
    if mesh.edge_index(a, b) == action.element:
        middle = 0.5 * (first.vertices[new] + mirrored(first.vertices[new + 1], axis))
        yield choice, _moved(first, {new: middle, new + 1: mirrored(middle, axis)}), None
        return
    second, halfway = _again(first, action, first.edge_index(a, b))
    at = second.vertices  # copies of the tail and of the head; the image of an edge runs from image to image of head
    yield choice, _moved(second, {new + 2: mirrored(at[new + 1], axis), new + 3: mirrored(at[new], axis)}), halfway
    yield choice, _moved(second, {new: mirrored(at[new + 3], axis), new + 1: mirrored(at[new + 2], axis)}), halfway


def _dissolved(mesh: PolyMesh, images: IntArray, action: Action, begun: Beginning, axis: float) -> Iterator[Beginning]:
    choice, first, _ = begun
    image = int(images[action.element])
    if image == action.element:
        yield begun
        return
    second, halfway = _again(first, action, first.vertex_index(mesh.vertex_ids[image]))
    yield choice, second, halfway


def _deleted(mesh: PolyMesh, images: IntArray, action: Action, begun: Beginning, axis: float) -> Iterator[Beginning]:
    """Two faces; nothing where the face has no mirror image, as one with inner vertices."""
    choice, first, _ = begun
    wanted = set(images[list(mesh.faces[action.element])].tolist())
    image = next((f for f, face in enumerate(mesh.faces) if set(face) == wanted), None)
    if image == action.element:
        yield begun
    elif image is not None:
        second, halfway = _again(first, action, first.face_index(mesh.face_ids[image]))
        yield choice, second, halfway


def _holed(mesh: PolyMesh, images: IntArray, action: Action, begun: Beginning, axis: float) -> Iterator[Beginning]:
    """Two holes, or one about the axis."""
    choice, first, _ = begun
    face, n_sides = action.element // len(HOLE_SIDES), HOLE_SIDES[action.element % len(HOLE_SIDES)]
    if not isinstance(choice, HoleChoice):
        return
    points = np.array(choice.points)
    operator = OPERATORS[action.operator]
    if points[:, 0].min() <= axis <= points[:, 0].max():
        for scale in _HOLE_SCALES:
            hole = plan_hole(mesh, face, _symmetric_hole(points, axis, scale))
            if hole is not None:
                yield hole, operator.apply(mesh, action.element, hole), None
                return
        return
    opposite = mirrored(points, axis)[::-1]
    hole = plan_hole(mesh, face, points, [opposite])  # whose bridges leave room for the other one
    if hole is None:
        return
    first = operator.apply(mesh, action.element, hole)
    for other in range(len(first.faces)):
        image = plan_hole(first, other, opposite)
        if image is not None:
            second, halfway = _again(first, action, len(HOLE_SIDES) * other + HOLE_SIDES.index(n_sides), image)
            yield hole, second, halfway
            return


def _symmetric_hole(points: FloatArray, axis: float, scale: float) -> FloatArray:
    """An upright box, or a triangle with a corner on the axis, about as large as the hole with these points (k, 2)."""
    away = np.abs(points[:, 0] - axis)
    middle = points[:, 1].mean()
    if len(points) == 4:
        low, high = np.sort(points[:, 1]).reshape(2, 2).mean(axis=1)
        width = scale * away.mean()
        ring = [(axis - width, low), (axis + width, low), (axis + width, high), (axis - width, high)]
    else:
        tip = int(np.argmin(away))
        base = np.delete(points[:, 1], tip).mean()
        width = scale * np.delete(away, tip).mean()
        ring = [(axis - width, base), (axis + width, base), (axis, points[tip, 1])]
        if points[tip, 1] < base:
            ring = ring[::-1]
    shrunk = np.array(ring)
    shrunk[:, 1] = middle + scale * (shrunk[:, 1] - middle)
    return shrunk


def _again(
    first: PolyMesh, action: Action, element: int, choice: Choice | None = None
) -> tuple[PolyMesh, Halfway]:  # fmt: skip
    """The mesh after the operator has worked on an element of `first`, too."""
    second = OPERATORS[action.operator].apply(first, element, choice)
    return second, Halfway(first, Action(action.operator, element), choice)


def _moved(mesh: PolyMesh, places: dict[int, FloatArray]) -> PolyMesh:
    vertices = mesh.vertices.copy()
    for vertex, place in places.items():
        vertices[vertex] = place
    return mesh.with_vertices(vertices)


_BOTH = {
    "edge_subdivide": _subdivided,
    "edge_extrude": _extruded,
    "vertex_dissolve": _dissolved,
    "face_delete": _deleted,
    "face_hole": _holed,
}
