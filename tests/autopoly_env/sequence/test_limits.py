"""What a sequence may hold, and how much of it: each bound is told in one line, before or as it is reached."""

import json
import math
import sys
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import FrameType
from typing import Any

import pytest

from autopoly_env.errors import SequenceError
from autopoly_env.export import to_html
from autopoly_env.mesh import PolyMesh, topology
from autopoly_env.operators import OPERATORS, Action
from autopoly_env.score import ScoreWeights
from autopoly_env.sequence import ConstructionSequence, file, sequence
from autopoly_env.sequence.variation import weights_of
from tests.helpers.sequences import SCORE, gabled


def document_of(points: list[tuple[float, float]], steps: list[dict[str, Any]]) -> str:
    """A sequence that starts with one face."""
    n = len(points)
    start = {
        "vertices": [[k, x, y] for k, (x, y) in enumerate(points)],
        "faces": [[0, list(range(n))]],
        "next_vertex_id": n,
        "next_face_id": 1,
        "score": SCORE,
    }
    head = {"format": file.FORMAT, "version": 1, "settings": {}}
    return json.dumps({**head, "start": start, "steps": steps})


def step(operator: str, element: dict[str, Any], choice: Any, vertices: list[int], faces: list[int]) -> dict[str, Any]:
    nothing: dict[str, list[int]] = {"vertices": [], "faces": []}
    made = {"vertices": vertices, "faces": faces}
    return {
        "operator": operator, "element": element, "choice": choice, "created": made, "removed": nothing, "moved": [],
        "score": SCORE,
    }  # fmt: skip


def chain(n: int) -> str:
    """An edge of a square halved n times, always beside vertex 0."""
    ends = [1, *range(4, 4 + n)]
    steps = [step("edge_subdivide", {"edge": [0, ends[k]]}, None, [4 + k], []) for k in range(n)]
    return document_of([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)], steps)


def circle(n: int) -> str:
    """One face with n corners, cut in two."""
    angles = [2.0 * math.pi * k / n for k in range(n)]
    points = [(0.5 + 0.4 * math.cos(a), 0.5 + 0.4 * math.sin(a)) for a in angles]
    return document_of(points, [step("face_split", {"face": 0, "vertex": 0}, {"to": n // 2}, [], [1])])


def tower(n: int) -> str:
    """Quads one beyond the other, on each of which something is made and taken back: seven operators in turn."""
    mesh = start = PolyMesh.rectangle(0.0, 0.0, 1.0, 1.0)
    taken = []

    def take(operator: str, element: int) -> None:
        nonlocal mesh
        choice = OPERATORS[operator].choice_at(mesh, element)
        mesh = OPERATORS[operator].apply(mesh, element, choice)
        taken.append((Action(operator, element), choice, mesh, SCORE))

    ends = (0, 1)
    for _ in range(n):
        take("edge_extrude", mesh.edge_index(*ends))
        ends, quad = (len(mesh.vertices) - 2, len(mesh.vertices) - 1), len(mesh.faces) - 1
        take("edge_cap", mesh.edge_index(*ends))
        take("face_delete", quad + 1)
        take("edge_subdivide", mesh.edge_index(*ends))
        take("vertex_dissolve", len(mesh.vertices) - 1)
        take("face_split", mesh.topology.first_corner(quad))
        take("edge_dissolve", mesh.edge_index(*set(mesh.faces[quad]).intersection(mesh.faces[quad + 1])))
    return ConstructionSequence.record({}, start, SCORE, taken).to_json()


def instructions(work: Callable[[], object]) -> int:
    """How many instructions Python carries out; a loop inside of one, such as a copy, does not count."""
    count, earlier = 0, sys.gettrace()

    def trace(frame: FrameType, event: str, _argument: Any) -> Callable[..., Any]:
        nonlocal count
        frame.f_trace_opcodes, frame.f_trace_lines = True, False
        count += event == "opcode"
        return trace

    sys.settrace(trace)
    try:
        work()
    finally:
        sys.settrace(earlier)
    return count


@pytest.mark.slow
@pytest.mark.parametrize("text_of", [chain, tower])
def test_replay__takes_instructions_in_proportion_to_the_steps(
    text_of: Callable[[int], str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(topology, "MANY", 0)
    few, many = (replace(ConstructionSequence.from_json(text_of(n))) for n in (40, 80))  # nothing of it is kept
    assert instructions(many.final) < 2.1 * instructions(few.final)  # it was 2.8 and 3.4 times


@pytest.mark.slow
def test_reading__takes_memory_in_proportion_to_the_file() -> None:
    peaks = []
    for n in (100, 400):
        text = chain(n)
        tracemalloc.start()
        assert ConstructionSequence.from_json(text).final().counts == (4 + n, 4 + n, 1)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 6 * peaks[0]  # it was 16 times as much


def test_reading__checks_the_diagonal_that_was_chosen_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("autopoly_env.operators.face_split.split_imbalance", lambda *_: pytest.fail("all were"))
    assert ConstructionSequence.from_json(circle(600)).final().counts == (600, 601, 2)


def test_too_much_work__is_told_with_the_step(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sequence, "MOST_WORK", 60)
    with pytest.raises(SequenceError, match=r"^step 8, edge_subdivide edge 0–10: the mesh has 12 corners, 68 with"):
        ConstructionSequence.from_json(chain(30))


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (circle(file.MOST_CORNERS + 1), "start: its faces have 20001 corners; expected at most 20000"),
        (circle(file.MOST_CORNERS), "step 1, face_split face 0, vertex 0: the mesh has 20002 corners"),
        (" " * (file.MOST_BYTES + 1), "the text has 16000001 letters; expected at most 16000000"),
    ],
    ids=["start", "mesh", "text"],
)
def test_what_is_too_large__is_refused_in_one_line(text: str, problem: str) -> None:
    with pytest.raises(SequenceError) as caught:
        ConstructionSequence.from_json(text)
    assert str(caught.value).startswith(problem)


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="there is no /dev/zero")
def test_device__is_no_sequence() -> None:
    with pytest.raises(SequenceError, match=r"^cannot read /dev/zero \(it is no ordinary file\)"):
        ConstructionSequence.load("/dev/zero")


def put(*path: Any) -> Callable[[Any], None]:
    """Puts the last of the path where the others lead."""
    *places, key, value = path

    def change(document: Any) -> None:
        for place in places:
            document = document[place]
        document[key] = value

    return change


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (put("version", True), "the version is True"),
        (put("version", 1.0), "the version is 1.0"),
        (put("steps", 0, "score", "iou", 7), "step 1: the score's iou is 7; expected 0 to 1"),
        (put("start", "score", "iou", -1e308), "start: the score's iou is -1e+308; expected 0 to 1"),
        (put("steps", 1, "score", "self_intersections", 0.5), "step 2: the score's self_intersections is 0.5"),
        (put("steps", 1, "score", "total", 10**400), "step 2: score.total"),
        (put("start", "score", "total", -(10**400)), "start.score.total"),
        (put("start", "next_vertex_id", 10**20), "start.next_vertex_id"),
        (put("start", "vertices", 0, 1, 1e300), "start.vertices.0.1"),
        (put("steps", 0, "moved", 0, 1, -1e7), "step 1: moved.0.1"),
        (put("start", "\x1b]0;PWN\x07\x1b[2J", 1), r"start.\x1b]0;PWN\x07\x1b[2J"),
        (put("steps", 0, "operator", "x" * 200_000), "step 1, xxx"),
        (put("steps", 0, "element", {"\x1b[2J" * 9999: 3}), r"step 1, edge_subdivide \x1b[2J"),
    ],
)
def test_odd_values__are_refused_with_their_place(change: Callable[[Any], None], problem: str) -> None:
    document = json.loads(gabled().to_json())
    change(document)
    with pytest.raises(SequenceError) as caught:
        ConstructionSequence.from_json(json.dumps(document))
    message = str(caught.value)
    assert message.startswith(problem)
    assert message.isprintable() and len(message) <= 400


@pytest.mark.parametrize("weight", [10**30, 10**400, -1, True, "1", None, [1]])
def test_weights_that_are_none__are_those_by_default(weight: Any) -> None:
    assert weights_of({"w_sc": weight}) == ScoreWeights()


def test_far_coordinates__that_are_accepted_can_be_shown() -> None:
    document = json.loads(gabled().to_json())
    document["steps"][0]["moved"] = [[4, -file.FARTHEST, file.FARTHEST]]
    document["steps"] = document["steps"][:1]
    assert "<html" in to_html(ConstructionSequence.from_json(json.dumps(document)))
