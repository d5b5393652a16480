"""Between a mesh in Blender and a lesson: read, built, taken one step on by Blender's own operators, put back."""

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from typing import Any

import bmesh
import bpy

from . import making  # type: ignore[attr-defined] # written by `make extension`: what exported scripts do for a step
from .comparing import Shape, partners
from .judging import fits, goal
from .lesson import Ids, Lesson, Step

CALLS = {
    name: getattr(making, name)
    for name in (
        "edge_cap",
        "edge_dissolve",
        "edge_extrude",
        "edge_fill",
        "edge_subdivide",
        "face_delete",
        "face_hole",
        "face_inset",
        "face_split",
        "loop_cut",
        "vertex_dissolve",
        "vertex_merge",
    )
}
EXACT = 1e-5  # of a coordinate; Blender's floats have 24 bits


class MeshError(Exception):
    """The mesh does not allow it; one line says why."""


@contextmanager
def opened(pupil: bpy.types.Object, *, is_kept: bool = False) -> Iterator[bmesh.types.BMesh]:
    """The mesh of an object, in whatever mode it is; with `is_kept` it has what was done to it afterwards."""
    data = pupil.data
    if pupil.mode == "EDIT":
        made = bmesh.from_edit_mesh(data)
        yield made
        if is_kept:
            bmesh.update_edit_mesh(data)
        return
    made = bmesh.new()
    try:
        made.from_mesh(data)
        yield made
        if is_kept:
            made.to_mesh(data)
            data.update()
    finally:
        made.free()


def shape_of_object(pupil: bpy.types.Object) -> Shape:
    """The mesh as it is now, vertices and faces by number."""
    with opened(pupil) as mesh:
        return _shape(mesh)


def settle(pupil: bpy.types.Object, step: Step, tolerance: float) -> None:
    """Put the vertices of a mesh that fits a step exactly into their places: what is typed next is exact, too."""
    joined = partners(shape_of_object(pupil), goal(step), tolerance)
    if pupil.mode == "EDIT":
        mesh = bmesh.from_edit_mesh(pupil.data)
        mesh.verts.ensure_lookup_table()
        for name, number in joined.items():
            mesh.verts[number].co = (*step.vertices[name], 0.0)
        bmesh.update_edit_mesh(pupil.data, destructive=False)
    else:
        for name, number in joined.items():
            pupil.data.vertices[number].co = (*step.vertices[name], 0.0)
        pupil.data.update()


def _shape(mesh: bmesh.types.BMesh) -> Shape:
    mesh.verts.index_update()
    places = {v.index: (v.co.x, v.co.y, v.co.z) for v in mesh.verts}
    edges = frozenset(_edge(e.verts[0].index, e.verts[1].index) for e in mesh.edges)
    return Shape(places, edges, {k: tuple(v.index for v in f.verts) for k, f in enumerate(mesh.faces)})


def _edge(a: int, b: int) -> Ids:
    return (a, b) if a < b else (b, a)


def advance(pupil: bpy.types.Object, lesson: Lesson, done: int, tolerance: float) -> None:
    """Make the step after `done` of a mesh that fits it. Raises MeshError, and changes nothing, where that fails."""
    step, before = lesson.steps[done + 1], lesson.steps[done]
    _refuse_shape_keys(pupil)
    with opened(pupil) as mesh:
        rehearsal = mesh.copy()
    try:
        _make(rehearsal, step, before, tolerance)
        _check(rehearsal, step, done + 1)
    finally:
        rehearsal.free()
    with opened(pupil, is_kept=True) as mesh:
        _make(mesh, step, before, tolerance)


def restore(pupil: bpy.types.Object, lesson: Lesson, number: int) -> None:
    """Make it the mesh of a step, whatever it is: from the start on by Blender's operators, where they do as told.

    Raises MeshError, and changes nothing, where something would be lost.
    """
    _refuse_shape_keys(pupil)
    built = bmesh.new()
    try:
        try:
            _build(built, lesson, number)
        except MeshError:  # a step that only its mesh is known of
            built.clear()
            _put(built, lesson.steps[number])
        with opened(pupil, is_kept=True) as mesh:
            _replace(mesh, built)
    finally:
        built.free()


def _build(mesh: bmesh.types.BMesh, lesson: Lesson, number: int) -> None:
    """The mesh of a step in an empty one, step by step. Raises MeshError."""
    _put(mesh, lesson.steps[0])
    for before, step in pairwise(lesson.steps[: number + 1]):
        _make(mesh, step, before, EXACT)
    _check(mesh, lesson.steps[number], number)


def _check(mesh: bmesh.types.BMesh, step: Step, number: int) -> None:
    """Raise MeshError if a mesh is not that of a step."""
    if not fits(_shape(mesh), step, EXACT):
        raise MeshError(f"step {number} does not come out as the lesson says; do it by hand, or go to step {number}")


def _put(mesh: bmesh.types.BMesh, step: Step) -> None:
    """The mesh of a step, vertex by vertex."""
    _work_on(mesh, step.next_ids)
    making.start(step.vertices, step.faces, next_vertex=step.next_ids[0], next_face=step.next_ids[1])


def _make(mesh: bmesh.types.BMesh, step: Step, before: Step, tolerance: float) -> None:
    """A step of a mesh that fits the one before it: Blender's operator, then every vertex in its place."""
    if step.call is None or step.call[0] not in CALLS:
        raise MeshError(f"{step.operator} is not an operator that the coach knows; do it by hand, or go to its step")
    _work_on(mesh, before.next_ids)
    _name(mesh, before, tolerance)
    name, arguments = step.call
    try:
        CALLS[name](*_tuples(arguments))
        for v in mesh.verts:
            v.co = (*step.vertices[v[making.VERTEX_ID]], 0.0)
    except Exception as error:  # whatever a damaged lesson makes of Blender's operator
        reason = type(error).__name__
        raise MeshError(f"{step.title}: Blender fails ({reason}), the lesson is damaged; do it by hand") from None
    mesh.normal_update()


def _work_on(mesh: bmesh.types.BMesh, next_ids: tuple[int, int]) -> None:
    """Whatever `making` does, it does to this mesh from now on."""
    layers = {"VERTEX_ID": (mesh.verts.layers.int, "vertex_id"), "FACE_ID": (mesh.faces.layers.int, "face_id")}
    for constant, (group, name) in layers.items():
        found = group.get(name)
        setattr(making, constant, group.new(name) if found is None else found)
    making.VERTEX_ID = mesh.verts.layers.int["vertex_id"]  # a new layer leaves others behind
    making.bm = mesh
    making.next_ids.update(vertex=next_ids[0], face=next_ids[1])


def _name(mesh: bmesh.types.BMesh, step: Step, tolerance: float) -> None:
    """Give vertices and faces their numbers, and have all faces look up."""
    found = _shape(mesh)
    joined = partners(found, goal(step), tolerance)
    mesh.verts.ensure_lookup_table()
    for name, number in joined.items():
        mesh.verts[number][making.VERTEX_ID] = name
        mesh.verts[number].co = (*step.vertices[name], 0.0)
    rings = {frozenset(ring): name for name, ring in step.faces.items()}
    for face in mesh.faces:
        face[making.FACE_ID] = rings.get(frozenset(v[making.VERTEX_ID] for v in face.verts), -1)
        face.normal_update()
        if face.normal.z < 0.0:
            face.normal_flip()


def _replace(mesh: bmesh.types.BMesh, other: bmesh.types.BMesh) -> None:
    """Have the mesh consist of what another one does."""
    bmesh.ops.delete(mesh, geom=list(mesh.verts), context="VERTS")  # clear() makes Blender forget who holds the mesh
    _work_on(mesh, (0, 0))
    vertex_id, face_id = making.VERTEX_ID, making.FACE_ID
    names, kinds = other.verts.layers.int["vertex_id"], other.faces.layers.int["face_id"]
    copies = {}
    for v in other.verts:
        copies[v] = mesh.verts.new(v.co)
        copies[v][vertex_id] = v[names]
    for f in other.faces:
        mesh.faces.new([copies[v] for v in f.verts])[face_id] = f[kinds]
    mesh.normal_update()


def _refuse_shape_keys(pupil: bpy.types.Object) -> None:
    if pupil.data.shape_keys:
        raise MeshError("the mesh has shape keys, which would be lost; remove them, or do the step by hand")


def _tuples(value: Any) -> Any:
    """Lists as the tuples that they were."""
    return tuple(map(_tuples, value)) if isinstance(value, (list, tuple)) else value
