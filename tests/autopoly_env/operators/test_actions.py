"""Actions: their flat numbering, the mask that goes with it, and how they read."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from autopoly_env.errors import ConfigError, IllegalActionError
from autopoly_env.mesh import PolyMesh, is_valid
from autopoly_env.operators import (
    CAPACITY_PER_VERTEX,
    OPERATORS,
    STOP,
    Action,
    ActionCodec,
    describe,
    legal_actions,
    preset,
)
from autopoly_env.operators.masks import legal_masks
from tests.helpers.strategies import meshes

PAPER = tuple(operator.name for operator in preset("paper"))
FULL = tuple(operator.name for operator in preset("full"))


def quad() -> PolyMesh:
    return PolyMesh.rectangle(0.0, 0.0, 1.0, 1.0)


@pytest.mark.parametrize(
    ("operators", "n_actions"),
    [
        (PAPER, 1 + 20 + 20 + 40 + 10),
        (FULL, 1 + 20 + 20 + 40 + 10 + 20 + 10 + 20),
        (("face_delete",), 11),
    ],
)
def test_codec__has_an_index_for_every_element_within_capacity(operators: tuple[str, ...], n_actions: int) -> None:
    codec = ActionCodec(operators, max_vertices=10)
    assert codec.n_actions == n_actions
    decoded = [codec.decode(index) for index in range(n_actions)]
    assert len(set(decoded)) == n_actions
    assert [codec.encode(action) for action in decoded] == list(range(n_actions))


def test_codec__keeps_index_0_for_stop_and_the_order_given() -> None:
    codec = ActionCodec(("face_delete", "edge_extrude"), max_vertices=10)
    assert codec.decode(0) == STOP
    assert codec.decode(1) == Action("face_delete", 0)
    assert codec.decode(10) == Action("face_delete", 9)
    assert codec.decode(11) == Action("edge_extrude", 0)
    assert codec.decode(30) == Action("edge_extrude", 19)


def test_codec__refuses_what_has_no_index() -> None:
    codec = ActionCodec(PAPER, max_vertices=10)
    for index in (-1, codec.n_actions):
        with pytest.raises(IllegalActionError, match=f"no action has index {index}; give 0..90"):
            codec.decode(index)
    with pytest.raises(IllegalActionError, match="no index for 'face_hole'"):
        codec.encode(Action("face_hole", 0))
    with pytest.raises(IllegalActionError, match=r"its element must lie in 0\.\.9"):
        codec.encode(Action("face_delete", 10))
    with pytest.raises(ConfigError, match="operator 'face_melt' is unknown"):
        ActionCodec(("face_melt",), 10)
    with pytest.raises(ConfigError, match="max_vertices is 3; give at least 4"):
        ActionCodec(PAPER, 3)


def test_legal_mask__of_a_quad_is_written_by_hand() -> None:
    codec = ActionCodec(FULL, max_vertices=10)
    expected = [STOP]
    expected += [Action(name, i) for name in ("edge_subdivide", "edge_extrude", "face_split") for i in range(4)]
    expected += [Action("face_hole", 0), Action("face_hole", 1)]
    expected += [Action("vertex_dissolve", i) for i in range(4)]
    assert [codec.decode(i) for i in np.flatnonzero(codec.legal_mask(quad()))] == expected


@pytest.mark.parametrize(
    ("max_vertices", "allowed"),
    [
        (4, {"face_split"}),
        (5, {"face_split", "edge_subdivide"}),
        (6, {"face_split", "edge_subdivide", "edge_extrude"}),
        (7, {"face_split", "edge_subdivide", "edge_extrude", "face_hole 3"}),
        (8, {"face_split", "edge_subdivide", "edge_extrude", "face_hole 3", "face_hole 4"}),
    ],
)
def test_legal_mask__leaves_out_what_would_overflow(max_vertices: int, allowed: set[str]) -> None:
    codec = ActionCodec(("face_split", "edge_subdivide", "edge_extrude", "face_hole"), max_vertices)
    found = [codec.decode(index) for index in np.flatnonzero(codec.legal_mask(quad()))[1:]]
    names = {f"face_hole {3 + a.element % 2}" if a.operator == "face_hole" else a.operator for a in found}
    assert names == allowed


def test_legal_mask__minds_the_capacity_of_faces() -> None:
    codec = ActionCodec(PAPER, max_vertices=4)  # room for 4 faces and 8 edges
    mesh = quad()
    mesh = OPERATORS["face_split"].apply(mesh, 0)
    assert {codec.decode(i).operator for i in np.flatnonzero(codec.legal_mask(mesh))} == {"stop", "face_delete"}


def test_stop__is_legal_on_a_mesh_beyond_the_capacities() -> None:
    codec = ActionCodec(FULL, max_vertices=4)
    mask = codec.legal_mask(PolyMesh.grid(5, 0.0, 0.0, 1.0, 1.0))
    assert mask.shape == (codec.n_actions,)
    assert mask[0]
    names = {codec.decode(i).operator for i in np.flatnonzero(mask)}
    assert names == {"stop", "face_delete", "vertex_dissolve", "edge_dissolve"}


@given(meshes())
def test_legal_mask__is_legal_actions_where_there_is_room(mesh: PolyMesh) -> None:
    codec = ActionCodec(FULL, max_vertices=500)
    masked = [codec.decode(index) for index in np.flatnonzero(codec.legal_mask(mesh))]
    assert masked == [STOP, *legal_actions(mesh, FULL)]


@given(meshes(10))
def test_legal_mask__keeps_every_successor_within_the_capacities(mesh: PolyMesh) -> None:
    codec = ActionCodec(FULL, max_vertices=max(4, len(mesh.vertices)))
    for index in np.flatnonzero(codec.legal_mask(mesh))[1:]:
        action = codec.decode(index)
        made = OPERATORS[action.operator].apply(mesh, action.element)
        assert is_valid(made)
        growth = np.subtract(made.counts, mesh.counts)
        room = np.array([CAPACITY_PER_VERTEX[kind] * codec.max_vertices for kind in ("vertex", "edge", "face")])
        assert ((growth <= 0) | (made.counts <= room)).all()


@pytest.mark.parametrize(
    ("action", "words"),
    [
        (STOP, "stop"),
        (Action("edge_subdivide", 0), "edge_subdivide edge 1–2"),
        (Action("face_split", 1), "face_split face 1 at vertex 2"),
        (Action("face_delete", 0), "face_delete face 1"),
        (Action("face_hole", 3), "face_hole face 2, 4 sides"),
        (Action("vertex_dissolve", 7), "vertex_dissolve vertex 8"),
        (Action("vertex_dissolve", 8), "vertex_dissolve vertex #8, not in this mesh"),
    ],
)
def test_describe__names_elements_by_their_ids(action: Action, words: str) -> None:
    grid = PolyMesh.grid(2, 0.0, 0.0, 1.0, 1.0)
    mesh = OPERATORS["face_delete"].apply(grid, 0)  # vertex 0 and face 0 are gone
    assert describe(mesh, action) == words


def test_legal_actions__refuses_an_unknown_operator() -> None:
    with pytest.raises(ConfigError, match="operator 'twist' is unknown"):
        legal_actions(quad(), ("twist",))


@given(meshes(), st.integers(4, 40))
def test_masks__of_all_operators_at_once_are_those_of_each(mesh: PolyMesh, most: int) -> None:
    codec = ActionCodec(tuple(OPERATORS), most)
    mask = codec.legal_mask(mesh)
    room = [most, CAPACITY_PER_VERTEX["edge"] * most, CAPACITY_PER_VERTEX["face"] * most]
    for (operator, found), name in zip(legal_masks(mesh, preset(OPERATORS)), OPERATORS, strict=True):
        own = operator.legal_mask(mesh)
        assert operator.name == name and (found == own).all()
        place = codec.indices_of(name)
        after = np.array([np.add(mesh.counts, operator.change_at(mesh, e)) for e in range(len(own))])
        fits = ((after <= room) | (after <= mesh.counts)).all(axis=1)
        expected = np.zeros(place.stop - place.start, np.bool_)
        n = min(len(own), len(expected))
        expected[:n] = (own & fits)[:n]
        assert (mask[place] == expected).all(), name


def test_masks__of_an_operator_with_a_mask_of_its_own_are_that(monkeypatch: pytest.MonkeyPatch) -> None:
    none = replace(OPERATORS["face_delete"], mask=lambda mesh: np.zeros(len(mesh.faces), np.bool_))
    monkeypatch.setitem(OPERATORS, "face_delete", none)
    mesh = PolyMesh.grid(2, 0.0, 0.0, 1.0, 1.0)
    assert [action.operator for action in legal_actions(mesh, ("face_delete",))] == []
    assert ActionCodec(("face_delete",), 9).legal_mask(mesh).nonzero()[0].tolist() == [0]


@given(meshes())
def test_masks__of_what_dissolves_are_those_of_sets(mesh: PolyMesh) -> None:
    faces, joined = list(map(set, mesh.faces)), {frozenset(pair) for pair in mesh.edges.tolist()}
    for v, dissolves in enumerate(OPERATORS["vertex_dissolve"].legal_mask(mesh).tolist()):
        around = [face for face in mesh.faces if v in face]
        k = around[0].index(v)
        ends = {around[0][k - 1], around[0][(k + 1) % len(around[0])]}
        assert dissolves == (len(around) == 1 and len(around[0]) > 3 and ends not in joined)
    for (a, b), dissolves in zip(
        mesh.edges.tolist(), OPERATORS["edge_dissolve"].legal_mask(mesh).tolist(), strict=True
    ):
        beside = [face for face in faces if {a, b} <= face and _has_side(mesh, face, a, b)]
        assert dissolves == (len(beside) == 2 and beside[0] & beside[1] == {a, b})


def _has_side(mesh: PolyMesh, face: set[int], a: int, b: int) -> bool:
    ring = next(ring for ring in mesh.faces if set(ring) == face)
    return any({ring[k - 1], ring[k]} == {a, b} for k in range(len(ring)))
