"""Where a mesh stands in a lesson."""

import json

from autopoly_env.export.coach import lesson_of
from blender.autopoly_coach.comparing import Shape
from blender.autopoly_coach.judging import BACK, DONE, LOST, WAITING, WRONG, goal, judge, stands_at
from blender.autopoly_coach.lesson import parse
from tests.helpers.constructions import house

LESSON = parse(json.dumps(lesson_of(house())))
MESHES = [goal(step) for step in LESSON.steps]
NOTHING = Shape({}, frozenset(), {})


def test_next_step__is_right() -> None:
    verdict = judge(MESHES[1], LESSON, 0, 0.01)
    assert verdict.what == DONE and verdict.done == 1
    assert verdict.words == "Step 1 is right. Your turn: step 2, Split a face."


def test_last_step__ends_the_lesson() -> None:
    verdict = judge(MESHES[-1], LESSON, LESSON.last - 1, 0.01)
    assert (verdict.what, verdict.words) == (DONE, "Step 7 is right. That was the last step: house is done.")
    assert judge(MESHES[-1], LESSON, LESSON.last, 0.01).what == WAITING


def test_nothing_done__waits() -> None:
    verdict = judge(MESHES[3], LESSON, 3, 0.01)
    assert (verdict.what, verdict.done, verdict.words) == (WAITING, 3, "Your turn: step 4, Cut a hole.")


def test_two_steps_at_once__are_not_taken_for_one() -> None:
    verdict = judge(MESHES[3], LESSON, 1, 0.01)
    assert verdict.what == WRONG and verdict.done == 1 and "too many" in verdict.words


def test_undo__leads_back_to_the_step_that_the_mesh_is_of() -> None:
    verdict = judge(MESHES[2], LESSON, 4, 0.01)
    assert (verdict.what, verdict.done) == (BACK, 2)
    assert verdict.words == "Back at step 2. Your turn: step 3, Extrude an edge."


def test_fault_from_before__is_told_from_one_of_the_step() -> None:
    moved = Shape({**MESHES[3].places, 1: (0.75, 0.80, 0.0)}, MESHES[3].edges, MESHES[3].faces)
    words = "Vertex 1 is 0.050 from its place (0.750, 0.750): move it there, G 0 Tab -0.05 Enter."
    assert judge(moved, LESSON, 3, 0.01).words == f"The mesh of step 3 has changed: {words}"
    assert judge(moved, LESSON, 2, 0.01).words == words


def test_mesh_of_no_step__is_told_from_the_one_that_is_wanted() -> None:
    assert judge(NOTHING, LESSON, 0, 0.01).words.startswith("5 vertices too few, 5 edges too few, 1 face too few.")
    verdict = stands_at(NOTHING, LESSON, 0, 0.01)
    assert verdict.what == LOST and verdict.words.startswith("This is not the mesh of step 0: 4 vertices too few")
    assert verdict.words.endswith("Undo (Ctrl Z), or press Restore.")
    assert stands_at(MESHES[5], LESSON, 5, 0.01).what == DONE
