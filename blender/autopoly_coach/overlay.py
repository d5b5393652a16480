"""What is drawn over the 3-D view: what to click in orange, where vertices have to come in green, and their names."""

from math import cos, pi, sin

import blf
import bpy
import gpu
from bpy_extras.view3d_utils import location_3d_to_region_2d
from gpu_extras.batch import batch_for_shader
from mathutils import Vector

from . import session
from .lesson import Ids, LessonError, Place, Step
from .session import CoachError

PICKED, FACE, AIMED = (1.0, 0.45, 0.05, 1.0), (1.0, 0.45, 0.05, 0.25), (0.2, 0.85, 0.35, 1.0)
WIDTH, RING, TEXT = 4.0, 9.0, 13  # pixels
_handles: list[object] = []


def draw() -> None:
    """Over the view, in pixels, while somebody is watched."""
    context = bpy.context
    settings = context.scene.autopoly_coach
    if not settings.is_watching:
        return
    try:
        pupil = session.pupil_of(context)
        lesson, done = session.lesson_of(pupil), session.done_of(pupil)
    except (CoachError, LessonError):
        return
    if done == lesson.last:
        return
    before, step = lesson.steps[done], lesson.steps[done + 1]
    pen = _Pen(context, pupil)
    for kind, ids in step.picks:
        pen.pick(before, kind, ids, settings.shows_names)
    for vertex, place in step.aims.items():
        pen.aim(vertex, place, settings.shows_names)


class _Pen:
    """Draws what lies on an object's plane in one view."""

    def __init__(self, context: bpy.types.Context, pupil: bpy.types.Object) -> None:
        self._region, self._view = context.region, context.region_data
        self._matrix = pupil.matrix_world
        self._scale = context.preferences.system.ui_scale
        old = bpy.app.version < (4, 0, 0)
        self._flat = gpu.shader.from_builtin("2D_UNIFORM_COLOR" if old else "UNIFORM_COLOR")
        self._line = gpu.shader.from_builtin("3D_POLYLINE_UNIFORM_COLOR" if old else "POLYLINE_UNIFORM_COLOR")

    def pick(self, step: Step, kind: str, ids: Ids, is_named: bool) -> None:
        """Something to click."""
        ring = step.faces[ids[0]] if kind == "face" and len(ids) == 1 else ids
        points = [point for v in ring if (point := self._at(step.vertices[v])) is not None]
        if len(points) < len(ring):
            return
        if kind == "vertex":
            self._circle(points[0], PICKED, RING * 0.7)
        elif kind == "edge":
            self._lines(points, PICKED)
        else:
            self._lines([*points, points[0]], PICKED)
        if is_named:
            middle = sum(points, Vector((0.0, 0.0))) / len(points)
            self._name("–".join(map(str, ids)), middle, PICKED)

    def aim(self, vertex: int, place: Place, is_named: bool) -> None:
        """A place where a vertex has to come."""
        point = self._at(place)
        if point is not None:
            self._circle(point, AIMED, RING)
            if is_named:
                self._name(str(vertex), point, AIMED)

    def _at(self, place: Place) -> Vector | None:
        return location_3d_to_region_2d(self._region, self._view, self._matrix @ Vector((*place, 0.0)))

    def _circle(self, middle: Vector, colour: tuple[float, ...], radius: float) -> None:
        radius *= self._scale
        ring = [middle + Vector((radius * cos(k * pi / 12), radius * sin(k * pi / 12))) for k in range(25)]
        self._lines(ring, colour, WIDTH / 2)

    def _lines(self, points: list[Vector], colour: tuple[float, ...], width: float = WIDTH) -> None:
        gpu.state.blend_set("ALPHA")
        self._line.bind()
        self._line.uniform_float("viewportSize", (self._region.width, self._region.height))
        self._line.uniform_float("lineWidth", width * self._scale)
        self._line.uniform_float("color", colour)
        batch_for_shader(self._line, "LINE_STRIP", {"pos": [(*point, 0.0) for point in points]}).draw(self._line)
        gpu.state.blend_set("NONE")

    def _name(self, words: str, at: Vector, colour: tuple[float, ...]) -> None:
        size = round(TEXT * self._scale)
        if bpy.app.version < (4, 0, 0):
            blf.size(0, size, 72)
        else:
            blf.size(0, size)
        blf.enable(0, blf.SHADOW)
        blf.shadow(0, 3, 0.0, 0.0, 0.0, 1.0)
        blf.color(0, *colour)
        blf.position(0, at.x + RING * self._scale, at.y + RING * self._scale, 0.0)
        blf.draw(0, words)
        blf.disable(0, blf.SHADOW)


def show() -> None:
    """Begin to draw, where there is a window."""
    if not bpy.app.background:
        _handles.append(bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", "POST_PIXEL"))


def hide() -> None:
    """Draw no more."""
    while _handles:
        bpy.types.SpaceView3D.draw_handler_remove(_handles.pop(), "WINDOW")
