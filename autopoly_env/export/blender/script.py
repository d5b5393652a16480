"""Blender: a Python script that rebuilds the mesh there, step by step, with Blender's own operators."""

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from autopoly_env.errors import SequenceError
from autopoly_env.export.replay import finite_meshes, sequence_name, unmoved
from autopoly_env.export.solid import check_depth
from autopoly_env.files import write_atomically
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import HOLE_SIDES, OPERATORS, Operator
from autopoly_env.sequence import ConstructionSequence, Step
from autopoly_env.sequence.file import parse_hole
from autopoly_env.sequence.ids import element_index

TEMPLATE = Path(__file__).with_name("template.py")  # a whole script; its construction is replaced
BEGIN, END = "# --- the construction ---\n", "# --- what a step is in Blender ---\n"
DIGITS = 7  # behind the point; Blender's own floats have about as many
WIDTH = 100  # columns

Place = tuple[float, float]
Arguments = list[Any]  # integers, and lists of places


def save_blender_script(
    sequence: ConstructionSequence, path: str | os.PathLike[str], depth: float = 0.0, keyframes: bool = False
) -> Path:
    """Write `blender_script` to a file, whole or not at all. Raises as it does, and OutputError."""
    return write_atomically(path, blender_script(sequence, depth=depth, keyframes=keyframes))


def blender_script(sequence: ConstructionSequence, *, depth: float = 0.0, keyframes: bool = False) -> str:
    """The text of a Blender script (ASCII) that makes every step with Blender's operators and checks the counts.

    The mesh lies in the XY plane as in `to_obj`, y up. `depth` (units of the unit square) makes it a closed solid
    below z = 0. `keyframes` makes an object for each step, shown one after the other on the time line. Whatever the
    sequence holds of text is a string there, never code. docs/blender.md tells how to run it.

    Raises SequenceError naming the step that cannot be replayed; ConfigError for a depth below 0 or not finite.
    """
    check_depth(depth)
    meshes = finite_meshes(sequence)
    head, _, rest = TEMPLATE.read_text(encoding="utf-8").partition(BEGIN)
    _, _, tail = rest.partition(END)
    constants = [
        f"NAME = {sequence_name(sequence)!a}",
        f"DEPTH = {float(depth)!r}  # thickness, in units of the unit square; 0 is flat",
        f"KEYFRAMES = {bool(keyframes)}  # an object for every step, shown one after the other",
    ]
    return "\n".join([head + BEGIN, *constants, "\n", *_build(sequence, meshes), "\n", END + tail])


def _build(sequence: ConstructionSequence, meshes: list[PolyMesh]) -> list[str]:
    """The lines of the function `build`."""
    begin, ids = meshes[0], meshes[0].vertex_ids
    faces = {
        name: (ids[first], *(ids[v] for v in reversed(others)))
        for name, (first, *others) in zip(begin.face_ids, begin.faces, strict=True)
    }
    lines = [
        "def build() -> None:",
        '    """Every step: an operator, where the vertices went, and how many vertices, edges and faces there are."""',
        "    start(",
        f"        {_dict_text(_places(begin), 8)},",
        f"        {_dict_text(faces, 8)},",
        f"        next_vertex={begin.next_vertex_id},",
        f"        next_face={begin.next_face_id},",
        "    )",
        f"    expect({', '.join(map(str, begin.counts))})",
    ]
    for number, (step, before, after) in enumerate(zip(sequence.steps, meshes, meshes[1:], strict=False), 1):
        lines += ["", f"    # Step {number}: IoU {step.score['iou']:.4f}, total {step.score['total']:.2f}"]
        element = element_index(before, _operator(step, number).element, step.element)
        left = _places(after.with_vertices(unmoved(step, before, after)))
        moved = {name: place for name, place in _places(after).items() if left[name] != place}
        lines.append(f"    {step.operator}({', '.join(map(repr, _ARGUMENTS[step.operator](step, before, element)))})")
        lines += [f"    move({_dict_text(moved, 4)})"] if moved else []
        lines.append(f"    expect({', '.join(map(str, after.counts))})")
    return lines


def _operator(step: Step, number: int) -> Operator:
    if step.operator not in _ARGUMENTS:
        raise SequenceError(f"step {number}: {step.operator} is not known to the Blender script; teach it there first")
    return OPERATORS[step.operator]


def _edge_subdivide(_step: Step, mesh: PolyMesh, edge: int) -> Arguments:
    return [mesh.vertex_ids[v] for v in mesh.edges[edge]]


def _edge_extrude(_step: Step, mesh: PolyMesh, edge: int) -> Arguments:
    """The ends as the edge's face runs, which is the order of the copies."""
    half_edge, _ = mesh.topology.edge_half_edges[edge]
    return [mesh.vertex_ids[v] for v in mesh.topology.half_edges[half_edge]]


def _face_split(step: Step, mesh: PolyMesh, corner: int) -> Arguments:
    links = mesh.topology.links
    face = links.faces[corner]
    assert step.choice is not None
    return [mesh.face_ids[face], *_backwards(mesh, face, mesh.vertex_ids[links.tails[corner]], step.choice["to"])]


def _face_delete(_step: Step, mesh: PolyMesh, face: int) -> Arguments:
    return [mesh.face_ids[face]]


def _face_hole(step: Step, mesh: PolyMesh, hole: int) -> Arguments:
    plan = parse_hole(step.choice or {})
    corner_of = dict(plan.bridges)
    face = hole // len(HOLE_SIDES)
    a, b = _backwards(mesh, face, *corner_of)
    corners = [_place(x, y) for x, y in plan.points]
    return [mesh.face_ids[face], corners, a, corner_of[a], b, corner_of[b]]


def _vertex_dissolve(_step: Step, mesh: PolyMesh, vertex: int) -> Arguments:
    return [mesh.vertex_ids[vertex]]


def _edge_dissolve(_step: Step, mesh: PolyMesh, edge: int) -> Arguments:
    """The ends and the face that stays."""
    return [*(mesh.vertex_ids[v] for v in mesh.edges[edge]), mesh.face_ids[mesh.topology.edge_faces[edge][0]]]


_ARGUMENTS: dict[str, Callable[[Step, PolyMesh, int], Arguments]] = {
    "edge_subdivide": _edge_subdivide,
    "edge_extrude": _edge_extrude,
    "face_split": _face_split,
    "face_delete": _face_delete,
    "face_hole": _face_hole,
    "vertex_dissolve": _vertex_dissolve,
    "edge_dissolve": _edge_dissolve,
}


def _backwards(mesh: PolyMesh, face: int, *vertices: int) -> list[int]:
    """Vertex ids of a face in the order of its corners, the last one first.

    The new part of a cut face lies between two corners; with y up faces run the other way round.
    """
    corners = [mesh.vertex_ids[v] for v in mesh.faces[face]]
    return sorted(vertices, key=corners.index, reverse=True)


def _places(mesh: PolyMesh) -> dict[int, Place]:
    """Where the vertices lie in Blender, by id."""
    return {name: _place(x, y) for name, (x, y) in zip(mesh.vertex_ids, mesh.vertices.tolist(), strict=True)}


def _place(x: float, y: float) -> Place:
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
