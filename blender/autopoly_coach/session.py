"""The coach at work: whose lesson it is, what is done, what is said; and when it looks."""

from contextlib import suppress
from typing import Any

import bpy

from . import meshes
from .judging import BACK, DONE, LOST, WAITING, WRONG, Verdict, judge, stands_at, step_of
from .lesson import Lesson, LessonError, parse
from .telling import HEAD, rows_of

ICONS = {DONE: "CHECKMARK", WAITING: "INFO", WRONG: "ERROR", BACK: "LOOP_BACK", LOST: "ERROR"}
MODAL = ("TRANSFORM_OT_", "MESH_OT_")  # what changes a mesh while it runs; others may run all the time

_read: dict[str, Lesson] = {}  # the lesson that was asked for last, by its text
_is_looking = False


class CoachError(Exception):
    """What is asked for cannot be done; one line says why."""


def pupil_of(context: bpy.types.Context) -> bpy.types.Object:
    """The object that is active, which has a lesson. Raises CoachError if it has none."""
    active = context.view_layer.objects.active
    if active is not None and active.type == "MESH" and active.autopoly_coach.lesson:
        return active
    others = [o.name for o in context.scene.objects if o.type == "MESH" and o.autopoly_coach.lesson]
    name = "No object is active" if active is None else f"{active.name!r} has no lesson"
    advice = f"make {others[0]!r} active, which has one" if others else "import one: File, Import, AutoPoly"
    raise CoachError(f"{name}; {advice}")


def lesson_of(pupil: bpy.types.Object) -> Lesson:
    """The lesson of an object. Raises LessonError if somebody has changed it to what is none."""
    text = pupil.autopoly_coach.lesson
    if text not in _read:
        _read.clear()
        _read[text] = parse(text)
    return _read[text]


def done_of(pupil: bpy.types.Object) -> int:
    """The step that is done."""
    return max(0, min(pupil.autopoly_coach.done, lesson_of(pupil).last))


def look(context: bpy.types.Context) -> Verdict:
    """Compare the mesh with the step that is to be done, go on if it fits, and say what there is to say.

    Raises CoachError or LessonError where there is nothing to compare.
    """
    pupil = pupil_of(context)
    lesson = lesson_of(pupil)
    verdict = judge(meshes.shape_of_object(pupil), lesson, done_of(pupil), tolerance_of(context))
    if verdict.what == DONE and context.scene.autopoly_coach.settles:
        meshes.settle(pupil, lesson.steps[verdict.done], tolerance_of(context))
    set_done(context, pupil, verdict.done)
    if not (verdict.what == WAITING and context.window_manager.autopoly_coach.said.endswith(verdict.words)):
        say(context, verdict.words, ICONS[verdict.what])
    return verdict


def check_stand(context: bpy.types.Context, pupil: bpy.types.Object) -> None:
    """Raise CoachError if the mesh is not that of the step which is done; one that was undone is another step's."""
    lesson, done = lesson_of(pupil), done_of(pupil)
    found, tolerance = meshes.shape_of_object(pupil), tolerance_of(context)
    verdict = stands_at(found, lesson, done, tolerance)
    if verdict.what == LOST:
        earlier = step_of(found, lesson, done, tolerance)
        if earlier is None:
            raise CoachError(verdict.words)
        set_done(context, pupil, earlier)


def tolerance_of(context: bpy.types.Context) -> float:
    """How far from its place a vertex may be, unit square."""
    return float(context.scene.autopoly_coach.tolerance)


def set_done(context: bpy.types.Context, pupil: bpy.types.Object, done: int) -> None:
    """Note what is done, and mark it in the list."""
    if pupil.autopoly_coach.done != done:
        pupil.autopoly_coach.done = done
    show_rows(context, pupil)


def show_rows(context: bpy.types.Context, pupil: bpy.types.Object) -> None:
    """The list of the lesson, the step that is done marked in it."""
    board = context.window_manager.autopoly_coach
    rows, done = rows_of(lesson_of(pupil)), done_of(pupil)
    if board.of != pupil.name or [row.words for row in board.rows] != [row.words for row in rows]:
        board.of = pupil.name
        board.rows.clear()
        for row in rows:
            added = board.rows.add()
            added.words, added.number = row.words, row.number
    number = next(k for k, row in enumerate(rows) if row.number == done and row.number != HEAD)
    if board.row != number:
        board.row = number


def say(context: bpy.types.Context, words: str, icon: str) -> None:
    """What stands in the panel."""
    board = context.window_manager.autopoly_coach
    if board.said != words:
        board.said, board.icon = words, icon
        redraw(context)


def redraw(context: bpy.types.Context) -> None:
    """Have the panels drawn again."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


# --- when it looks


def glance() -> None:
    """Look, if somebody is to be watched, and say in the panel what is in the way."""
    global _is_looking
    context = bpy.context
    if _is_looking or not context.scene.autopoly_coach.is_watching or _in_the_middle(context):
        return
    _is_looking = True
    try:
        look(context)
    except (CoachError, LessonError) as error:
        say(context, str(error), "ERROR")
    finally:
        _is_looking = False


def _in_the_middle(context: bpy.types.Context) -> bool:
    """Whether something is being dragged; the mesh is not what it is going to be."""
    running = getattr(context.window, "modal_operators", ())  # from Blender 4.2 on
    return any(operator.bl_idname.startswith(MODAL) for operator in running)


@bpy.app.handlers.persistent
def on_change(_scene: Any, depsgraph: Any = None) -> None:
    """Blender has worked out something anew."""
    if depsgraph is None or any(update.is_updated_geometry for update in depsgraph.updates) or not depsgraph.updates:
        glance()


@bpy.app.handlers.persistent
def on_undo(_scene: Any, _depsgraph: Any = None) -> None:
    """Something was undone, or done again."""
    glance()


@bpy.app.handlers.persistent
def on_load(*_: Any) -> None:
    """Another file: what was said was about the one before."""
    _read.clear()
    board = bpy.context.window_manager.autopoly_coach
    board.said = board.of = ""
    board.rows.clear()
    with suppress(CoachError, LessonError):
        show_rows(bpy.context, pupil_of(bpy.context))


HANDLERS = (
    ("depsgraph_update_post", on_change),
    ("undo_post", on_undo),
    ("redo_post", on_undo),
    ("load_post", on_load),
)


def watch() -> None:
    """Begin to look."""
    for name, handler in HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unwatch() -> None:
    """Look no more."""
    for name, handler in HANDLERS:
        if handler in getattr(bpy.app.handlers, name):
            getattr(bpy.app.handlers, name).remove(handler)
