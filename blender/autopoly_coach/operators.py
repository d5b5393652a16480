"""What can be pressed. Each step is one undo step; what cannot be done is said in one line, and nothing is lost."""

# mypy: disable-error-code="valid-type"

from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any

import bmesh
import bpy
from bpy_extras.io_utils import ImportHelper

from . import building, meshes, scene, session
from .comparing import partners
from .judging import goal, task
from .lesson import SEQUENCE, LessonError, format_of, read
from .meshes import MeshError
from .properties import python_of
from .session import CoachError
from .solver import SolverError

Execute = Callable[[Any, bpy.types.Context], set[str]]


def told(execute: Execute) -> Execute:
    """What cannot be done is reported in one line, and stands in the panel."""

    @wraps(execute)
    def careful(self: Any, context: bpy.types.Context) -> set[str]:
        try:
            return execute(self, context)
        except (CoachError, LessonError, MeshError, SolverError) as error:
            session.say(context, str(error), "ERROR")
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}

    return careful


def _has_lesson(context: bpy.types.Context) -> bool:
    active = context.view_layer.objects.active
    return active is not None and active.type == "MESH" and bool(active.autopoly_coach.lesson)


class ImportLesson(bpy.types.Operator, ImportHelper):
    """Import a construction to learn it, or to watch how it comes about"""

    bl_idname = "autopoly.import_lesson"
    bl_label = "AutoPoly construction (.json)"
    bl_options = {"REGISTER", "UNDO"}

    filename_ext = ".json"
    filter_glob: bpy.props.StringProperty(default="*.json", options={"HIDDEN"})
    begin_at: bpy.props.EnumProperty(
        name="Begin",
        items=(("START", "At the start", "To do the steps"), ("END", "At the end", "With the whole mesh")),
    )

    @told
    def execute(self, context: bpy.types.Context) -> set[str]:
        text = read(self.filepath)
        if format_of(text) == SEQUENCE:
            found = building.lesson_beside(self.filepath, text)
            if found is None:
                building.convert(context, python_of(context), self.filepath)
                self.report({"INFO"}, "AutoPoly writes the lesson of this sequence; it is imported when it is done")
                return {"FINISHED"}
            text = found
        pupil = scene.add(context, text, at_end=self.begin_at == "END")
        lesson = session.lesson_of(pupil)
        session.set_done(context, pupil, session.done_of(pupil))
        session.say(context, task(lesson, session.done_of(pupil)), "INFO")
        self.report({"INFO"}, f"{lesson.name}: a lesson of {lesson.last} steps; see AutoPoly in the sidebar (N)")
        return {"FINISHED"}


class OfLesson:
    """What can be pressed where the active object has a lesson, and undone."""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return _has_lesson(context)


class Forward(OfLesson, bpy.types.Operator):
    """Make the next step, with Blender's own operator"""

    bl_idname = "autopoly.forward"
    bl_label = "Forward"

    @told
    def execute(self, context: bpy.types.Context) -> set[str]:
        pupil = session.pupil_of(context)
        lesson = session.lesson_of(pupil)
        session.check_stand(context, pupil)
        done = session.done_of(pupil)
        if done == lesson.last:
            raise CoachError(f"step {done} is the last one")
        meshes.advance(pupil, lesson, done, session.tolerance_of(context))
        session.set_done(context, pupil, done + 1)
        session.say(context, f"{lesson.steps[done + 1].done} {task(lesson, done + 1)}", "INFO")
        return {"FINISHED"}


class Back(OfLesson, bpy.types.Operator):
    """Go back to the mesh before this step"""

    bl_idname = "autopoly.back"
    bl_label = "Back"

    @told
    def execute(self, context: bpy.types.Context) -> set[str]:
        pupil = session.pupil_of(context)
        session.check_stand(context, pupil)
        done = session.done_of(pupil)
        if done == 0:
            raise CoachError("this is the start")
        return _restored(context, pupil, done - 1)


class Restore(OfLesson, bpy.types.Operator):
    """Put the mesh of a step in the place of this one, whatever has become of it"""

    bl_idname = "autopoly.restore"
    bl_label = "Restore"

    step: bpy.props.IntProperty(name="Step", description="-1 for the one that is done", default=-1, min=-1)

    @told
    def execute(self, context: bpy.types.Context) -> set[str]:
        pupil = session.pupil_of(context)
        number = session.done_of(pupil) if self.step < 0 else self.step
        if number > session.lesson_of(pupil).last:
            raise CoachError(f"there is no step {number}; the last one is {session.lesson_of(pupil).last}")
        return _restored(context, pupil, number)


def _restored(context: bpy.types.Context, pupil: bpy.types.Object, number: int) -> set[str]:
    lesson = session.lesson_of(pupil)
    meshes.restore(pupil, lesson, number)
    session.set_done(context, pupil, number)
    session.say(context, task(lesson, number), "INFO")
    return {"FINISHED"}


class Check(bpy.types.Operator):
    """Look at the mesh: is the step right, and if not, what differs?"""

    bl_idname = "autopoly.check"
    bl_label = "Check"

    @told
    def execute(self, context: bpy.types.Context) -> set[str]:
        verdict = session.look(context)
        self.report({"INFO"}, verdict.words)
        return {"FINISHED"}


class Pick(bpy.types.Operator):
    """Select what the step works on"""

    bl_idname = "autopoly.pick"
    bl_label = "Select It for Me"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return _has_lesson(context) and context.mode == "EDIT_MESH"

    @told
    def execute(self, context: bpy.types.Context) -> set[str]:
        pupil = session.pupil_of(context)
        lesson = session.lesson_of(pupil)
        session.check_stand(context, pupil)
        done = session.done_of(pupil)
        picks = lesson.steps[done + 1].picks if done < lesson.last else ()
        if not picks:
            raise CoachError("there is nothing to select")
        step, kind = lesson.steps[done], picks[0][0]
        bpy.ops.mesh.select_mode(type={"vertex": "VERT", "edge": "EDGE", "face": "FACE"}[kind])
        bpy.ops.mesh.select_all(action="DESELECT")
        joined = partners(meshes.shape_of_object(pupil), goal(step), session.tolerance_of(context))
        mesh = bmesh.from_edit_mesh(pupil.data)
        mesh.verts.ensure_lookup_table()
        for what, ids in (pick for pick in picks if pick[0] == kind):
            ring = step.faces[ids[0]] if what == "face" and len(ids) == 1 else ids
            element = scene.element_of([mesh.verts[joined[v]] for v in ring])
            if element is not None:
                element.select_set(True)
                mesh.select_history.add(element)
        mesh.select_flush_mode()
        bmesh.update_edit_mesh(pupil.data)
        return {"FINISHED"}


class Activate(bpy.types.Operator):
    """Make the object active that has the lesson"""

    bl_idname = "autopoly.activate"
    bl_label = "Go to the Lesson"
    bl_options = {"REGISTER", "UNDO"}

    @told
    def execute(self, context: bpy.types.Context) -> set[str]:
        found = [o for o in context.view_layer.objects if o.type == "MESH" and o.autopoly_coach.lesson]
        if not found:
            raise CoachError("no object has a lesson; import one: File, Import, AutoPoly construction")
        active = context.view_layer.objects.active
        if active in found:
            session.show_rows(context, active)
            return {"FINISHED"}
        if context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        scene.activate(context, found[0])
        session.show_rows(context, found[0])
        return {"FINISHED"}


class BuildFromImage(bpy.types.Operator, ImportHelper):
    """Have AutoPoly build a mesh of a picture, and learn how"""

    bl_idname = "autopoly.build"
    bl_label = "Build from Image"

    filename_ext = ""
    filter_glob: bpy.props.StringProperty(default="*.png;*.jpg;*.jpeg;*.svg;*.webp;*.gif;*.bmp", options={"HIDDEN"})
    seconds: bpy.props.FloatProperty(
        name="Seconds", description="How long AutoPoly may search", default=30.0, min=1.0, max=3600.0
    )
    style: bpy.props.EnumProperty(
        name="Style",
        items=(
            ("modeller", "Modeller", "Quads, part by part"),
            ("paper", "Paper", "The best score, faces of many corners"),
        ),
    )

    @told
    def execute(self, context: bpy.types.Context) -> set[str]:
        if not Path(self.filepath).is_file():
            raise CoachError(f"{self.filepath} is not there; choose a picture")
        building.build(context, python_of(context), self.filepath, self.seconds, self.style)
        self.report({"INFO"}, "AutoPoly builds it; see AutoPoly in the sidebar (N)")
        return {"FINISHED"}


class CancelBuild(bpy.types.Operator):
    """Stop AutoPoly; nothing is changed"""

    bl_idname = "autopoly.cancel"
    bl_label = "Cancel"

    def execute(self, context: bpy.types.Context) -> set[str]:
        building.cancel(context)
        return {"FINISHED"}


CLASSES = (ImportLesson, Forward, Back, Restore, Check, Pick, Activate, BuildFromImage, CancelBuild)
