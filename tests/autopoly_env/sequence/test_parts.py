"""The parts of a construction: who made what, what begins a part, what goes back to one, what parts are called."""

from dataclasses import replace

import pytest
from hypothesis import given

from autopoly_env.errors import SequenceError
from autopoly_env.mesh import PolyMesh
from autopoly_env.sequence import ConstructionSequence, Lesson, Step, parts_of
from tests.helpers.constructions import house
from tests.helpers.lessons import subdivided
from tests.helpers.sequences import SCORE
from tests.helpers.strategies import Transition, walks
from tests.helpers.tables import a_step, table

SLAB = PolyMesh.rectangle(0.2, 0.3, 0.8, 0.4)  # vertices 0 to 3 from the upper left, clockwise
RIGHT_ARM = a_step("edge_extrude", {"edge": [1, 2]}, (4, 0.9, 0.3), (5, 0.9, 0.4))
LEFT_ARM = a_step("edge_extrude", {"edge": [0, 3]}, (6, 0.1, 0.4), (7, 0.1, 0.3))
RIGHT_HAND = a_step("edge_extrude", {"edge": [4, 5]}, (6, 1.0, 0.3), (7, 1.0, 0.4))
RIGHT_THUMB = a_step("edge_extrude", {"edge": [1, 4]}, (6, 0.8, 0.1), (7, 0.9, 0.1))
CUT_IN_BODY = a_step("edge_subdivide", {"edge": [0, 1]})
CUT_IN_ARM = a_step("edge_subdivide", {"edge": [2, 5]})


def built(*steps: Step) -> ConstructionSequence:
    sequence = ConstructionSequence.record({}, SLAB, SCORE, [])
    for step in steps:
        sequence = sequence.with_step(len(sequence.steps), insert=step)
    return sequence


def numbers(*steps: Step) -> tuple[int, ...]:
    return parts_of(built(*steps)).of_steps


def test_parts__of_a_table_are_its_slab_and_its_legs_by_order_and_place() -> None:
    parts = parts_of(table())
    assert parts.names == ("body", "lower right, 1 of 2", "lower left, 2 of 2")
    assert parts.of_steps == (0, 0, 1, 2)
    assert [parts.name(step) for step in (1, 4)] == ["body", "lower left, 2 of 2"]
    assert parts.n_returns == Lesson.of(table()).returns == 0


def test_parts__of_no_steps_are_the_body() -> None:
    assert parts_of(subdivided()) == parts_of(built())
    assert (parts_of(built()).names, parts_of(built()).of_steps) == (("body",), ())


def test_parts__begin_where_something_grows_out_of_the_body() -> None:
    assert numbers(RIGHT_ARM) == (1,)
    assert numbers(RIGHT_ARM, LEFT_ARM) == (1, 2)
    assert numbers(CUT_IN_BODY) == (0,)


def test_parts__keep_what_grows_out_of_them_and_what_is_done_to_them() -> None:
    assert numbers(RIGHT_ARM, RIGHT_HAND) == (1, 1)  # at its far edge
    assert numbers(RIGHT_ARM, RIGHT_THUMB) == (1, 1)  # at its side, one end of which is the body's
    assert numbers(RIGHT_ARM, CUT_IN_ARM) == (1, 1)
    split = replace(a_step("face_split", {"face": 1, "vertex": 1}), choice={"to": 5})
    assert numbers(RIGHT_ARM, split) == (1, 1)
    assert numbers(RIGHT_ARM, CUT_IN_ARM, a_step("vertex_dissolve", {"vertex": 6})) == (1, 1, 1)
    assert numbers(RIGHT_ARM, a_step("face_delete", {"face": 1})) == (1, 1)


def test_parts__of_splits_and_holes_of_the_body_are_the_body() -> None:
    """The gable and the hole are; what step 3 pulls out to the right is not, and steps 5 and 6 take of it."""
    assert parts_of(house()).of_steps == (0, 0, 1, 0, 1, 1, 0)
    assert parts_of(house()).names == ("body", "right")
    assert parts_of(house()).n_returns == 3  # steps 4, 5 and 7


def test_parts__own_what_joins_them_to_the_body() -> None:
    """The edge between body and arm is the body's; dissolved, it takes a face of the arm with it."""
    assert numbers(RIGHT_ARM, LEFT_ARM, a_step("edge_dissolve", {"edge": [1, 2]})) == (1, 2, 1)


@pytest.mark.parametrize(
    ("steps", "n"),
    [
        ((RIGHT_ARM, RIGHT_HAND), 0),
        ((RIGHT_ARM, LEFT_ARM), 0),  # to a part that was not there yet
        ((RIGHT_ARM, CUT_IN_BODY), 1),  # the body is there from the start
        ((RIGHT_ARM, LEFT_ARM, CUT_IN_ARM), 1),
        ((RIGHT_ARM, LEFT_ARM, CUT_IN_ARM, a_step("edge_subdivide", {"edge": [1, 4]})), 1),  # and stays there
        ((RIGHT_ARM, LEFT_ARM, CUT_IN_ARM, a_step("edge_subdivide", {"edge": [6, 7]})), 2),
        ((CUT_IN_BODY, a_step("edge_subdivide", {"edge": [0, 4]})), 0),
    ],
)
def test_returns__are_steps_that_go_back_to_a_part_that_was_left(steps: tuple[Step, ...], n: int) -> None:
    assert parts_of(built(*steps)).n_returns == Lesson.of(built(*steps)).returns == n


def test_labels__come_before_what_can_be_found_out() -> None:
    parts = parts_of(table().with_parts([None, None, "right leg", None]))
    assert (parts.names, parts.of_steps) == (("body", "right leg", "lower left, 2 of 2"), (0, 0, 1, 2))
    parts = parts_of(table().with_parts([None, "left leg", None, None]))  # and so it has edge 3–5
    assert (parts.names, parts.of_steps) == (("body", "left leg", "lower right, 2 of 2"), (0, 1, 2, 1))


def test_labels__of_the_body_and_of_one_part_twice_are_one_part() -> None:
    assert parts_of(table().with_parts(["body", "a", "body", "a"])).of_steps == (0, 1, 0, 1)
    assert parts_of(table().with_parts(["body", "a", "body", "a"])).n_returns == 2


def test_labels__come_back_from_json_and_make_it_version_2() -> None:
    plain, labelled = table(), table().with_parts([None, None, "leg 1", "Bein ü 2"])
    assert '"version": 1' in plain.to_json() and '"part"' not in plain.to_json()
    assert '"version": 2' in labelled.to_json() and labelled.to_json().count('"part"') == 2
    again = ConstructionSequence.from_json(labelled.to_json())
    assert again == labelled != plain
    assert again.parts == (None, None, "leg 1", "Bein ü 2")
    assert again.with_parts([None] * 4).to_json() == plain.to_json()
    assert "step 3: edge_extrude" in plain.diff(labelled) and "leg 1: edge_extrude" in plain.diff(labelled)


def test_labels__stay_where_a_construction_is_edited() -> None:
    labels = ("body", None, "right leg", "left leg")
    labelled = table().with_parts(labels)
    assert labelled.trim(3).parts == labels[:3]
    assert labelled.with_step(0, moved={0: (0.21, 0.3)}).parts == labels
    assert labelled.with_step(4, drop=True).parts == labels[:3]
    foot = replace(a_step("edge_subdivide", {"edge": [6, 7]}), part="right leg")
    assert labelled.with_step(3, insert=foot).parts == ("body", None, "right leg", "right leg", "left leg")
    assert labelled.mirrored().parts == ("body", None, "left leg", "right leg")
    assert labelled.moved_by(lambda _: lambda points: points).parts == labels


@pytest.mark.parametrize("label", ["", " leg", "leg\n", "x" * 61, "a\u202eb", "a\x00b"])
def test_labels__are_short_printable_text(label: str) -> None:
    with pytest.raises(SequenceError, match=r"step 2: part is .* expected 1 to 60 printable characters"):
        table().with_parts([None, label, None, None])
    text = replace(table(), steps=(*table().steps[:3], replace(table().steps[3], part=label))).to_json()
    with pytest.raises(SequenceError, match=r"step 4: part: .*expected 1 to 60 printable characters"):
        ConstructionSequence.from_json(text)


def test_labels__are_one_for_each_step() -> None:
    with pytest.raises(SequenceError, match="3 labels of parts for 4 steps; give one for each step"):
        table().with_parts([None] * 3)


@pytest.mark.slow
@given(walks(1, 25))
def test_parts__of_any_construction_are_numbered_as_they_begin_and_are_what_their_names_say(
    walk: list[Transition],
) -> None:
    taken = [(one.action, one.choice, one.after, SCORE) for one in walk]
    sequence = ConstructionSequence.record({}, walk[0].before, SCORE, taken)
    parts = parts_of(sequence)
    begun = list(dict.fromkeys((0, *parts.of_steps)))
    assert begun == list(range(len(parts.names)))
    assert len(set(parts.names)) == len(parts.names)
    half = len(walk) // 2
    assert parts_of(sequence.trim(half)).of_steps == parts.of_steps[:half]
    told = sequence.with_parts(parts.name(step + 1) for step in range(len(walk)))
    assert parts_of(told) == parts
    assert 0 <= parts.n_returns < max(1, len(walk))
