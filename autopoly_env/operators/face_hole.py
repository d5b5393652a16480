"""`face_hole`: a hole cut into a face with two bridges, as Blender's Knife does it, and its face deleted."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray
from autopoly_env.errors import IllegalActionError
from autopoly_env.mesh import PolyMesh, mirrored
from autopoly_env.operators import edit_kernels
from autopoly_env.operators.action import Choice, Start
from autopoly_env.operators.choices import OF_HOLE
from autopoly_env.operators.deeds import NO_FACE, NOTHING, Cut, Deed, Press, select
from autopoly_env.operators.elements import HOLE, hole_face
from autopoly_env.operators.evidence import Evidence, Region
from autopoly_env.operators.hole_kernels import HOLE_SIDES, TINY_AREA, roomy_faces
from autopoly_env.operators.holes import HoleChoice, default_hole, hole_defect, plan_hole
from autopoly_env.operators.mirroring import again
from autopoly_env.operators.operator import Mirroring, Operator
from autopoly_env.operators.rebuilding import corners_from_last, edited, grown, refusal
from autopoly_env.operators.wording import Gesture, Phrases, Told

_RIM_PROMISE = 0.1  # of an excess that an edge answers for, left to a hole
_MIRROR_SCALES = (1.0, 0.6)  # of a hole on the axis, tried until it fits
_BOX = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
_TRIANGLE = np.array([(-1.0, -0.7), (1.0, -0.7), (0.0, 1.2)])


def faces_with_room(mesh: PolyMesh) -> BoolArray:
    """(2 F,) the holes in simple faces that are not tiny."""
    topology = mesh.topology
    roomy = roomy_faces(mesh.vertices, topology.corners, topology.face_offsets, TINY_AREA)
    return np.repeat(roomy, len(HOLE_SIDES))


def regular_hole(mesh: PolyMesh, element: int) -> HoleChoice | None:
    """See `default_hole`."""
    return default_hole(mesh, *hole_face(element))


def cut(mesh: PolyMesh, element: int, choice: Choice | None) -> PolyMesh:
    """A hole with the corners choice.points, and its face cut in two by the bridges.

    The part that keeps the face's last half-edge (from its last corner to its first) keeps its id and place.
    """
    f, n_sides = hole_face(element)
    face = mesh.faces[f]
    if choice is None or not faces_with_room(mesh)[element]:
        raise refusal("face_hole", "hole", element, f"face {f} crosses itself or has no room; choose another")
    if not isinstance(choice, HoleChoice) or len(choice.points) != n_sides:
        raise refusal("face_hole", "hole", element, f"{choice!r} is no hole of {n_sides} corners; give a HoleChoice")
    defect = hole_defect(mesh.vertices[list(face)], choice)
    if defect is not None:
        raise refusal("face_hole", "hole", element, f"{defect}; give points and bridges from plan_hole")
    (i, h), (j, k) = sorted(choice.bridges)
    packed, _ = edited(mesh, edit_kernels.HOLE, element, i, h, j, k)
    return grown(mesh, choice.points, packed, 1)


# --- where it starts


def _begin(evidence: Evidence, element: int) -> Iterator[Start]:
    hole = _placed(evidence, element)
    yield Start(hole, face_hole.apply(evidence.mesh, element, hole))


def _placed(evidence: Evidence, element: int) -> HoleChoice:
    """A hole over the largest excess in the face; where that does not fit, or there is none, the operator's own."""
    face, n_sides = hole_face(element)
    region = evidence.excess_in(face)
    if region is not None:
        for points in hole_shapes(region, n_sides):
            planned = plan_hole(evidence.mesh, face, points)
            if planned is not None:
                return planned
    choice = regular_hole(evidence.mesh, element)
    if choice is None:
        raise IllegalActionError(f"face_hole cannot work on face {face}: no hole with two bridges fits into it")
    return choice


def hole_shapes(region: Region, n_sides: int) -> Iterator[FloatArray]:
    """Holes to try: one with the region's principal axes, then a regular one in its inscribed circle."""
    moments = np.array([[region.var_x, region.cov_xy], [region.cov_xy, region.var_y]])
    spread, axes = np.linalg.eigh(moments)
    unit = _BOX if n_sides == 4 else _TRIANGLE
    middle = np.array((region.mean_x, region.mean_y))
    yield _wound(middle + 0.9 * unit * np.sqrt(3.0 * np.maximum(spread, 1e-6)) @ axes.T)
    angles = 2.0 * np.pi * np.arange(n_sides) / n_sides
    around = np.column_stack((np.cos(angles), np.sin(angles)))
    yield np.array((region.deep_x, region.deep_y)) + 0.8 * region.radius * around


def _wound(ring: FloatArray) -> FloatArray:
    """The ring with positive shoelace area."""
    x, y = ring.T
    return ring if x @ np.roll(y, -1) > y @ np.roll(x, -1) else ring[::-1]


def _promise(evidence: Evidence, element: int) -> float:
    region = evidence.excess_in(hole_face(element)[0])
    area = 0.0 if region is None else -region.area
    return max(area - evidence.most[1], _RIM_PROMISE * area)


# --- its mirror image


def _mirror(of: Mirroring, start: Start) -> Iterator[Start]:
    """Two holes, or one about the axis."""
    if not isinstance(start.choice, HoleChoice):
        return
    element, axis = of.action.element, of.axis
    points = np.array(start.choice.points)
    if points[:, 0].min() <= axis <= points[:, 0].max():
        yield from _on_axis(of.mesh, element, points, axis)
        return
    face, n_sides = hole_face(element)
    opposite = mirrored(points, axis)[::-1]
    hole = plan_hole(of.mesh, face, points, [opposite])  # whose bridges leave room for the other one
    if hole is None:
        return
    first = face_hole.apply(of.mesh, element, hole)
    for other in range(len(first.faces)):
        image = plan_hole(first, other, opposite)
        if image is not None:
            number = len(HOLE_SIDES) * other + HOLE_SIDES.index(n_sides)
            second, halfway = again(face_hole, first, number, image)
            yield Start(hole, second, halfway)
            return


def _on_axis(mesh: PolyMesh, element: int, points: FloatArray, axis: float) -> Iterator[Start]:
    for scale in _MIRROR_SCALES:
        hole = plan_hole(mesh, hole_face(element)[0], _symmetric_hole(points, axis, scale))
        if hole is not None:
            yield Start(hole, face_hole.apply(mesh, element, hole))
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


# --- how it is told


def _sources(_before: PolyMesh, _element: int, choice: Choice | None, _made: PolyMesh) -> FloatArray:
    """The knife draws every corner where it belongs."""
    assert isinstance(choice, HoleChoice)
    return np.array(choice.points)


def _bridge_ends(step: Told) -> tuple[str, str]:
    (a, _), (b, _) = step.choice["bridges"] if step.choice else ((0, 0), (0, 0))
    return f"vertex {a}", f"vertex {b}"


def _done(step: Told) -> str:
    a, b = _bridge_ends(step)
    return (
        f"A hole with {step.element['sides']} corners is cut into face {step.element['face']}, bridged to {a} and {b}."
    )


def _deeds(step: Told) -> tuple[Deed, ...]:
    """The knife: from a over the hole to b, then round its other side; then the face in the hole."""
    hole: list[int] = step.created["vertices"]
    (a, i), (b, j) = step.choice["bridges"] if step.choice else ((0, 0), (0, 0))
    there, n = (j - i) % len(hole), len(hole)
    one, other = [(i + k) % n for k in range(there + 1)], [(i - k) % n for k in range(n - there + 1)]
    near, far = (one, other) if len(one) <= len(other) else (other, one)
    return (
        NO_FACE,
        Cut(((a, *(hole[k] for k in near), b), tuple(hole[k] for k in far))),
        select("face", tuple(hole)),
        Press(("X",), "Faces", leaves=NOTHING),
    )


def _gesture(step: Told) -> Gesture:
    """The knife: a corner, the hole's corners and its first once more, the other corner; then the face inside."""
    sides = int(step.element["sides"])
    return Gesture("K" + (sides + 3) * "PBB" + "K" + "PBB" + "KPBB")


def _blender(mesh: PolyMesh, element: int, choice: Choice | None) -> list[Any]:
    assert isinstance(choice, HoleChoice)
    face, _ = hole_face(element)
    corner_of = {mesh.vertex_ids[mesh.faces[face][i]]: corner for i, corner in choice.bridges}
    a, b = corners_from_last(mesh, face, *corner_of)
    return [mesh.face_ids[face], list(choice.points), a, corner_of[a], b, corner_of[b]]


face_hole = Operator(
    "face_hole",
    HOLE,
    "a hole of 3 or 4 corners cut into a face with two bridges",
    ((3, 5, 1), (4, 6, 1)),
    faces_with_room,
    cut,
    choose=regular_hole,
    choice=OF_HOLE,
    begin=_begin,
    promise=_promise,
    mirror=_mirror,
    sources=_sources,
    phrases=Phrases(
        "Cut a hole", _done, _deeds, "Mesh › Knife Tool", "mesh.knife_tool", _gesture, "The picture has a hole here."
    ),
    blender=_blender,
)
