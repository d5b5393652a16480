"""The panel in the sidebar of the 3-D view: the list of steps, what to press, and what the coach says."""

import bpy

from . import session
from .lesson import LessonError, Step
from .session import CoachError
from .telling import HEAD, wrapped

MARGIN, ICON = 50, 28  # pixels of a panel that no text fits into


class StepList(bpy.types.UIList):
    """The steps, under the names of their parts."""

    bl_idname = "AUTOPOLY_UL_steps"

    def draw_item(self, _context, layout, _data, item, _icon, _active, _property, _index=0, _flag=0) -> None:  # type: ignore[no-untyped-def]
        if item.number == HEAD:
            row = layout.row()
            row.active = False
            row.label(text=item.words, icon="OUTLINER_COLLECTION")
        else:
            layout.label(text=item.words)


class CoachPanel(bpy.types.Panel):
    """The coach."""

    bl_idname = "AUTOPOLY_PT_coach"
    bl_label = "AutoPoly Coach"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "AutoPoly"

    def draw(self, context: bpy.types.Context) -> None:
        """Whatever is wrong stands there in a line, and nothing else is lost."""
        board = context.window_manager.autopoly_coach
        self._draw_work(board)
        try:
            self._draw_lesson(context, board)
        except (CoachError, LessonError) as error:
            self._say(context, str(error), "INFO")
            if any(o.type == "MESH" and o.autopoly_coach.lesson for o in context.scene.objects):
                self.layout.operator("autopoly.activate", icon="RESTRICT_SELECT_OFF")

    def _draw_work(self, board) -> None:  # type: ignore[no-untyped-def]
        if board.work:
            row = self.layout.row(align=True)
            if hasattr(row, "progress"):  # from Blender 4.1 on
                row.progress(factor=board.share, text=board.work)
            else:
                row.prop(board, "share", text=board.work, slider=True)
            row.operator("autopoly.cancel", text="", icon="CANCEL")
        else:
            column = self.layout.column(align=True)
            column.operator("autopoly.import_lesson", text="Import Lesson", icon="IMPORT")
            column.operator("autopoly.build", icon="IMAGE_DATA")

    def _draw_lesson(self, context: bpy.types.Context, board) -> None:  # type: ignore[no-untyped-def]
        pupil = session.pupil_of(context)
        lesson, done = session.lesson_of(pupil), session.done_of(pupil)
        settings = context.scene.autopoly_coach
        self.layout.label(text=f"{lesson.name}: step {done} of {lesson.last}", icon="MESH_DATA")
        row = self.layout.row(align=True)
        row.operator("autopoly.back", icon="TRIA_LEFT")
        row.operator("autopoly.forward", icon="TRIA_RIGHT")
        row.operator("autopoly.restore", text="", icon="FILE_REFRESH").step = -1
        if board.of == pupil.name:
            self.layout.template_list(StepList.bl_idname, "", board, "rows", board, "row", rows=5)
            chosen = board.rows[board.row].number if board.row < len(board.rows) else HEAD
            if chosen not in (HEAD, done):
                self.layout.operator("autopoly.restore", text=f"Go to Step {chosen}", icon="FF").step = chosen
        else:
            self.layout.operator("autopoly.activate", text="Show the Steps")
        self.layout.prop(settings, "is_watching", icon="HIDE_OFF", toggle=True)
        if settings.is_watching and done < lesson.last:
            self._draw_task(context, done + 1, lesson.steps[done + 1])
        if board.said:
            self._say(context, board.said, board.icon)
        if settings.is_watching:
            column = self.layout.column(align=True)
            column.operator("autopoly.check", icon="VIEWZOOM")
            column.operator("autopoly.pick", icon="RESTRICT_SELECT_OFF")

    def _draw_task(self, context: bpy.types.Context, number: int, step: Step) -> None:
        box = self.layout.box()
        self._write(context, box, f"{number}  {step.title}" + (f"  ({step.part})" if step.part else ""), "GREASEPENCIL")
        for words, _ in step.lines:
            self._write(context, box, f"• {words}")
        if step.menu:
            self._write(context, box, f"In the menus: {step.menu}")
        if step.why:
            self._write(context, box, step.why)

    def _say(self, context: bpy.types.Context, words: str, icon: str) -> None:
        self._write(context, self.layout.box(), words, icon)

    def _write(self, context: bpy.types.Context, layout: bpy.types.UILayout, words: str, icon: str = "NONE") -> None:
        column = layout.column(align=True)
        column.scale_y = 0.8
        scale = context.preferences.system.ui_scale
        margin = (MARGIN if icon == "NONE" else MARGIN + ICON) * scale
        for number, line in enumerate(wrapped(words, context.region.width - margin, scale)):
            column.label(text=line, icon=icon if number == 0 else ("BLANK1" if icon != "NONE" else "NONE"))


class OptionsPanel(bpy.types.Panel):
    """How the coach judges, and what it draws."""

    bl_idname = "AUTOPOLY_PT_options"
    bl_label = "Options"
    bl_parent_id = "AUTOPOLY_PT_coach"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "AutoPoly"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        for name in ("tolerance", "settles", "shows_names"):
            self.layout.prop(context.scene.autopoly_coach, name)


def draw_menu(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    """The entry of File > Import."""
    menu.layout.operator("autopoly.import_lesson")


CLASSES = (StepList, CoachPanel, OptionsPanel)
