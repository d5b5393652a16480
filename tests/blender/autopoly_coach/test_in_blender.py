"""The coach in real Blender: lessons taken and gone through, and whatever may be in the way.

Blender starts twice for all of these tests, where it is installed, and once more where there is a screen.
"""

from typing import Any

import pytest

from autopoly_env.errors import ConfigError
from autopoly_env.export.blender import find_blender
from autopoly_env.export.byhand import find_screen
from benchmarks.coach_in_blender import problems_of, teach
from tests.helpers.coaching import situations
from tests.helpers.constructions import chapel, house

try:
    find_blender()
    WHY_NOT = ""
except ConfigError as error:
    WHY_NOT = str(error)
pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(WHY_NOT), reason=WHY_NOT)]

STANDS = [[0, 4, 4, 1], [1, 5, 5, 1], [2, 5, 6, 2], [3, 7, 9, 3]]  # the step that is done, V, E, F


@pytest.fixture(scope="module")
def came(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    return situations(tmp_path_factory.mktemp("coach"))


def test_pupil_who_does_as_told__is_accepted_and_no_error_is() -> None:
    for answer in teach([house(), chapel()], seconds=300.0):
        assert problems_of(answer) == []
        assert len(answer["errors"]) > 7 * answer["pupil"]["of"]


# --- files


def test_what_is_no_lesson__is_refused_in_a_line_and_leaves_nothing(came: dict[str, Any]) -> None:
    refused = came["files"]
    assert len(refused["said"]) == 20 and (refused["n_new"], refused["n_meshes"]) == (0, 1)
    assert all(said and "|" not in said and len(said) < 250 for said in refused["said"].values()), refused["said"]
    assert "gone.json is not there" in refused["said"]["gone.json"]
    assert refused["said"]["newer.json"].startswith("the lesson has version 2, and this coach reads 1")
    assert refused["said"]["alone"].startswith("sequence.json is a construction sequence without its lesson")


def test_sequence__is_taken_where_its_lesson_lies_beside_it(came: dict[str, Any]) -> None:
    assert came["sequence_beside_its_lesson"] == ["house", 0, 4, 4, 1]


def test_lesson__is_kept_in_blenders_own_file(came: dict[str, Any]) -> None:
    problem, done, *counts, n_rows, n_pictures = came["lesson_without_its_file"]
    assert (problem, done, counts, n_pictures) == ("", 2, [5, 6, 2], 1)
    assert n_rows > 8  # the list is there at once: the start, seven steps, names of parts


def test_lesson_that_somebody_has_changed__is_refused(came: dict[str, Any]) -> None:
    forward, check, *counts = came["lesson_is_tampered_with"]
    assert forward.startswith("this is no JSON") and check.startswith("this is no JSON") and counts == [4, 4, 1]


# --- going


@pytest.mark.parametrize("mode", ["object", "edit"])
def test_each_step__is_one_undo_step(came: dict[str, Any], mode: str) -> None:
    walk = came[f"walk_in_{mode}_mode"]
    assert walk["stands"] == STANDS
    assert walk["undone"] == [["", *STANDS[2]], ["", *STANDS[1]]]
    assert walk["redone"] == STANDS[2][1:] and walk["back"] == ["", *STANDS[1]]


def test_ends_of_the_lesson__are_told(came: dict[str, Any]) -> None:
    last, at_end, first, at_start, nowhere = came["to_both_ends"]
    assert (last, at_end) == ("step 7 is the last one", [7, 9, 10, 2])
    assert (first, at_start) == ("this is the start", STANDS[0])
    assert nowhere == "there is no step 99; the last one is 7"
    assert came["begins_at_the_end"] == [7, 9, 10, 2]


def test_undo_in_the_middle__leads_back(came: dict[str, Any]) -> None:
    undo = came["undo_in_the_middle"]
    assert undo["done"] == [1, "Step 1 is right. Your turn: step 2, Split a face."]
    assert undo["undone"] == [0, "Back at step 0. Your turn: step 1, Subdivide an edge."]
    assert undo["mesh"] == [4, 4, 1]


def test_tolerance__decides_and_what_fits_is_settled(came: dict[str, Any]) -> None:
    settled, left, refused = came["tolerance_counts"]
    assert settled[:2] == [1, 0.5] and left[:2] == [1, 0.508] and refused[:2] == [0, 0.508]
    assert refused[2] == "Vertex 4 is 0.008 from its place (0.500, 0.875): move it there, G -0.008 Tab 0 Enter."


def test_pick__selects_what_the_step_works_on(came: dict[str, Any]) -> None:
    assert came["picks_what_the_step_works_on"] == ["", [False, True, False], [[[0.25, 0.75], [0.75, 0.75]]]]


# --- what is in the way


def test_another_mesh__is_named_and_left_alone(came: dict[str, Any]) -> None:
    other = came["another_mesh_is_active"]
    assert other["said"][0] == "'Cube' has no lesson; make 'house' active, which has one"
    assert other["cube"] and other["is_back"] and other["stand"] == STANDS[0]
    assert came["nothing_is_active"] == "No object is active; make 'house' active, which has one"


def test_mesh_edited_elsewhere__stays_until_it_is_restored(came: dict[str, Any]) -> None:
    edited = came["mesh_is_edited_elsewhere"]
    assert len(set(edited["said"])) == 1 and edited["kept"]
    assert edited["said"][0].startswith(
        "This is not the mesh of step 2: 1 vertex too few, 2 edges too few, 1 face too few."
    )
    assert edited["said"][0].endswith("Undo (Ctrl Z), or press Restore.")
    assert edited["restored"] == ["", *STANDS[2]]


def test_mesh_turned_over_or_moved_as_a_whole__is_no_fault(came: dict[str, Any]) -> None:
    assert came["mesh_is_turned_over"] == ["", "", "", "", 4, 10, 14, 4]


def test_shape_keys__are_not_lost(came: dict[str, Any]) -> None:
    problem, *left = came["mesh_has_shape_keys"]
    assert problem.startswith("the mesh has shape keys, which would be lost") and left == [2, *STANDS[0]]


def test_operators_that_are_none__are_never_run(came: dict[str, Any]) -> None:
    played = came["operators_that_are_none"]
    assert not played["is_run"] and len(played["came"]) == 8
    for name, (problem, *rest) in played["came"].items():
        assert problem and "|" not in problem and "do it by hand" in problem, name
        assert rest == [*STANDS[0], "", *STANDS[1]], name  # and its step can be gone to
    assert came["by_hand_where_the_operator_is_unknown"] == STANDS[1]


# --- AutoPoly beside Blender


def test_build__shows_its_progress_and_brings_the_lesson(came: dict[str, Any]) -> None:
    problem, twice, work, said, after, n_new = came["builds_from_an_image"]["works"]
    assert (problem, work, after, n_new) == ("", "Building: 0 s", "", 2)  # a mesh and its picture
    assert twice.startswith("AutoPoly is at work already") and said == "Your turn: step 1, Subdivide an edge."
    assert came["builds_from_an_image"]["sequence"][0] == ""
    assert came["builds_from_an_image"]["sequence"][2] == "Your turn: step 1, Subdivide an edge."


def test_build_that_fails__changes_nothing_and_says_why(came: dict[str, Any]) -> None:
    built = came["builds_from_an_image"]
    assert built["fails"][3:] == ["AutoPoly ended with exit code 1: error: 7 is no picture", "", 0]
    assert built["leaves nothing"][3:] == ["AutoPoly ended with exit code 0: a line", "", 0]
    assert built["cancelled"] == ["stopped; nothing was changed", "", True]
    assert built["not set up"].startswith("AutoPoly is not set up") and "is not there" in built["no image"]
    assert built["no python"].startswith("there is no Python at ")


def test_extension__goes_without_a_trace_and_comes_back(came: dict[str, Any]) -> None:
    assert came["goes_without_a_trace"] == {"left": [False, False, False], "again": ""}


@pytest.mark.skipif(not find_screen(), reason="there is no screen: apt-get install xvfb, or set DISPLAY")
def test_pupil_at_a_real_keyboard__is_watched_in_a_window() -> None:
    (answer,) = teach([house(3)], screen=find_screen(), seconds=300.0)
    assert problems_of(answer) == [] and answer["pupil"]["of"] == 3
