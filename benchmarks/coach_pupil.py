"""Runs inside Blender: takes lessons of the coach as a pupil who does all that the cards say, and as one who errs.

`blender -b --factory-startup --python coach_pupil.py -- QUESTION ANSWER`: QUESTION is JSON with the zip of the coach,
which is installed as people do it, the folder of `autopoly_env/export/byhand`, whose driver does the acts of cards, and
the lessons: each a path and a list of cards. ANSWER becomes a list: of each lesson how many steps were accepted, and of
each error what it was, whether it was accepted, what the coach said, and which words had to be in it. With `--events`,
in a Blender that has a window, the pupil presses the keys and clicks; nobody errs then.
"""

import json
import sys
from collections.abc import Callable, Generator, Iterator
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Any

import bpy  # first: where Blender is a module of Python (pip install bpy), it brings bmesh along

# isort: split
import bmesh
from mathutils import Vector

Places = dict[int, tuple[float, float]]
Acts = dict[str, Callable[[dict], None]]

OFF = 0.05  # unit square; five times the coach's tolerance
FAR = 0.3
SETTLING = 4  # turns of Blender until the coach has seen what was done


def install(path: str) -> None:
    """The coach, as an extension or, before Blender 4.2, as an add-on."""
    if bpy.app.version >= (4, 2, 0):
        bpy.ops.extensions.package_install_files(filepath=path, repo="user_default", enable_on_install=True)
    else:
        bpy.ops.preferences.addon_install(filepath=path)
        bpy.ops.preferences.addon_enable(module="autopoly_coach")


def begin(path: str) -> Any:
    """A lesson in an empty file, its mesh in edit mode, the coach watching."""
    with in_view():
        if bpy.context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        for made in list(bpy.data.objects):
            bpy.data.objects.remove(made)
        bpy.ops.autopoly.import_lesson(filepath=path)
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.context.tool_settings.mesh_select_mode = (True, False, False)
        bpy.ops.mesh.select_all(action="DESELECT")
        if not bpy.app.background:
            bpy.ops.view3d.view_axis(type="TOP")
    bpy.context.scene.autopoly_coach.is_watching = True
    return bpy.context.view_layer.objects.active


def in_view() -> AbstractContextManager[Any]:
    """The 3-D view, where there is a window."""
    if bpy.app.background:
        return nullcontext()
    window = bpy.context.window_manager.windows[0]
    area = max((a for a in window.screen.areas if a.type == "VIEW_3D"), key=lambda a: a.width)
    region = next(r for r in area.regions if r.type == "WINDOW")
    override: AbstractContextManager[Any] = bpy.context.temp_override(window=window, area=area, region=region)
    return override


def said() -> str:
    return str(bpy.context.window_manager.autopoly_coach.said)


def mesh(pupil: Any) -> bmesh.types.BMesh:
    HELD[:] = [bmesh.from_edit_mesh(pupil.data)]
    return HELD[0]


HELD: list[bmesh.types.BMesh] = []  # what Python lets go of, Blender takes back


# --- the pupil who does all that is said


def follow(lesson: dict, acts: Acts, fingers: Any) -> Generator[None, None, dict]:
    """All steps by the acts of their cards; the coach watches, and nothing but the acts is done."""
    pupil = begin(lesson["path"])
    accepted, problem, stood_in = 0, "", 0
    for number, card in enumerate(lesson["cards"][1:], 1):
        try:
            for act in card:
                if act["do"] == "loop" and bpy.app.background and bpy.app.version < (5, 0, 0):
                    bpy.ops.autopoly.forward()  # without a screen older Blenders cut no loop, or end over it
                    stood_in += 1
                    break
                stood_in += act["do"] == "cut" and not fingers
                if fingers and not act.get("entry"):
                    yield from getattr(fingers, act["do"])(act)
                else:
                    acts[act["do"]](act)
                yield
            bpy.context.view_layer.update()
        except Exception as error:
            problem = problem or f"step {number}: {type(error).__name__}: {error}"
        for _ in range(SETTLING if fingers else 0):
            yield
        if pupil.autopoly_coach.done == number:
            accepted += 1
        else:
            problem = problem or f"step {number}: {said()}"
            bpy.ops.autopoly.restore(step=number)
    return {"accepted": accepted, "of": len(lesson["cards"]) - 1, "problem": problem, "stood_in": stood_in}


# --- the pupil who errs


@dataclass(frozen=True)
class Right:
    """A step as it should be made."""

    number: int
    before: Places  # where the vertices lie, by the numbers that the coach gives them
    after: Places
    edges: set[frozenset[int]]  # after it


def err(lesson: dict) -> list[dict]:
    """Every error that can be made at every step, each looked at, and put right again."""
    pupil = begin(lesson["path"])
    bpy.context.scene.autopoly_coach.is_watching = False
    with open(lesson["path"], encoding="utf-8") as stream:
        n_steps = len(json.load(stream)["steps"])
    found = []
    for number in range(1, n_steps):
        for kind, wrong in ERRORS.items():
            bpy.ops.autopoly.restore(step=number - 1)
            before = places(pupil)
            bpy.ops.autopoly.forward()
            names = wrong(pupil, Right(number, before, places(pupil), edges(pupil)))
            if names is None:
                continue
            bmesh.update_edit_mesh(pupil.data)
            pupil.autopoly_coach.done = number - 1
            bpy.ops.autopoly.check()
            is_accepted = pupil.autopoly_coach.done == number
            found.append({"step": number, "kind": kind, "is_accepted": is_accepted, "said": said(), "names": names})
    return found


def places(pupil: Any) -> Places:
    made = mesh(pupil)
    return {v[name_of(made)]: (v.co.x, v.co.y) for v in made.verts}


def edges(pupil: Any) -> set[frozenset[int]]:
    made = mesh(pupil)
    return {frozenset(v[name_of(made)] for v in e.verts) for e in made.edges}


def name_of(made: bmesh.types.BMesh) -> Any:
    return made.verts.layers.int["vertex_id"]


def rim(made: bmesh.types.BMesh) -> list[bmesh.types.BMEdge]:
    return [e for e in made.edges if e.is_boundary]


def move(pupil: Any, name: int, number: int) -> list[str]:
    """A vertex goes one of four ways: right, down, left, and off the plane."""
    made = mesh(pupil)
    (vertex,) = (v for v in made.verts if v[name_of(made)] == name)
    vertex.co += Vector(((OFF, 0.0, 0.0), (0.0, -OFF, 0.0), (-OFF, 0.0, 0.0), (0.0, 0.0, OFF))[number % 4])
    return [f"Vertex {name} is {OFF:.3f} from its place"]


def newest_off(pupil: Any, right: Right) -> list[str]:
    """The newest vertex lies beside its place."""
    return move(pupil, max(right.after), right.number)


def old_off(pupil: Any, right: Right) -> list[str]:
    """A vertex that was there before was moved along."""
    old = sorted(right.before.keys() & right.after.keys())
    return move(pupil, old[right.number % len(old)], right.number + 1)


def other_edge_cut(pupil: Any, right: Right) -> list[str]:
    """The step, and an edge is subdivided."""
    made = mesh(pupil)
    made.edges.ensure_lookup_table()
    bmesh.ops.subdivide_edges(made, edges=[made.edges[right.number % len(made.edges)]], cuts=1)
    return ["1 vertex too many", "1 edge too many"]


def on_itself(pupil: Any, right: Right) -> list[str]:
    """The step, then E and a right-click: an edge lies on itself."""
    made = mesh(pupil)
    bmesh.ops.extrude_edge_only(made, edges=[rim(made)[right.number % len(rim(made))]])
    return ["2 vertices too many", "3 edges too many", "1 face too many", "By Distance"]


def face_gone(pupil: Any, right: Right) -> list[str]:
    """The step, and a face is deleted whose edges stay."""
    made = mesh(pupil)
    made.faces.ensure_lookup_table()
    bmesh.ops.delete(made, geom=[made.faces[right.number % len(made.faces)]], context="FACES_ONLY")
    return ["1 face too few"]


def elsewhere(pupil: Any, right: Right) -> list[str] | None:
    """Where an edge is pulled out, another one is, to the same places."""
    new = sorted(right.after.keys() - right.before.keys())
    if len(new) != 2:
        return None
    bpy.ops.autopoly.restore(step=right.number - 1)
    made = mesh(pupil)
    goals = [Vector((*right.after[name], 0.0)) for name in new]
    farthest = max(rim(made), key=lambda e: sum((v.co - goal).length for v in e.verts for goal in goals))
    ends = list(farthest.verts)
    copies = [
        e for e in bmesh.ops.extrude_edge_only(made, edges=[farthest])["geom"] if isinstance(e, bmesh.types.BMVert)
    ]
    wrong = []
    for copy, name, goal in zip(copies, new, goals, strict=True):
        (source,) = (end for end in ends if any(e.other_vert(end) == copy for e in end.link_edges))
        copy.co = goal
        wrong.append(tuple(sorted((source[name_of(made)], name))))
    extra = [f"There should be no edge {a}–{b}." for a, b in sorted(wrong) if frozenset((a, b)) not in right.edges]
    return extra[:1] or None  # of many differences the first are told


def other_operator(pupil: Any, _right: Right) -> list[str]:
    """The step, and a face is cut in two, or in three."""
    large = max(mesh(pupil).faces, key=lambda f: len(f.verts))
    if len(large.verts) < 4:
        bmesh.ops.poke(HELD[0], faces=[large])
        return ["1 vertex too many", "3 edges too many", "2 faces too many"]
    bmesh.utils.face_split(large, large.verts[0], large.verts[2])
    return ["1 edge too many", "1 face too many"]


def loose(pupil: Any, _right: Right) -> list[str]:
    """The step, and a vertex that belongs to nothing."""
    mesh(pupil).verts.new((FAR, FAR, FAR))
    return ["1 vertex too many", f"The vertex at ({FAR:.3f}, {FAR:.3f}, {FAR:.3f}) should not be there."]


def nothing(pupil: Any, right: Right) -> list[str]:
    """Nothing at all."""
    bpy.ops.autopoly.restore(step=right.number - 1)
    return [f"Your turn: step {right.number}, "]


ERRORS: dict[str, Callable[[Any, Right], list[str] | None]] = {
    "the newest vertex off": newest_off,
    "an old vertex off": old_off,
    "an edge cut, too": other_edge_cut,
    "extruded and cancelled": on_itself,
    "a face deleted": face_gone,
    "another edge pulled": elsewhere,
    "a face cut, too": other_operator,
    "a loose vertex": loose,
    "nothing done": nothing,
}  # each makes the error, and gives the words that have to be in what is said; None where it cannot be made


def take(question: dict, answer: str, fingers: Any = None) -> Iterator[None]:
    """Take all lessons, and write what came of them."""
    from driver import ACTS  # beside the cards

    if fingers:
        yield from fingers.prepare()
    answers = []
    for lesson in question["lessons"]:
        pupil = yield from follow(lesson, ACTS, fingers)
        errors = [] if fingers else err(lesson)
        answers.append({"blender": bpy.app.version_string, "pupil": pupil, "errors": errors})
    with open(answer, "w", encoding="utf-8") as stream:
        json.dump(answers, stream)


def main() -> None:
    """Do so, at once or, with `--events`, whenever Blender has worked off what came before."""
    asked, answer, *options = sys.argv[sys.argv.index("--") + 1 :]
    with open(asked, encoding="utf-8") as stream:
        question = json.load(stream)
    install(question["zip"])
    sys.path.insert(0, question["byhand"])
    if not options:
        for _ in take(question, answer):
            pass
        return
    import driver
    from fingers import Fingers  # beside it

    driver.in_window(take(question, answer, Fingers(driver.view, driver.state)))


if __name__ == "__main__":
    main()
