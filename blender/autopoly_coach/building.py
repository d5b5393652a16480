"""AutoPoly at work beside Blender: it builds from a picture, or writes the lesson of a sequence."""

from pathlib import Path

import bpy

from . import scene, session
from .judging import task
from .lesson import LessonError, digest_of, parse, read
from .meshes import MeshError
from .solver import Solver, SolverError

INTERVAL = 0.25  # seconds between two looks
LESSONS = "*lesson.json"
MOST_LESSONS = 50  # files that are looked into, beside a sequence

_at_work: list[Solver] = []  # one at most


def lesson_beside(path: str, sequence: str) -> str | None:
    """The text of the lesson beside a sequence that was made of it, where there is one."""
    for other in sorted(Path(path).parent.glob(LESSONS))[:MOST_LESSONS]:
        try:
            text = read(other)
            if parse(text).of == digest_of(sequence):
                return text
        except LessonError:
            continue
    return None


def build(context: bpy.types.Context, python: str, image: str, seconds: float, style: str) -> None:
    """Have AutoPoly build a mesh of a picture. Raises SolverError if that cannot begin."""
    arguments = ["agents.solve", image, "--out", "{out}", "--style", style, "--seconds", f"{seconds:g}"]
    _start(context, python, arguments, "*/lesson.json", seconds)


def convert(context: bpy.types.Context, python: str, path: str) -> None:
    """Have AutoPoly write the lesson of a sequence. Raises SolverError if that cannot begin."""
    if not python:
        raise SolverError(
            f"{Path(path).name} is a construction sequence without its lesson; choose the lesson.json that "
            "agents.solve writes beside it, or agents.export --to coach"
        )
    _start(context, python, ["agents.export", path, "--to", "coach", "--out", "{out}"], LESSONS, 0.0)


def cancel(context: bpy.types.Context) -> None:
    """Stop it."""
    for solver in _at_work:
        solver.stop()
        _show(context, solver.words, solver.share)


def look_after() -> float | None:
    """See how far it is, and import what it has made; the seconds until the next look, None if there is none."""
    context = bpy.context
    if not _at_work:
        return None
    (solver,) = _at_work
    if solver.is_running:
        _show(context, solver.words, solver.share)
        return INTERVAL
    _at_work.clear()
    _show(context, "", 0.0)
    try:
        pupil = scene.add(context, read(solver.result()))
        session.set_done(context, pupil, 0)
        session.say(context, task(session.lesson_of(pupil), 0), "INFO")
        bpy.ops.ed.undo_push(message="AutoPoly")
    except (LessonError, MeshError, SolverError, RuntimeError) as error:
        session.say(context, str(error), "ERROR")
    finally:
        solver.clear()
    return None


def end() -> None:
    """Leave nothing running."""
    for solver in _at_work:
        solver.clear()
    _at_work.clear()
    if bpy.app.timers.is_registered(look_after):
        bpy.app.timers.unregister(look_after)


def _start(context: bpy.types.Context, python: str, arguments: list[str], expected: str, seconds: float) -> None:
    if _at_work:
        raise SolverError("AutoPoly is at work already; wait for it, or cancel it")
    _at_work.append(Solver(python, arguments, expected, seconds))
    _show(context, _at_work[0].words, 0.0)
    if not bpy.app.timers.is_registered(look_after):
        bpy.app.timers.register(look_after, first_interval=INTERVAL)


def _show(context: bpy.types.Context, words: str, share: float) -> None:
    board = context.window_manager.autopoly_coach
    board.work, board.share = words, share
    session.redraw(context)
