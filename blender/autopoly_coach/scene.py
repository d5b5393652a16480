"""What a lesson puts into the scene: the mesh of the start, and the picture under it."""

from typing import Any

import bpy

from . import meshes, session

UNDER = -0.01  # z of the picture


def add(context: bpy.types.Context, text: str, *, at_end: bool = False) -> bpy.types.Object:
    """A new object with a lesson, active, and its picture. Raises LessonError, or MeshError, and adds nothing then."""
    if context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    data = bpy.data.meshes.new("AutoPoly")
    pupil = bpy.data.objects.new("AutoPoly", data)
    try:
        pupil.autopoly_coach.lesson = text
        lesson = session.lesson_of(pupil)
        done = lesson.last if at_end else 0
        meshes.restore(pupil, lesson, done)
    except Exception:
        bpy.data.objects.remove(pupil)
        bpy.data.meshes.remove(data)
        raise
    pupil.autopoly_coach.done = done
    pupil.name = data.name = lesson.name
    collection = bpy.data.collections.new(lesson.name)
    context.scene.collection.children.link(collection)
    collection.objects.link(pupil)
    if lesson.picture:
        collection.objects.link(_reference(lesson.name, lesson.picture, pupil))
    activate(context, pupil)
    return pupil


def activate(context: bpy.types.Context, pupil: bpy.types.Object) -> None:
    """Have an object selected alone, and active."""
    for other in context.view_layer.objects:
        other.select_set(other == pupil)
    context.view_layer.objects.active = pupil


def element_of(corners: list[Any]) -> Any:
    """The vertex, edge or face that has these corners and no others, or None."""
    if len(corners) == 1:
        return corners[0]
    groups = corners[0].link_edges if len(corners) == 2 else corners[0].link_faces
    return next((element for element in groups if set(element.verts) == set(corners)), None)


def _reference(name: str, png: bytes, pupil: bpy.types.Object) -> bpy.types.Object:
    """The picture in the unit square under the mesh, as Add > Image > Reference makes one; it goes along."""
    image = bpy.data.images.new(f"{name} target", 1, 1)
    image.pack(data=png, data_len=len(png))
    image.source = "FILE"
    made = bpy.data.objects.new(f"{name} target", None)
    made.empty_display_type, made.data = "IMAGE", image
    made.empty_display_size, made.location = 1.0, (0.5, 0.5, UNDER)
    made.color, made.use_empty_image_alpha, made.hide_select = (1.0, 1.0, 1.0, 0.5), True, True
    made.parent = pupil
    return made
