"""Runs inside Blender: gets the coach into one situation after the other, and notes what it says.

`blender -b --factory-startup --python coach_in_blender.py -- QUESTION ANSWER`: QUESTION is JSON with the zip, a folder
with files to import, and the path of a Python; ANSWER becomes an object with what came of each situation, by its name.
"""

import json
import os
import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy  # first: where Blender is a module of Python (pip install bpy), it brings bmesh along

# isort: split
import bmesh

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
from coach_pupil import install  # type: ignore[import-not-found]

SITUATIONS: dict[str, Callable[[], Any]] = {}
QUESTION: dict[str, Any] = {}


def situation(play: Callable[[], Any]) -> Callable[[], Any]:
    SITUATIONS[play.__name__] = play
    return play


def call(operator: Any, **options: Any) -> str:
    """What an operator reports as an error, or nothing."""
    try:
        operator(**options)
    except RuntimeError as error:
        return " | ".join(str(error).strip().splitlines()).removeprefix("Error: ")
    return ""


def file(name: str) -> str:
    return str(Path(QUESTION["folder"], name))


def fresh(name: str = "house.lesson.json", mode: str = "OBJECT") -> Any:
    """A lesson in an otherwise empty file, from which on everything can be undone."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    if not hasattr(bpy.types.Object, "autopoly_coach"):
        install(QUESTION["zip"])
    bpy.ops.autopoly.import_lesson(filepath=file(name))
    pupil = active()
    bpy.ops.object.mode_set(mode=mode)
    bpy.ops.ed.undo_push(message="begin")
    return pupil


def active() -> Any:
    return bpy.context.view_layer.objects.active


def board() -> Any:
    return bpy.context.window_manager.autopoly_coach


def counts() -> list[int]:
    """V, E, F of the active mesh."""
    made = bmesh.new()
    if bpy.context.mode == "EDIT_MESH":
        active().update_from_editmode()
    made.from_mesh(active().data)
    found = [len(made.verts), len(made.edges), len(made.faces)]
    made.free()
    return found


def stand() -> list[Any]:
    """The step that is done, and the mesh."""
    return [active().autopoly_coach.done, *counts()]


# --- files


@situation
def files() -> Any:
    """Each file of the folder that is no lesson, and one that is not there."""
    fresh()
    n_objects, said = len(bpy.data.objects), {}
    for name in (*sorted(os.listdir(QUESTION["folder"])), "gone.json"):
        if not name.startswith("house") and name.endswith(".json"):
            said[name] = call(bpy.ops.autopoly.import_lesson, filepath=file(name))
    said["alone"] = call(bpy.ops.autopoly.import_lesson, filepath=file("alone/sequence.json"))
    return {"said": said, "n_new": len(bpy.data.objects) - n_objects, "n_meshes": len(bpy.data.meshes)}


@situation
def sequence_beside_its_lesson() -> Any:
    """The sequence is chosen, where its lesson lies beside it."""
    fresh("with/sequence.json")
    return [active().name, *stand()]


@situation
def lesson_without_its_file() -> Any:
    """The file is gone after it was imported, and Blender's own file is opened again."""
    path = Path(file("house.lesson.json"))
    text = path.read_text(encoding="utf-8")
    fresh()
    bpy.ops.autopoly.forward()
    path.unlink()
    bpy.ops.wm.save_as_mainfile(filepath=file("saved.blend"))
    bpy.ops.wm.open_mainfile(filepath=file("saved.blend"))
    path.write_text(text, encoding="utf-8")
    rows = len(board().rows)
    problem = call(bpy.ops.autopoly.forward)
    return [problem, *stand(), rows, len([o for o in bpy.data.objects if o.type == "EMPTY"])]


@situation
def lesson_is_tampered_with() -> Any:
    """Somebody has changed the lesson that the object keeps."""
    pupil = fresh()
    pupil.autopoly_coach.lesson = pupil.autopoly_coach.lesson[:200]
    return [call(bpy.ops.autopoly.forward), call(bpy.ops.autopoly.check), *counts()]


# --- going


def walk(mode: str) -> Any:
    fresh(mode=mode)
    stands = [stand()]
    for _ in range(3):
        bpy.ops.autopoly.forward("EXEC_DEFAULT", True)  # as by a person: Blender makes an undo step of it
        stands.append(stand())
    undone = []
    for _ in range(2):
        bpy.ops.ed.undo()
        undone.append([call(bpy.ops.autopoly.check), *stand()])
    bpy.ops.ed.redo()
    call(bpy.ops.autopoly.check)
    return {"stands": stands, "undone": undone, "redone": counts(), "back": [call(bpy.ops.autopoly.back), *stand()]}


@situation
def walk_in_object_mode() -> Any:
    return walk("OBJECT")


@situation
def walk_in_edit_mode() -> Any:
    return walk("EDIT")


@situation
def to_both_ends() -> Any:
    """Forward past the last step, back before the first, to a step that is not there."""
    fresh()
    while not (last := call(bpy.ops.autopoly.forward)):
        pass
    at_end = stand()
    while not (first := call(bpy.ops.autopoly.back)):
        pass
    return [last, at_end, first, stand(), call(bpy.ops.autopoly.restore, step=99)]


@situation
def begins_at_the_end() -> Any:
    fresh()
    bpy.ops.autopoly.import_lesson(filepath=file("house.lesson.json"), begin_at="END")
    return stand()


# --- what is in the way


@situation
def another_mesh_is_active() -> Any:
    pupil = fresh()
    bpy.ops.mesh.primitive_cube_add()
    before = counts()
    said = [call(bpy.ops.autopoly.check), call(bpy.ops.autopoly.forward)]
    said.append(call(bpy.ops.autopoly.activate))
    return {"said": said, "cube": before == [8, 12, 6], "is_back": active() == pupil, "stand": stand()}


@situation
def nothing_is_active() -> Any:
    fresh()
    bpy.context.view_layer.objects.active = None
    return call(bpy.ops.autopoly.check)


@situation
def mesh_is_edited_elsewhere() -> Any:
    """A face is deleted by somebody else; nothing goes on until it is put right."""
    fresh(mode="EDIT")
    bpy.ops.autopoly.forward()
    bpy.ops.autopoly.forward()
    made = bmesh.from_edit_mesh(active().data)
    bmesh.ops.delete(made, geom=list(made.faces)[:1], context="FACES")
    bmesh.update_edit_mesh(active().data)
    spoilt = counts()
    said = [call(bpy.ops.autopoly.forward), call(bpy.ops.autopoly.back), call(bpy.ops.autopoly.pick)]
    still = counts()
    return {"said": said, "kept": spoilt == still, "restored": [call(bpy.ops.autopoly.restore), *stand()]}


@situation
def mesh_is_turned_over() -> Any:
    """Normals look down, and the object lies elsewhere: that is no fault."""
    fresh(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.flip_normals()
    active().location.x = 3.0
    said = [call(bpy.ops.autopoly.forward) for _ in range(4)]
    return [*said, *stand()]


@situation
def mesh_has_shape_keys() -> Any:
    fresh()
    active().shape_key_add(name="Basis")
    active().shape_key_add(name="bent")
    return [call(bpy.ops.autopoly.forward), len(active().data.shape_keys.key_blocks), *stand()]


@situation
def undo_in_the_middle() -> Any:
    """Watched, the first step is done by hand, and undone."""
    fresh(mode="EDIT")
    bpy.context.scene.autopoly_coach.is_watching = True
    by_hand()
    bpy.ops.ed.undo_push(message="by hand")
    bpy.context.view_layer.update()
    done = [active().autopoly_coach.done, board().said]
    bpy.ops.ed.undo()
    bpy.context.view_layer.update()
    return {"done": done, "undone": [active().autopoly_coach.done, board().said], "mesh": counts()}


def by_hand(off: float = 0.0) -> None:
    """The first step of the house: an edge cut, its new vertex raised."""
    made = bmesh.from_edit_mesh(active().data)
    top = max(made.edges, key=lambda e: sum(v.co.y for v in e.verts))
    new = bmesh.ops.subdivide_edges(made, edges=[top], cuts=1)["geom_inner"]
    next(e for e in new if isinstance(e, bmesh.types.BMVert)).co = (0.5 + off, 0.875, 0.0)
    bmesh.update_edit_mesh(active().data)


@situation
def tolerance_counts() -> Any:
    """0.008 beside its place is right by 0.01, and settled; by 0.005 it is not."""
    came = []
    for tolerance, settles in ((0.01, True), (0.01, False), (0.005, True)):
        fresh(mode="EDIT")
        settings = bpy.context.scene.autopoly_coach
        settings.tolerance, settings.settles = tolerance, settles
        by_hand(0.008)
        bpy.ops.autopoly.check()
        made = bmesh.from_edit_mesh(active().data)
        highest = max(made.verts, key=lambda v: v.co.y)
        came.append([active().autopoly_coach.done, round(highest.co.x, 4), board().said])
    return came


@situation
def picks_what_the_step_works_on() -> Any:
    fresh(mode="EDIT")
    problem = call(bpy.ops.autopoly.pick)
    made = bmesh.from_edit_mesh(active().data)
    chosen = [sorted([round(v.co.x, 3), round(v.co.y, 3)] for v in e.verts) for e in made.edges if e.select]
    return [problem, list(bpy.context.tool_settings.mesh_select_mode), chosen]


# --- lessons that are not meant well


@situation
def operators_that_are_none() -> Any:
    """What is named or given as an operator is not what Blender has: nothing happens but a line."""
    came = {}
    for name in sorted(n for n in os.listdir(QUESTION["folder"]) if n.startswith("house-")):
        fresh(name)
        came[name] = [call(bpy.ops.autopoly.forward), *stand(), call(bpy.ops.autopoly.restore, step=1), *stand()]
    return {"came": came, "is_run": os.path.exists(file("was-run"))}


@situation
def by_hand_where_the_operator_is_unknown() -> Any:
    fresh("house-unknown.json", mode="EDIT")
    by_hand()
    bpy.ops.autopoly.check()
    return stand()


# --- AutoPoly beside Blender


def worked_off(seconds: float = 60.0) -> None:
    """The timer, until it has nothing to look after."""
    module = next(sys.modules[name] for name in list(sys.modules) if name.endswith("autopoly_coach.building"))
    end = time.monotonic() + seconds
    while module.look_after() is not None and time.monotonic() < end:
        time.sleep(0.05)


def set_python(path: str) -> None:
    name = next(n for n in bpy.context.preferences.addons.keys() if n.endswith("autopoly_coach"))  # noqa: SIM118
    bpy.context.preferences.addons[name].preferences.python = path


@situation
def builds_from_an_image() -> Any:
    fresh()
    came = {}
    set_python("")
    came["not set up"] = call(bpy.ops.autopoly.build, filepath=file("house.png"))
    set_python(file("no-python"))
    came["no python"] = call(bpy.ops.autopoly.build, filepath=file("house.png"))
    set_python(QUESTION["python"])
    came["no image"] = call(bpy.ops.autopoly.build, filepath=file("gone.png"))
    for name in ("works", "fails", "leaves nothing"):
        n_objects = len(bpy.data.objects)
        problem = call(bpy.ops.autopoly.build, filepath=file(f"{name}.png"))
        twice = call(bpy.ops.autopoly.build, filepath=file("house.png"))
        work = board().work
        worked_off()
        came[name] = [problem, twice, work, board().said, board().work, len(bpy.data.objects) - n_objects]
    bpy.ops.autopoly.build(filepath=file("hangs.png"))
    begin = time.monotonic()
    bpy.ops.autopoly.cancel()
    worked_off()
    came["cancelled"] = [board().said, board().work, time.monotonic() - begin < 30.0]
    came["sequence"] = [call(bpy.ops.autopoly.import_lesson, filepath=file("alone/sequence.json"))]
    worked_off()
    came["sequence"] += [active().name, board().said]
    return came


@situation
def goes_without_a_trace() -> Any:
    """Taken away and put back: nothing is left over, and it works again."""
    fresh()
    name = next(n for n in bpy.context.preferences.addons.keys() if n.endswith("autopoly_coach"))  # noqa: SIM118
    bpy.ops.preferences.addon_disable(module=name)
    left = [hasattr(bpy.types.Object, "autopoly_coach"), hasattr(bpy.types, "AUTOPOLY_PT_coach")]
    left.append(any("autopoly" in h.__module__ for h in bpy.app.handlers.depsgraph_update_post))
    bpy.ops.preferences.addon_enable(module=name)
    return {"left": left, "again": call(bpy.ops.autopoly.import_lesson, filepath=file("house.lesson.json"))}


def main() -> None:
    """Play all, and write what came of it."""
    asked, answer = sys.argv[sys.argv.index("--") + 1 :]
    with open(asked, encoding="utf-8") as stream:
        QUESTION.update(json.load(stream))
    install(QUESTION["zip"])
    came: dict[str, Any] = {"blender": bpy.app.version_string}
    for name, play in SITUATIONS.items():
        try:
            came[name] = play()
        except Exception:
            came[name] = traceback.format_exc()
    with open(answer, "w", encoding="utf-8") as stream:
        json.dump(came, stream)


if __name__ == "__main__":
    main()
