"""Runs inside a Blender with a window: the coach in the middle of a lesson, as a picture of the window.

`blender --factory-startup --enable-event-simulate --python coach_window.py -- QUESTION ANSWER`: QUESTION is JSON with
the zip of the coach, the lesson, the step that is to be done, and where the picture goes; ANSWER becomes what the coach
says.
"""

import json
import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
from coach_pupil import install

ASKED, ANSWER = sys.argv[sys.argv.index("--") + 1 :]
with open(ASKED, encoding="utf-8") as stream:
    QUESTION = json.load(stream)
TAB = 165  # pixels below the top of the sidebar


def prepare() -> float | None:
    """The lesson from above, its sidebar open."""
    window = bpy.context.window_manager.windows[0]
    area = max((a for a in window.screen.areas if a.type == "VIEW_3D"), key=lambda a: a.width)
    region = next(r for r in area.regions if r.type == "WINDOW")
    space = area.spaces[0]
    space.show_region_ui, space.show_gizmo = True, False
    with bpy.context.temp_override(window=window, area=area, region=region):
        for made in list(bpy.data.objects):
            bpy.data.objects.remove(made)
        bpy.ops.autopoly.import_lesson(filepath=QUESTION["lesson"])
        bpy.ops.object.mode_set(mode="EDIT")
        for _ in range(QUESTION["step"] - 1):
            bpy.ops.autopoly.forward()
        bpy.context.scene.autopoly_coach.is_watching = True
        bpy.ops.autopoly.check()
        bpy.ops.view3d.view_axis(type="TOP")
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.view3d.view_selected()
        bpy.ops.mesh.select_all(action="DESELECT")
    return None


def sidebar() -> bpy.types.Region:
    """The sidebar of the 3-D view."""
    areas = (a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "VIEW_3D")
    return next(region for region in max(areas, key=lambda a: a.width).regions if region.type == "UI")


def send(kind: str, value: str, x: int, y: int) -> None:
    """An event of the mouse."""
    bpy.context.window_manager.windows[0].event_simulate(type=kind, value=value, x=x, y=y)


def open_tab() -> float | None:
    """The tab of the coach, clicked."""
    region = sidebar()
    x, y = region.x + region.width - 8, region.y + region.height - TAB
    send("MOUSEMOVE", "NOTHING", x, y)
    send("LEFTMOUSE", "PRESS", x, y)
    send("LEFTMOUSE", "RELEASE", x, y)
    return None


def leave() -> float | None:
    """The pointer, where it covers nothing."""
    send("MOUSEMOVE", "NOTHING", 500, 120)
    return None


def shoot() -> float | None:
    """The picture, and the end."""
    bpy.ops.screen.screenshot(filepath=QUESTION["picture"])
    with open(ANSWER, "w", encoding="utf-8") as answer:
        json.dump(bpy.context.window_manager.autopoly_coach.said, answer)
    bpy.ops.wm.quit_blender()
    return None


bpy.context.preferences.view.show_splash = False
bpy.context.preferences.view.smooth_view = 0
install(QUESTION["zip"])
for number, call in enumerate((prepare, open_tab, leave, shoot), 1):
    bpy.app.timers.register(call, first_interval=1.5 * number)
