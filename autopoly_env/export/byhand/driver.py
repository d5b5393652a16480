"""Runs inside Blender: does what cards say, act by act, and notes what Blender is like after each.

`blender -b --factory-startup --python driver.py -- CARDS ANSWER`: CARDS is a JSON list of constructions, each a list of
cards, each a list of acts; ANSWER becomes a list of what came of each construction: what Blender had after every act
and, after every card, its mesh, as far as it came, and what went wrong.

A key does what Blender has it do, with what is selected at that moment: `KEYS` names the operator that it calls, and
the labels of menus and panels are looked up in that operator. Clicks select what lies where the act says. Nothing but
clicks, keys, typed distances and numbers changes the mesh. Two things ask for a screen: the knife, and in Blender 3.4
the loop cut. With one, `--events` moves the pointer and presses the keys for these and for all that one types; without,
the knife's edges are cut by bmesh, which is told as "stand-ins".
"""

import json
import os
import sys
import traceback
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import bpy  # first: where Blender is a module of Python (pip install bpy), it brings bmesh along

# isort: split
import bmesh
from mathutils import Vector

if TYPE_CHECKING:
    from autopoly_env.export.byhand.fingers import Fingers

NEAR = 0.004  # units; a click is meant for what lies no farther away
MODES = {"vertex": "VERT", "edge": "EDGE", "face": "FACE"}
# What Blender's own key map calls, and the property whose choice the menu's entry is, if it is one.
KEYS = {
    ("Right-click", "Subdivide"): ("mesh.subdivide", None),
    ("X", "Faces"): ("mesh.delete", "type"),
    ("X", "Dissolve Vertices"): ("mesh.dissolve_verts", None),
    ("X", "Dissolve Edges"): ("mesh.dissolve_edges", None),
    ("M", "At Center"): ("mesh.merge", "type"),
    ("M", "At Last"): ("mesh.merge", "type"),
    ("F", ""): ("mesh.edge_face_add", None),
    ("J", ""): ("mesh.vert_connect_path", None),
}


HELD: list[bmesh.types.BMesh] = []  # what Python lets go of, Blender takes back


class ActError(Exception):
    """An act could not be done as it is told."""


def mesh() -> bmesh.types.BMesh:
    """The mesh in edit mode."""
    HELD[:] = [bmesh.from_edit_mesh(bpy.context.edit_object.data)]
    return HELD[0]


def place(v: bmesh.types.BMVert) -> tuple[float, float]:
    """Where a vertex lies in the world."""
    point = bpy.context.edit_object.matrix_world @ v.co
    return point.x, point.y


def operator(path: str) -> Any:
    """The operator of this name."""
    room, _, name = path.partition(".")
    return getattr(getattr(bpy.ops, room), name)


def view() -> tuple[bpy.types.Window, bpy.types.Area, bpy.types.Region]:
    """The 3D view."""
    window = bpy.context.window_manager.windows[0]
    area = max((a for a in window.screen.areas if a.type == "VIEW_3D"), key=lambda a: a.width)
    return window, area, next(r for r in area.regions if r.type == "WINDOW")


# --- acts, as calls


def add(_act: dict) -> None:
    bpy.ops.mesh.primitive_plane_add()


def look(_act: dict) -> None:
    if not bpy.app.background:
        window, area, region = view()
        with bpy.context.temp_override(window=window, area=area, region=region):
            bpy.ops.view3d.view_axis(type="TOP")


def tab(_act: dict) -> None:
    bpy.ops.object.editmode_toggle()


def mode(act: dict) -> None:
    bpy.ops.mesh.select_mode(type=MODES[act["kind"]])


def nothing(_act: dict) -> None:
    bpy.ops.mesh.select_all(action="DESELECT")


def found(kind: str, at: list) -> bmesh.types.BMVert | bmesh.types.BMEdge | bmesh.types.BMFace:
    """The element whose corners lie at these places."""
    made, wanted = mesh(), [Vector(p) for p in at]
    group = {"vertex": made.verts, "edge": made.edges, "face": made.faces}[kind]

    def away(element: Any) -> float:
        corners = [Vector(place(v)) for v in ([element] if kind == "vertex" else element.verts)]
        if len(corners) != len(wanted):
            return float("inf")
        return max(min((corner - p).length for corner in corners) for p in wanted)

    best = min(group, key=away, default=None)
    if best is None or away(best) > NEAR:
        raise ActError(f"there is no {kind} at {at}")
    return best


def click(act: dict) -> None:
    """As a click in the view does: it selects, and nothing else stays selected without Shift."""
    if not act["shift"]:
        bpy.ops.mesh.select_all(action="DESELECT")
    element, made = found(act["kind"], act["at"]), mesh()
    element.select_set(True)
    made.select_history.add(element)
    made.select_flush_mode()
    bmesh.update_edit_mesh(bpy.context.edit_object.data)


def drag(act: dict) -> None:
    way = {"value": (*act["by"], 0.0)}
    if act["keys"] == ["G"]:
        bpy.ops.transform.translate(**way)
    elif act["keys"] == ["E"]:  # what view3d.edit_mesh_extrude_move_normal calls for vertices and edges
        bpy.ops.mesh.extrude_region_move(TRANSFORM_OT_translate=way)
    else:
        bpy.ops.mesh.duplicate_move(TRANSFORM_OT_translate=way)


def press(act: dict) -> None:
    if act["typed"]:
        value = float(act["typed"])
        if act["keys"] == ["I"]:
            bpy.ops.mesh.inset(thickness=value)
        else:
            points = [place(v) for v in mesh().verts if v.select]
            middle = sum((Vector((*p, 0.0)) for p in points), Vector()) / len(points)
            bpy.ops.transform.resize(value=(value, value, value), center_override=middle)  # as in a view: the median
        return
    path, choice = KEYS[act["keys"][0], act["entry"]]
    known = operator(path).get_rna_type()
    options = {}
    if choice:
        items = known.properties[choice].enum_items
        options[choice] = next((item.identifier for item in items if item.name == act["entry"]), None)
        if options[choice] is None and choice == "type":  # the entries of merge depend on what is selected
            options[choice] = {"At Center": "CENTER", "At Last": "LAST"}[act["entry"]]
    elif act["entry"] and known.name != act["entry"]:
        raise ActError(f"{path} is called {known.name!r} here, not {act['entry']!r}")
    for label in act["unticked"]:
        options[next(p.identifier for p in known.properties if p.name == label)] = False
    if operator(path)(**options) != {"FINISHED"}:
        raise ActError(f"{path} did nothing")


def loop(act: dict) -> None:
    """The factor is typed while the loop slides; if it slides the other way, so is a minus."""
    if bpy.app.background and bpy.app.version < (4, 0, 0):
        raise ActError("the loop cut asks for a screen in this Blender")  # and ends it without one
    edge = found("edge", act["at"])
    mesh().edges.index_update()
    window, area, region = view()
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.mesh.loopcut_slide(
            MESH_OT_loopcut={"number_cuts": 1, "object_index": 0, "edge_index": edge.index},
            TRANSFORM_OT_edge_slide={"value": 0.0},
        )
        if not act["factor"]:
            return
        middle = [(v.index, v.co.copy()) for v in mesh().verts if v.select]
        bpy.ops.transform.edge_slide(value=act["factor"])
        if min((Vector(place(v)) - Vector(act["to"])).length for v in mesh().verts if v.select) > NEAR:
            made = mesh()
            made.verts.ensure_lookup_table()
            for number, point in middle:
                made.verts[number].co = point
            bpy.ops.transform.edge_slide(value=-act["factor"])


def cut(act: dict) -> None:
    """Stands in for the knife, which asks for a screen: each path splits the face that it runs through."""
    STAND_INS.append("cut")
    for path in act["paths"]:
        begin, end = found("vertex", [path[0]]), found("vertex", [path[-1]])
        world = bpy.context.edit_object.matrix_world.inverted()
        inner = [world @ Vector((x, y, 0.0)) for x, y in path[1:-1]]
        shared = [f for f in begin.link_faces if f in list(end.link_faces)]
        middle = Vector((*path[1], 0.0)) if inner else (begin.co + end.co) / 2
        faces = [f for f in shared if bmesh.geometry.intersect_face_point(f, middle)] or shared
        bmesh.utils.face_split(faces[0], begin, end, coords=inner)
    bpy.ops.mesh.select_all(action="DESELECT")
    bmesh.update_edit_mesh(bpy.context.edit_object.data)


STAND_INS: list[str] = []
FINGERS: list[str] = []  # the acts that are done by events
ACTS = {
    "add": add,
    "view": look,
    "tab": tab,
    "mode": mode,
    "nothing": nothing,
    "click": click,
    "drag": drag,
    "press": press,
    "loop": loop,
    "cut": cut,
}


# --- what Blender is like


def state() -> dict:
    """The select mode, and the places of what is selected in it."""
    if bpy.context.mode != "EDIT_MESH":
        return {"mode": "object", "selected": []}
    modes = bpy.context.tool_settings.mesh_select_mode
    (kind,) = (kind for kind, on in zip(MODES, modes, strict=True) if on)
    made = mesh()
    group = {"vertex": [(v, [v]) for v in made.verts], "edge": [(e, e.verts) for e in made.edges]}.get(
        kind, [(f, f.verts) for f in made.faces]
    )
    return {"mode": kind, "selected": [[place(v) for v in corners] for element, corners in group if element.select]}


def whole() -> dict:
    """The mesh: places, and the corners of edges and faces by number."""
    made = mesh()
    number = {v: k for k, v in enumerate(made.verts)}
    return {
        "counts": [len(made.verts), len(made.edges), len(made.faces)],
        "vertices": [place(v) for v in made.verts],
        "faces": [[number[v] for v in f.verts] for f in made.faces],
    }


def clear() -> None:
    """A new scene without anything in it."""
    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    for made in list(bpy.data.objects):
        bpy.data.objects.remove(made)
    bpy.context.tool_settings.mesh_select_mode = (True, False, False)


def follow(cards: list, fingers: "Fingers | None") -> Iterator[dict]:
    """All cards of a construction, or as many as can be done; gives what came of it last, {} while Blender works."""
    clear()
    answer: dict = {"cards": [], "problem": "", "stand_ins": 0, "blender": bpy.app.version_string}
    STAND_INS.clear()
    for card in cards:
        states: list = []
        answer["cards"].append({"states": states})
        try:
            for act in card:
                if fingers and act["do"] in FINGERS and not act.get("entry"):
                    for _ in getattr(fingers, act["do"])(act):
                        yield {}
                else:
                    ACTS[act["do"]](act)
                states.append(state())
            answer["cards"][-1] |= whole()
        except Exception as error:
            answer["problem"] = " ".join(f"{type(error).__name__}: {error}".split())
            traceback.print_exc()
            break
    answer["stand_ins"] = len(STAND_INS)
    yield answer


def done(asked: str, answer: str, fingers: "Fingers | None" = None) -> Iterator[None]:
    """Do all that is asked for, and write the answer."""
    with open(asked, encoding="utf-8") as stream:
        constructions = json.load(stream)
    if fingers:
        yield from fingers.prepare()
    answers = []
    for cards in constructions:
        came: dict = {}
        for came in follow(cards, fingers):  # noqa: B007, the last one counts
            yield
        answers.append(came)
    with open(answer, "w", encoding="utf-8") as stream:
        json.dump(answers, stream)


def with_fingers(asked: str, answer: str) -> None:
    """The same in a window."""
    sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
    from fingers import Fingers  # beside this file

    fingers = Fingers(view, state)
    in_window(done(asked, answer, fingers))


def in_window(work: Iterator[None]) -> None:
    """Work that goes on whenever Blender has worked off its events, and ends it."""

    def go_on() -> float | None:
        try:
            next(work)
        except StopIteration:
            bpy.ops.wm.quit_blender()
            return None
        return 0.001

    bpy.context.preferences.view.show_splash = False
    bpy.app.timers.register(go_on, first_interval=0.5)


def main() -> None:
    """Do all that is asked for."""
    asked, answer, *options = sys.argv[sys.argv.index("--") + 1 :]
    if options:  # --events mode,click,...
        FINGERS[:] = options[1].split(",")
        with_fingers(asked, answer)
    else:
        for _ in done(asked, answer):
            pass


if __name__ == "__main__":
    main()
