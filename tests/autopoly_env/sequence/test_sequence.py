"""Construction sequences: bit-exact through JSON, and one line about everything that can be wrong with a file."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from autopoly_env.errors import OutputError, SequenceError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import OPERATORS, STOP, Action, HoleChoice
from autopoly_env.sequence import ConstructionSequence
from tests.helpers.paths import DOCS
from tests.helpers.strategies import Transition, random_walk, walks

DOCUMENT = DOCS / "sequence-format.md"


def score(total: float = 0.0, iou: float = 0.5, complexity: int = 9) -> dict[str, float]:
    return {"iou": iou, "complexity": complexity, "self_intersections": 0, "total": total}


def record(walk: list[Transition]) -> ConstructionSequence:
    taken = [(step.action, step.choice, step.after, score(float(i))) for i, step in enumerate(walk)]
    return ConstructionSequence.record({"w_sc": 1.0}, walk[0].before, score(-1.0), taken)


def example() -> ConstructionSequence:
    """A quad: its top edge subdivided and the middle raised, split there, and the right part extruded."""
    quad = PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75)
    house = OPERATORS["edge_subdivide"].apply(quad, 0)
    house = house.with_vertices([*house.vertices[:4], (0.5, 0.125)])
    halved = OPERATORS["face_split"].apply(house, 1, 3)
    wider = OPERATORS["edge_extrude"].apply(halved, halved.edge_index(1, 2))
    return ConstructionSequence.record(
        {"w_sc": 1.0},
        quad,
        score(66.0, 0.75, 9),
        [
            (Action("edge_subdivide", 0), None, house, score(79.0, 0.9, 11)),
            (Action("face_split", 1), 3, halved, score(77.0, 0.9, 13)),
            (Action("edge_extrude", halved.edge_index(1, 2)), None, wider, score(79.0, 0.98, 19)),
            (STOP, None, wider, score(79.0, 0.98, 19)),
        ],
    )


def changed(edit: Callable[[dict[str, Any]], object]) -> str:
    """The text of the example after `edit` has changed its data."""
    data = json.loads(example().to_json())
    edit(data)
    return json.dumps(data)


def defect(text: str) -> str:
    """The one line with which a text is refused."""
    with pytest.raises(SequenceError) as caught:
        ConstructionSequence.from_json(text)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_record__names_elements_by_ids_and_lists_moved_vertices_only() -> None:
    first, second, third = example().steps
    assert (first.operator, first.element, first.choice) == ("edge_subdivide", {"edge": [0, 1]}, None)
    assert first.created == {"vertices": [4], "faces": []}
    assert first.moved == ((4, 0.5, 0.125),)
    assert (second.element, second.choice, second.moved) == ({"face": 0, "vertex": 4}, {"to": 2}, ())
    assert second.created == {"vertices": [], "faces": [1]}
    assert (third.element, third.created) == ({"edge": [1, 2]}, {"vertices": [5, 6], "faces": [2]})
    assert third.removed == {"vertices": [], "faces": []}


def test_record__lists_removed_elements() -> None:
    grid = PolyMesh.grid(2, 0.0, 0.0, 1.0, 1.0)
    after = OPERATORS["face_delete"].apply(grid, 3)
    steps = ConstructionSequence.record({}, grid, score(), [(Action("face_delete", 3), None, after, score())]).steps
    assert steps[0].removed == {"vertices": [8], "faces": [3]}


def test_record__writes_down_the_default_choice() -> None:
    quad = PolyMesh.rectangle(0.0, 0.0, 1.0, 1.0)
    after = OPERATORS["face_hole"].apply(quad, 0)
    (step,) = ConstructionSequence.record({}, quad, score(), [(Action("face_hole", 0), None, after, score())]).steps
    assert step.choice is not None
    assert step.choice["points"] == after.vertices[4:].tolist()
    assert [len(bridge) for bridge in step.choice["bridges"]] == [2, 2]


def test_record__accepts_numpy_numbers() -> None:
    quad = PolyMesh.rectangle(0.0, 0.0, 1.0, 1.0)
    action, total = Action("edge_subdivide", np.int64(2)), {**score(), "total": np.float64(0.1)}
    after = OPERATORS["edge_subdivide"].apply(quad, 2)
    sequence = ConstructionSequence.record({"n": np.int32(3)}, quad, total, [(action, None, after, total)])
    assert sequence == ConstructionSequence.from_json(sequence.to_json())
    assert sequence.settings == {"n": 3}


def test_record__refuses_a_mesh_that_the_action_does_not_make() -> None:
    quad = PolyMesh.rectangle(0.0, 0.0, 1.0, 1.0)
    subdivided = OPERATORS["edge_subdivide"].apply(quad, 0)
    for action, after, message in [
        (Action("edge_subdivide", 1), subdivided, "step 1: the mesh after it is not what edge_subdivide makes"),
        (Action("face_delete", 0), quad, "step 1: face_delete cannot work on face 0"),
        (Action("twist", 0), quad, "step 1: operator 'twist' is unknown"),
        (STOP, quad.with_vertices(quad.vertices + 1.0), "step 1: the mesh changed under a stop"),
    ]:
        with pytest.raises(SequenceError, match=message):
            ConstructionSequence.record({}, quad, score(), [(action, None, after, score())])


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), object()])
def test_record__refuses_scores_and_settings_that_json_has_not(bad: object) -> None:
    quad = PolyMesh.rectangle(0.0, 0.0, 1.0, 1.0)
    with pytest.raises(SequenceError, match="cannot be written as JSON"):
        ConstructionSequence.record({}, quad, {**score(), "total": bad}, [])  # type: ignore[dict-item]
    with pytest.raises(SequenceError, match="cannot be written as JSON"):
        ConstructionSequence.record({"setting": bad}, quad, score(), [])


def test_to_json__refuses_a_vertex_that_is_not_finite() -> None:
    quad = PolyMesh.rectangle(0.0, 0.0, 1.0, 1.0)
    lost = quad.with_vertices(np.full((4, 2), np.nan))
    with pytest.raises(SequenceError, match="cannot be written as JSON"):
        ConstructionSequence({}, lost, score()).to_json()


@pytest.mark.slow
@settings(max_examples=25, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(walks())
def test_replay__from_json_gives_every_mesh_bit_for_bit(walk: list[Transition]) -> None:
    sequence = record(walk)
    text = sequence.to_json()
    read = ConstructionSequence.from_json(text)
    assert read == sequence
    assert read.to_json() == text
    expected = [walk[0].before, *(step.after for step in walk)]
    assert read.meshes() == expected
    for mesh, original in zip(read.meshes(), expected, strict=True):
        assert mesh.vertices.tobytes() == original.vertices.tobytes()


def test_replay__keeps_the_hardest_floats() -> None:
    quad = PolyMesh.rectangle(0.0, 0.0, 1.0, 1.0)
    after = OPERATORS["edge_subdivide"].apply(quad, 0)
    hard = [-0.0, 5e-324, 0.1 + 0.2, 1 / 3, np.nextafter(1.0, 2.0), -1e6, -1e-17, 2**-1074, 0.7, 123456.123456789]
    after = after.with_vertices(np.reshape(hard, (5, 2)))
    sequence = ConstructionSequence.record({}, quad, score(), [(Action("edge_subdivide", 0), None, after, score())])
    replayed = ConstructionSequence.from_json(sequence.to_json()).final()
    assert replayed.vertices.tobytes() == after.vertices.tobytes()


def test_meshes__are_the_start_and_one_a_step() -> None:
    meshes = example().meshes()
    assert [mesh.counts for mesh in meshes] == [(4, 4, 1), (5, 5, 1), (5, 6, 2), (7, 9, 3)]
    assert meshes[-1].faces == ((0, 4, 2, 3), (4, 1, 2), (2, 1, 5, 6))
    assert meshes[-1].vertices[4:].tolist() == [[0.5, 0.125], [0.875, 0.25], [0.875, 0.75]]
    assert example().final() == meshes[-1]


def test_trim__keeps_the_first_steps() -> None:
    assert example().trim(1).final().counts == (5, 5, 1)
    assert example().trim(0).final() == example().start
    assert example().trim(3) == example()
    for n in (-1, 4):
        with pytest.raises(SequenceError, match=f"cannot trim 3 steps to {n}; give 0..3"):
            example().trim(n)


def test_best_prefix__is_the_shortest_with_the_highest_total() -> None:
    assert len(example().best_prefix().steps) == 1
    assert len(record(random_walk(0, n_steps=5)).best_prefix().steps) == 5
    assert len(ConstructionSequence({}, example().start, score()).best_prefix().steps) == 0


def test_diff__says_what_differs_in_lines() -> None:
    one = example()
    assert one.diff(one) == ""
    other = ConstructionSequence({"w_sc": 0.3, "seed": 1}, one.start, score(67.0, 0.75, 9), one.steps[:2])
    assert one.diff(other).splitlines() == [
        "setting seed: absent | 1",
        "setting w_sc: 1.0 | 0.3",
        "start: PolyMesh(V=4, E=4, F=1), total 66.00 | PolyMesh(V=4, E=4, F=1), total 67.00",
        "step 3: edge_extrude edge 1–2, 0 moved, total 79.00 | absent",
    ]


def test_save__then_load_gives_the_same_and_leaves_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "house.json"
    example().save(path)
    assert ConstructionSequence.load(path) == example()
    assert [file.name for file in tmp_path.iterdir()] == ["house.json"]


def test_save__says_why_it_cannot(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match=r"cannot write .*(Not a directory|File exists)"):
        example().save(tmp_path / "file" / "house.json")


def test_save__makes_missing_folders(tmp_path: Path) -> None:
    example().save(tmp_path / "absent" / "house.json")
    assert ConstructionSequence.load(tmp_path / "absent" / "house.json") == example()


def test_load__names_the_file_and_the_reason(tmp_path: Path) -> None:
    with pytest.raises(SequenceError, match=r"cannot read .*absent\.json \(No such file"):
        ConstructionSequence.load(tmp_path / "absent.json")
    (tmp_path / "image.json").write_bytes(b"\x89PNG\xff")
    with pytest.raises(SequenceError, match=r"image\.json \(not UTF-8 text\)"):
        ConstructionSequence.load(tmp_path / "image.json")
    (tmp_path / "cut.json").write_text(example().to_json()[:300])
    with pytest.raises(SequenceError, match=r"cut\.json: not JSON"):
        ConstructionSequence.load(tmp_path / "cut.json")


def test_from_json__refuses_a_text_cut_off_anywhere() -> None:
    text = example().to_json().rstrip()
    for length in range(0, len(text), 7):
        assert defect(text[:length]).startswith("not JSON")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("[" * 100_000, "not JSON"),
        ("[1, 2]", "the format is [1, 2], not 'autopoly-construction-sequence'"),
        ("{}", "the format is None"),
        ('{"format": "obj"}', "the format is 'obj'"),
        ('{"format": "autopoly-construction-sequence"}', "the version is None; this release reads versions 1 and 2"),
        ('{"format": "autopoly-construction-sequence", "version": 3}', "the version is 3"),
        ('{"format": "autopoly-construction-sequence", "version": 1}', "settings: Field required"),
    ],
)
def test_from_json__refuses_another_format_or_version(text: str, reason: str) -> None:
    assert reason in defect(text)


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e999", "9" * 400, '"0.5"', "true", "null"])
def test_from_json__refuses_what_is_no_finite_number(number: str) -> None:
    text = example().to_json()
    assert text.count("0.125") == 1
    reason = defect(text.replace("0.125", number))
    assert "not JSON" in reason or reason.startswith("step 1: moved.0.2: ")


@pytest.mark.parametrize(
    ("edit", "reason"),
    [
        (lambda d: d.pop("start"), "start: Field required"),
        (lambda d: d.update(author="me"), "author: Unexpected"),
        (lambda d: d["start"].pop("faces"), "start.faces: Field required"),
        (lambda d: d["start"]["score"].pop("total"), "start: the score has no 'total'"),
        (lambda d: d["start"]["vertices"].append([9, 0.0, 0.0]), "start: vertex 4 belongs to no face"),
        (lambda d: d["start"]["vertices"][0].pop(), "start.vertices.0.2: Field required"),
        (lambda d: d["start"]["faces"][0][1].append(9), "start: face 0 names vertex 9, which does not exist"),
        (lambda d: d["start"]["faces"].clear(), "start: the mesh has no face"),
        (lambda d: d["start"].update(next_vertex_id=3), "start: vertex ids must lie in 0..2"),
        (lambda d: d["start"]["vertices"][1].__setitem__(0, 0), "start: "),
        (lambda d: d.update(steps={}), "steps: "),
        (lambda d: d["steps"][1].pop("score"), "step 2: score: Field required"),
        (lambda d: d["steps"][1]["score"].pop("iou"), "step 2: the score has no 'iou'"),
        (lambda d: d["steps"][1].update(operator=7), "step 2: operator: "),
        (lambda d: d["steps"][1].update(note="x"), "step 2: note: Unexpected"),
        (lambda d: d["steps"][1].update(part=7), "step 2: part: "),
        (lambda d: d["steps"][1].update(operator="twist"), "operator 'twist' is unknown"),
        (lambda d: d["steps"][0].update(element={"edge": [0, 2]}), "no edge joins vertices 0 and 2"),
        (lambda d: d["steps"][0].update(element={"edge": [0, 9]}), "vertex id 9 is not in this mesh"),
        (lambda d: d["steps"][0].update(element={"edge": [0]}), "is not of kind edge"),
        (lambda d: d["steps"][0].update(element={"face": 0}), "is not of kind edge"),
        (lambda d: d["steps"][0].update(element={"edge": [0, -1]}), "step 1: element.edge"),
        (lambda d: d["steps"][0].update(element={"edge": [0, 1], "face": 0}), "is not of kind edge"),
        (lambda d: d["steps"][0].update(choice={"to": 2}), "is not one of edge_subdivide"),
        (lambda d: d["steps"][1].update(element={"face": 1, "vertex": 4}), "face id 1 is not in this mesh"),
        (lambda d: d["steps"][1].update(choice=None), "is not one of face_split"),
        (lambda d: d["steps"][1].update(choice={"to": "2"}), "choice.to is '2'; give an id"),
        (lambda d: d["steps"][1].update(choice={"to": 1}), "no free diagonal"),
        (lambda d: d["steps"][1].update(choice={"to": 8}), "vertex id 8 is not in this mesh"),
        (lambda d: d["steps"][2].update(choice=None, element={"edge": [2, 4]}), "it lies between two faces"),
        (lambda d: d["steps"][0]["created"].update(vertices=[5]), "edge_subdivide creates"),
        (lambda d: d["steps"][0].update(removed={}), "edge_subdivide removes"),
        (lambda d: d["steps"][0].update(moved=[[5, 0.0, 0.0]]), "vertex id 5 is not in this mesh"),
        (lambda d: d["steps"][0].update(moved=[[4, 0.0, 0.0]] * 2), "it moves a vertex twice"),
        (lambda d: d["steps"].pop(0), "step 1, face_split face 0, vertex 4: vertex id 4 is not in this mesh"),
    ],
)
def test_from_json__says_which_step_is_wrong_and_why(edit: Callable[[dict[str, Any]], object], reason: str) -> None:
    assert reason in defect(changed(edit))


def test_from_json__counts_steps_from_one() -> None:
    text = changed(lambda d: d["steps"][2].update(element={"edge": [2, 4]}))
    assert defect(text) == (
        "step 3, edge_extrude edge 2–4: edge_extrude cannot work on edge 5: "
        "it lies between two faces; choose a boundary edge"
    )


@pytest.mark.parametrize(
    ("choice", "reason"),
    [
        (None, "is not one of face_hole"),
        ({"points": [[0.4, 0.4]]}, "choice.bridges: Field required"),
        ({"points": [[0.4]], "bridges": [[0, 0], [2, 2]]}, "choice.points.0.1: Field required"),
        ({"points": [[0.4, 0.4], [0.6, 0.4], [0.5, 0.6]], "bridges": [[0, 0], [9, 2]]}, "vertex id 9"),
        ({"points": [[0.4, 0.4], [0.6, 0.4], [0.5, 0.6]], "bridges": [[0, 0], [2, 9]]}, "does not exist"),
        ({"points": [[0.4, 0.4], [0.6, 0.4], [0.5, 1.6]], "bridges": [[0, 0], [2, 2]]}, "inside the face"),
    ],
)
def test_from_json__refuses_a_hole_that_does_not_fit(choice: dict[str, Any] | None, reason: str) -> None:
    quad = PolyMesh.rectangle(0.0, 0.0, 1.0, 1.0)
    hole = HoleChoice(((0.4, 0.4), (0.6, 0.4), (0.5, 0.6)), ((0, 0), (2, 2)))
    after = OPERATORS["face_hole"].apply(quad, 0, hole)
    sequence = ConstructionSequence.record({}, quad, score(), [(Action("face_hole", 0), hole, after, score())])
    data = json.loads(sequence.to_json())
    assert data["steps"][0]["choice"]["bridges"] == [[0, 0], [2, 2]]
    data["steps"][0]["choice"] = choice
    assert reason in defect(json.dumps(data))
    data["steps"][0]["element"]["sides"] = 5
    assert "is not of kind hole" in defect(json.dumps(data))


def test_documented_example__is_what_the_library_writes() -> None:
    text = DOCUMENT.read_text(encoding="utf-8").split("```json\n")[1].split("```")[0]
    assert text == example().to_json()
