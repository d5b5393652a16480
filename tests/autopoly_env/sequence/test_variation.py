"""Edits of a construction that are carried on to its end."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from autopoly_env.errors import SequenceError
from autopoly_env.mesh import PolyMesh
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.sequence.deformation import ThinPlate
from tests.helpers.constructions import chapel, house
from tests.helpers.sequences import gabled, walked
from tests.helpers.tables import a_step, table


def position(mesh: PolyMesh, name: int) -> list[float]:
    return mesh.vertices[mesh.vertex_index(name)].tolist()


# The deformation


def test_thin_plate__of_three_points_is_the_affine_map_through_them() -> None:
    corners = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
    bend = ThinPlate.through(corners, np.array([(0.1, 0.2), (2.1, 0.2), (0.1, 3.2)]))  # x' = 2x + 0.1, y' = 3y + 0.2
    points = np.array([(0.5, 0.5), (2.0, -1.0)])
    assert np.allclose(bend(points), [(1.1, 1.7), (4.1, -2.8)], atol=1e-9)


@given(st.integers(0, 2**32 - 1))
def test_thin_plate__takes_every_anchor_where_it_is_to_go(seed: int) -> None:
    before, after = np.random.default_rng(seed).random((2, 9, 2))
    assert np.allclose(ThinPlate.through(before, after)(before), after, atol=1e-6)


def test_thin_plate__that_moves_nothing_is_the_identity_bit_for_bit() -> None:
    anchors, points = np.random.default_rng(0).random((2, 7, 2))
    assert np.array_equal(ThinPlate.through(anchors, anchors)(points), points)


# Edits of a step


def test_moved__takes_the_vertex_there_and_leaves_the_meshes_before_alone() -> None:
    edited = house().with_step(1, moved={4: (0.5, 0.05)})
    assert position(edited.meshes()[1], 4) == [0.5, 0.05]
    assert edited.start == house().start
    assert [step.operator for step in edited.steps] == [step.operator for step in house().steps]
    assert edited.final().topology == house().final().topology


def test_moved__of_a_whole_mesh_carries_the_later_vertices_along() -> None:
    shifted = {name: (x + 0.1, y) for name, (x, y) in enumerate(table().start.vertices.tolist())}
    edited = table().with_step(0, moved=shifted)
    assert np.allclose(edited.final().vertices, table().final().vertices + (0.1, 0.0), atol=1e-9)


def test_moved__stretches_a_table_as_a_whole_when_its_slab_is_made_wider() -> None:
    wider = {name: (0.5 + 1.2 * (x - 0.5), y) for name, (x, y) in enumerate(table().start.vertices.tolist())}
    edited = table().with_step(0, moved=wider)
    expected = 0.5 + 1.2 * (table().final().vertices[:, 0] - 0.5)
    assert np.allclose(edited.final().vertices, np.column_stack((expected, table().final().vertices[:, 1])), atol=1e-6)


def test_nothing_moved__is_the_same_construction() -> None:
    for sequence in (house(), gabled(), walked(3)):
        assert sequence.with_step(0, moved={}).meshes() == sequence.meshes()


def test_choice__of_a_split_cuts_to_another_corner() -> None:
    halves = gabled().trim(2)  # a pentagon, cut from its gable to corner 2
    assert halves.steps[1].choice == {"to": 2}
    other = halves.with_step(2, choice={"to": 3})
    assert {frozenset(face) for face in other.final().faces} == {frozenset({0, 3, 4}), frozenset({1, 2, 3, 4})}


def test_choice__of_a_hole_moves_it() -> None:
    holed = house(4)
    choice = dict(holed.steps[3].choice or {})
    points = [[x + 0.01, y] for x, y in choice["points"]]
    moved = holed.with_step(4, choice={**choice, "points": points})
    names = holed.steps[3].created["vertices"]
    assert [position(moved.final(), name) for name in names] == points


def test_drop__leaves_out_a_vertex_and_joins_its_edges() -> None:
    told = table().with_step(1, drop=True)  # the second cut was of 3-4, which is 3-2 now
    assert [step.operator for step in told.steps] == ["edge_subdivide", "edge_extrude", "edge_extrude"]
    assert told.final().counts == (9, 11, 3)


def test_drop__names_the_later_step_that_becomes_illegal() -> None:
    with pytest.raises(SequenceError, match=r"^step 2, face_split face 0, vertex 4: .*not there any more"):
        gabled().with_step(1, drop=True)


def test_insert__is_taken_where_it_is_put_and_the_later_ids_move_up() -> None:
    longer = table().with_step(0, insert=a_step("edge_subdivide", {"edge": [0, 1]}, (4, 0.5, 0.25)))
    assert len(longer.steps) == 5
    assert position(longer.final(), 4) == [0.5, 0.25]
    expected = {tuple(p) for p in table().final().vertices.round(9).tolist()} | {(0.5, 0.25)}
    assert {tuple(p) for p in longer.final().vertices.round(9).tolist()} == expected


def test_insert__that_splits_the_edge_of_a_later_step_names_that_step() -> None:
    with pytest.raises(SequenceError, match=r"^step 1, edge_subdivide edge 2–3: no edge joins"):
        table().with_step(0, insert=a_step("edge_subdivide", {"edge": [2, 3]}))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"k": 9, "moved": {}}, "step 9 of a sequence of 7: give 0..7"),
        ({"k": -1, "moved": {}}, "step -1 of a sequence of 7: give 0..7"),
        ({"k": 0, "drop": True}, "step 0 of a sequence of 7: give 1..7"),
        ({"k": 1}, "give one edit"),
        ({"k": 1, "moved": {}, "drop": True}, "give one edit"),
        ({"k": 1, "moved": {77: (0.0, 0.0)}}, "step 1: vertex id 77"),
        ({"k": 1, "moved": {4: (float("nan"), 0.0)}}, "finite"),
        ({"k": 2, "choice": {"to": 4}}, "step 2, face_split"),
        ({"k": 2, "choice": {"from": 4}}, "step 2, face_split"),
        ({"k": 1, "insert": a_step("edge_melt", {"edge": [0, 1]})}, "operator 'edge_melt' is unknown"),
    ],
)
def test_with_step__refuses_what_makes_no_sense_in_one_line(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(SequenceError) as caught:
        house().with_step(**arguments)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_edited__is_scored_against_its_own_last_mesh() -> None:
    edited = table().with_step(2, moved={4: (0.7, 0.45)})
    assert edited.steps[-1].score["iou"] == 1.0
    assert edited.steps[0].score["iou"] < 1.0
    assert edited.settings["scored_against"] == "its last mesh"


@pytest.mark.parametrize(
    "sequence",
    [house(), gabled(), walked(3), walked(5), chapel(), *(walked(seed, 25, 0.0, "modeller") for seed in (0, 3, 5))],
    ids=str,
)
def test_mirrored__has_every_mesh_mirrored_and_is_undone_by_itself(sequence: ConstructionSequence) -> None:
    image = sequence.mirrored()
    for mesh, other in zip(sequence.meshes(), image.meshes(), strict=True):
        assert other.counts == mesh.counts
        expected = sorted(map(tuple, (mesh.vertices * (-1.0, 1.0) + (1.0, 0.0)).round(9).tolist()))
        assert sorted(map(tuple, other.vertices.round(9).tolist())) == expected
        assert np.allclose(sorted(other.face_areas()), sorted(mesh.face_areas()))
    back = image.mirrored().final()
    assert np.allclose(sorted(back.vertices.tolist()), sorted(sequence.final().vertices.tolist()))
