"""Blender: a Python script that rebuilds the mesh there, step by step, with Blender's own operators."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from autopoly_env.errors import ConfigError, SequenceError
from autopoly_env.export.half import check_flat, half_axis
from autopoly_env.export.pictures import picture_url
from autopoly_env.export.replay import finite_meshes, sequence_name, unmoved
from autopoly_env.export.solid import check_depth
from autopoly_env.files import write_atomically
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import operator_named
from autopoly_env.sequence import ConstructionSequence, Step
from autopoly_env.sequence.ids import decoded
from autopoly_env.silhouette import Silhouette

TEMPLATE = Path(__file__).with_name("template.py")  # a whole script; its construction is replaced
BEGIN, END = "# --- the construction ---\n", "# --- what a step is in Blender ---\n"
DIGITS = 7  # behind the point; Blender's own floats have about as many
WIDTH = 100  # columns
PICTURE_SIZE = 768  # pixels a side of the target, at most

Point = tuple[float, float]


def save_blender_script(
    sequence: ConstructionSequence,
    path: str | os.PathLike[str],
    depth: float = 0.0,
    keyframes: bool = False,
    target: Silhouette | None = None,
    *,
    half: bool = False,
) -> Path:
    """Write `blender_script` to a file, whole or not at all. Raises as it does, and OutputError."""
    return write_atomically(path, blender_script(sequence, depth=depth, keyframes=keyframes, target=target, half=half))


def blender_script(
    sequence: ConstructionSequence,
    *,
    depth: float = 0.0,
    keyframes: bool = False,
    target: Silhouette | None = None,
    half: bool = False,
) -> str:
    """The text of a Blender script (ASCII) that makes every step with Blender's operators and checks the counts.

    The mesh lies in the XY plane as in `to_obj`, y up. `depth` (units of the unit square) makes it a closed solid
    below z = 0. `keyframes` makes an object for each step, shown one after the other on the time line. A `target` is
    laid under it as a reference image. Of a `half` the last mesh is cut at its axis, where the object's origin is,
    and has a Mirror modifier. Whatever the sequence holds of text is a string there, never code. docs/blender.md tells
    how to run it.

    Raises SequenceError naming the step that cannot be replayed; ConfigError for a depth below 0 or not finite, or for
    a half with depth or keyframes; OutputError for the half of a mesh that has none.
    """
    check_depth(depth)
    meshes = finite_meshes(sequence)
    if half:
        check_flat(depth)
        if keyframes:
            raise ConfigError("half with keyframes: meshes on the way have no axis; leave one of them out")
    head, _, rest = TEMPLATE.read_text(encoding="utf-8").partition(BEGIN)
    _, _, tail = rest.partition(END)
    constants = [
        f"NAME = {sequence_name(sequence)!a}",
        f"DEPTH = {float(depth)!r}  # thickness, in units of the unit square; 0 is flat",
        f"KEYFRAMES = {bool(keyframes)}  # an object for every step, shown one after the other",
        f"HALF = {half_axis(meshes[-1]) if half else None}  # x at which it is cut, for a Mirror modifier; None: whole",
        f"PICTURE = {_picture(target)!r}  # what is built, a PNG in base64, laid under the mesh",
    ]
    own = _own_code(sequence)
    return "\n".join([head + BEGIN, *constants, "\n", *_build(sequence, meshes), "\n", *own, END + tail])


def _picture(target: Silhouette | None) -> str:
    """A PNG in base64, white where the target is; "" for none."""
    return "" if target is None else picture_url(target, (255, 255, 255), PICTURE_SIZE).partition(",")[2]


def _build(sequence: ConstructionSequence, meshes: list[PolyMesh]) -> list[str]:
    """The lines of the function `build`."""
    begin = meshes[0]
    lines = [
        "def build() -> None:",
        '    """Every step: an operator, where the vertices went, and how many vertices, edges and faces there are."""',
        "    start(",
        f"        {_dict_text(places_of(begin), 8)},",
        f"        {_dict_text(rings_of(begin), 8)},",
        f"        next_vertex={begin.next_vertex_id},",
        f"        next_face={begin.next_face_id},",
        "    )",
        f"    expect({', '.join(map(str, begin.counts))})",
    ]
    for number, (step, before, after) in enumerate(zip(sequence.steps, meshes, meshes[1:], strict=False), 1):
        lines += ["", f"    # Step {number}: IoU {step.score['iou']:.4f}, total {step.score['total']:.2f}"]
        arguments = arguments_of(step, before)
        if arguments is None:
            raise SequenceError(
                f"step {number}: {step.operator} is not known to the Blender script; "
                "teach it there first, Operator.blender"
            )
        left = places_of(after.with_vertices(unmoved(step, before, after)))
        moved = {name: place for name, place in places_of(after).items() if left[name] != place}
        lines.append(f"    {step.operator}({', '.join(map(repr, arguments))})")
        lines += [f"    move({_dict_text(moved, 4)})"] if moved else []
        lines.append(f"    expect({', '.join(map(str, after.counts))})")
    return lines


def arguments_of(step: Step, mesh: PolyMesh) -> list[Any] | None:
    """What the script's function for a step from `mesh` is called with; lists of points are turned to y up.

    None for an operator that does not say.
    """
    operator, element, choice = decoded(mesh, step)
    if operator.blender is None:
        return None
    return [
        [_place(x, y) for x, y in value] if isinstance(value, list) else value
        for value in operator.blender(mesh, element, choice)
    ]


def _own_code(sequence: ConstructionSequence) -> list[str]:
    """The functions that operators bring along."""
    names = dict.fromkeys(step.operator for step in sequence.steps)
    return [f"{code.strip()}\n\n" for name in names if (code := operator_named(name).blender_code)]


def places_of(mesh: PolyMesh) -> dict[int, Point]:
    """Where the vertices lie in Blender, by id."""
    return {name: _place(x, y) for name, (x, y) in zip(mesh.vertex_ids, mesh.vertices.tolist(), strict=True)}


def rings_of(mesh: PolyMesh) -> dict[int, tuple[int, ...]]:
    """The corners of the faces in Blender, where they run the other way round, by id; the first one stays the first."""
    ids = mesh.vertex_ids
    return {
        name: (ids[first], *(ids[v] for v in reversed(others)))
        for name, (first, *others) in zip(mesh.face_ids, mesh.faces, strict=True)
    }


def _place(x: float, y: float) -> Point:
    return round(x, DIGITS) + 0.0, round(1.0 - y, DIGITS) + 0.0


def _dict_text(items: Mapping[int, object], indent: int) -> str:
    """A dict as Python text, broken into lines, the last of which is indented so far, where it is long."""
    lines = [""]
    for name, value in items.items():
        entry = f"{name}: {value}, "
        if len(lines[-1]) + len(entry) > WIDTH:
            lines.append("")
        lines[-1] += entry
    if len(lines) == 1:
        return f"{{{lines[0][:-2]}}}"
    return "\n".join(["{", *(" " * (indent + 4) + line.rstrip() for line in lines), " " * indent + "}"])
