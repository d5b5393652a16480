"""The simulator: shapes built by hand-picked actions, the rules of the game, and what random play never does."""

import pickle
import random
from collections.abc import Callable, Iterator
from dataclasses import FrozenInstanceError, asdict
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st

from autopoly_env import placement
from autopoly_env.compute import set_threads
from autopoly_env.errors import ConfigError, IllegalActionError
from autopoly_env.mesh import PolyMesh, defects_of, is_valid
from autopoly_env.operators import OPERATORS, STOP, Action, legal_actions
from autopoly_env.refit import LOCAL, refit
from autopoly_env.score import ScoreWeights, score
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator, State
from tests.helpers.drawings import BOTTLE, FRAME, HOUSE, L_SHAPE, SQUARE, TWO_SQUARES, noise, painted
from tests.helpers.strategies import random_walk

TWO_FACES = PolyMesh.from_faces(
    [(0.25, 0.25), (0.5, 0.25), (0.75, 0.25), (0.75, 0.75), (0.5, 0.75), (0.25, 0.75)], [(0, 1, 4, 5), (1, 2, 3, 4)]
)


@pytest.fixture(autouse=True)
def default_threads() -> Iterator[None]:
    yield
    set_threads(None)


def simulator(shape: shapely.Geometry, **settings: Any) -> Simulator:
    return Simulator(painted(shape), **{"resolution": 64, **settings})


def best_child(game: Simulator, state: State, operator: str, wanted: Callable[[Action], bool] = bool) -> State:
    """The best state that an operator leads to."""
    actions = [a for a in game.legal_actions(state) if a.operator == operator and wanted(a)]
    return max(game.transition_all(state, actions), key=lambda child: child.score.total)


def after_all(game: Simulator, state: State, *operators: str) -> list[State]:
    """The states that the operators lead to, one after the other, on all elements."""
    states = [state]
    for name in operators:
        states = [
            child for s in states for child in game.transition_all(s) if child.action and child.action.operator == name
        ]
    return states


def assert_same(state: State, other: State) -> None:
    """Equal in all, the mesh bit for bit."""
    assert state == other
    assert state.mesh.vertices.tobytes() == other.mesh.vertices.tobytes()


def played(game: Simulator, seed: int, n_steps: int) -> Iterator[tuple[State, State]]:
    """Random play: an operator, then an element; (state before, state after) of every step."""
    rng = random.Random(seed)
    state = game.initial()
    for _ in range(n_steps):
        actions = game.legal_actions(state)[1:]
        if not actions:
            return
        operator = rng.choice(sorted({action.operator for action in actions}))
        action = rng.choice([action for action in actions if action.operator == operator])
        try:
            after = game.transition(state, action)
        except IllegalActionError:  # it has no room
            continue
        yield state, after
        state = after


# --- the start ---


def test_initial__of_a_square_is_the_square() -> None:
    state = simulator(SQUARE).initial()
    assert (state.mesh.counts, state.score.iou, state.score.complexity) == ((4, 4, 1), 1.0, 9)
    assert state.score.total == pytest.approx(100.0 - 0.3 * 9)
    assert shapely.Polygon(state.mesh.vertices).symmetric_difference(SQUARE).area < 1e-6
    assert (state.done, state.step, state.action) == ("matched", 0, None)


@pytest.mark.parametrize("turn", [15.0, 45.0, 70.0])
def test_initial__of_a_turned_rectangle_is_the_turned_rectangle(turn: float) -> None:
    shape = shapely.affinity.rotate(shapely.box(0.2, 0.4, 0.8, 0.6), turn)
    state = simulator(shape).initial()
    assert state.mesh.counts == (4, 4, 1)
    assert (
        shapely.Polygon(state.mesh.vertices).symmetric_difference(shape).area < 0.08 * shape.area
    )  # the pixels have steps


def test_initial__takes_a_mesh_as_it_is() -> None:
    game = simulator(SQUARE)
    state = game.initial(TWO_FACES)
    assert state == State(TWO_FACES, game.score(TWO_FACES), done="matched", n_refits=0)
    assert state.score.total == pytest.approx(100.0 - 0.3 * (6 + 7 + 2))


def diagonal(width: int) -> np.ndarray:
    offset = np.subtract.outer(np.arange(32), np.arange(32))
    return np.abs(offset) < width


def pixels(*rows_and_columns: tuple[int, int], size: int = 32) -> np.ndarray:
    mask = np.zeros((size, size), np.bool_)
    mask[tuple(np.transpose(rows_and_columns))] = True
    return mask


ODD_MASKS = {
    "one pixel": pixels((7, 9)),
    "one pixel in a corner": pixels((0, 0)),
    "a row": pixels(*((5, column) for column in range(32))),
    "opposite corners": pixels((0, 0), (31, 31)),
    "a diagonal": diagonal(1),
    "a thick diagonal": diagonal(5),
    "everything": diagonal(32),
    "a speck lost at the resolution of the game": pixels((100, 150), size=256),
    "one pixel in all": pixels((0, 0), size=1),
}


@pytest.mark.parametrize("mask", ODD_MASKS.values(), ids=ODD_MASKS)
def test_initial__is_sane_for_odd_targets(mask: np.ndarray) -> None:
    game = Simulator(Silhouette(mask), resolution=16)
    state = game.initial()
    assert state.mesh.counts == (4, 4, 1)
    assert defects_of(state.mesh) == (0, 0)
    assert state.mesh.vertices.min() >= 0.0 and state.mesh.vertices.max() <= 1.0
    assert all(np.isfinite(child.score.total) for child in game.transition_all(state))


# --- shapes found ---


def test_subdivision__finds_the_roof_of_a_house() -> None:
    game = simulator(HOUSE)
    state = best_child(game, game.initial(), "edge_subdivide")
    assert state.mesh.counts == (5, 5, 1) and state.score.iou > 0.99


def test_extrusion__puts_a_neck_on_a_bottle() -> None:
    game = simulator(BOTTLE)
    state = best_child(game, game.initial(PolyMesh.rectangle(0.25, 0.5, 0.75, 0.875)), "edge_extrude")
    assert state.mesh.counts == (6, 7, 2) and state.score.iou > 0.99


def test_extrusion__comes_near_an_l_and_two_subdivisions_reach_it() -> None:
    game = simulator(L_SHAPE)
    assert game.initial().score.iou < 0.88 < 0.93 < best_child(game, game.initial(), "edge_extrude").score.iou
    best = max(after_all(game, game.initial(), "edge_subdivide", "edge_subdivide"), key=lambda state: state.score.total)
    assert best.mesh.counts == (6, 6, 1) and best.score.iou > 0.99


def test_hole__makes_a_frame() -> None:
    game = simulator(FRAME)
    state = best_child(game, game.initial(), "face_hole", lambda action: action.element == 1)
    assert state.mesh.counts == (8, 10, 2) and state.score.iou > 0.97
    assert state.mesh.topology.n_holes == 1


def test_two_parts__come_of_two_extrusions_and_a_deletion() -> None:
    game = simulator(TWO_SQUARES, operators="edge_extrude,face_delete")
    start = game.initial(PolyMesh.rectangle(0.125, 0.375, 0.375, 0.625))
    parted = [
        state
        for state in after_all(game, start, "edge_extrude", "edge_extrude", "face_delete")
        if state.mesh.topology.n_components == 2
    ]
    best = max(parted, key=lambda state: state.score.total)
    assert best.mesh.counts == (8, 8, 2) and best.score.self_intersections == 0
    assert start.score.iou == 0.5 < 0.8 < best.score.iou


# --- the rules ---


@pytest.mark.parametrize("operator", OPERATORS)
def test_transition__changes_the_topology_as_its_operator_does(operator: str) -> None:
    game = Simulator(noise(1, 32), resolution=32, operators=OPERATORS.values())
    state = game.initial(OPERATORS["face_delete"].apply(PolyMesh.grid(2, 0.2, 0.3, 0.8, 0.7), 0))
    children = after_all(game, state, operator)
    assert children
    for child in children:
        assert child.action is not None
        made = OPERATORS[operator].apply(state.mesh, child.action.element, child.choice)
        assert made.with_vertices(child.mesh.vertices) == child.mesh
        assert (child.step, child.score) == (1, game.score(child.mesh))


@pytest.mark.parametrize(
    ("operator", "element", "change"),
    [
        ("edge_subdivide", 0, (1, 1, 0)),
        ("edge_extrude", 0, (2, 3, 1)),
        ("face_split", 0, (0, 1, 1)),
        ("face_delete", 0, (-2, -3, -1)),
        ("face_hole", 0, (3, 5, 1)),
        ("face_hole", 3, (4, 6, 1)),
        ("vertex_dissolve", 0, (-1, -1, 0)),
        ("edge_dissolve", 3, (0, -1, -1)),
    ],
)
def test_transition__has_a_known_effect_on_two_quads(operator: str, element: int, change: tuple[int, int, int]) -> None:
    game = simulator(HOUSE)
    after = game.transition(game.initial(TWO_FACES), Action(operator, element))
    assert tuple(np.subtract(after.mesh.counts, (6, 7, 2))) == change


def test_stop__ends_the_game_and_changes_nothing_else() -> None:
    game = simulator(HOUSE)
    state = game.initial()
    after = game.transition(state, STOP)
    assert (after.mesh, after.score, after.step) == (state.mesh, state.score, state.step)
    assert (after.done, after.action, after.n_refits) == ("stop", STOP, 0)


def test_idle__takes_a_step_and_changes_nothing_else() -> None:
    game = simulator(HOUSE, max_steps=2)
    state = game.initial()
    once, twice = game.idle(state), game.idle(game.idle(state))
    assert (once.mesh, once.score, once.step, once.done, once.action) == (state.mesh, state.score, 1, "", None)
    assert (twice.step, twice.done) == (2, "max_steps")


def test_done__offers_nothing_and_refuses_everything() -> None:
    game = simulator(HOUSE)
    state = game.transition(game.initial(), STOP)
    assert game.legal_actions(state) == [] and game.transition_all(state) == []
    for action in (STOP, Action("edge_subdivide", 0)):
        with pytest.raises(IllegalActionError, match=r"has ended \(stop\)"):
            game.transition(state, action)


def test_done__says_why() -> None:
    game = simulator(HOUSE, max_steps=1)
    after = game.transition(game.initial(), Action("face_split", 0))
    assert (after.done, after.step) == ("max_steps", 1)
    assert simulator(HOUSE, max_steps=0).initial().done == "max_steps"
    assert simulator(HOUSE, match_threshold=0.5, max_steps=0).initial().done == "matched"
    roof = best_child(simulator(HOUSE), simulator(HOUSE).initial(), "edge_subdivide")
    almost = simulator(HOUSE, match_threshold=0.99)
    assert roof.action is not None and almost.transition(almost.initial(), roof.action).done == "matched"


def test_legal_actions__begin_with_stop_and_keep_to_the_operators() -> None:
    game = simulator(HOUSE, operators="paper")
    actions = game.legal_actions(game.initial(TWO_FACES))
    assert actions[0] == STOP and STOP not in actions[1:]
    assert {a.operator for a in actions[1:]} == {"edge_subdivide", "edge_extrude", "face_split", "face_delete"}


@pytest.mark.parametrize(
    ("action", "complaint"),
    [
        (Action("edge_extrude", 3), "it lies between two faces"),
        (Action("edge_flip", 0), "'edge_flip' is not one of"),
        (Action("face_hole", 0), "'face_hole' is not one of"),  # not of the preset
        (Action("face_split", 99), "face_split cannot work on corner 99"),
        (Action("edge_subdivide", -1), "edge_subdivide cannot work on edge -1"),
    ],
)
def test_transition__refuses_what_is_illegal_in_one_line(action: Action, complaint: str) -> None:
    game = simulator(HOUSE, operators="paper")
    with pytest.raises(IllegalActionError, match=complaint) as caught:
        game.transition(game.initial(TWO_FACES), action)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("setting", "complaint"),
    [
        ({"resolution": 7}, "resolution 7"),
        ({"resolution": 1025}, "resolution 1025"),
        ({"max_steps": -1}, "max_steps=-1"),
        ({"match_threshold": 0.0}, "match_threshold 0.0"),
        ({"match_threshold": 1.1}, "match_threshold 1.1"),
        ({"match_threshold": float("nan")}, "match_threshold=nan"),
        ({"operators": "edge_subdivide,edge_flip"}, "edge_flip"),
    ],
)
def test_simulator__refuses_settings_out_of_range(setting: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ConfigError, match=complaint):
        simulator(HOUSE, **setting)


# --- values ---


@pytest.mark.parametrize("n_threads", [1, 2, 3])
def test_transition_all__is_bit_for_bit_the_transitions_one_by_one(n_threads: int) -> None:
    game = Simulator(noise(4, 32), resolution=32)
    state = game.initial(random_walk(5, "full", 10)[-1].after)
    set_threads(n_threads)
    children = game.transition_all(state)
    assert [child.action for child in children] == game.legal_actions(state)[1:]
    for child in children:
        assert child.action is not None
        assert_same(game.transition(state, child.action), child)


def test_transition_all__keeps_the_order_it_is_given_and_leaves_out_stop() -> None:
    game = simulator(HOUSE)
    given = [Action("edge_extrude", 2), STOP, Action("edge_subdivide", 0), Action("edge_extrude", 1)]
    children = game.transition_all(game.initial(), given)
    assert [child.action for child in children] == [given[0], given[2], given[3]]


@pytest.mark.parametrize("n_threads", [1, 2])
def test_step_many__is_bit_for_bit_the_transitions_one_by_one(n_threads: int) -> None:
    set_threads(n_threads)
    game = simulator(HOUSE)
    start = game.initial()
    going = [state for state in game.transition_all(start) if not state.done]
    states = [start, *going[:4], game.transition(start, STOP)]
    actions = [*(actions[-1] for actions in game.legal_many(states[:-1])), STOP]
    before = game.n_refits
    stepped = game.step_many(states, actions)
    n_refits = game.n_refits - before
    assert stepped[-1] is None and game.legal_many(states)[-1] == []  # it was over
    expected = [game.transition(state, action) for state, action in zip(states[:-1], actions[:-1], strict=True)]
    for state, other in zip(stepped[:-1], expected, strict=True):
        assert state is not None
        assert_same(state, other)
    assert n_refits == sum(state.n_refits for state in expected)
    assert game.step_many([start, start], [Action("face_split", 99), STOP])[0] is None
    assert game.step_many([], []) == []
    with pytest.raises(ConfigError, match="2 states and 1 actions"):
        game.step_many([start, start], [STOP])


def test_transition_all__leaves_out_what_has_no_room() -> None:
    game = simulator(HOUSE)
    state = game.initial(TWO_FACES)
    assert game.transition_all(state, [Action("edge_extrude", 3), Action("face_split", 99)]) == []


@pytest.mark.parametrize("symmetry", [None, 0.5])
def test_transition__asks_placement_once_an_action(symmetry: float | None, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is disagreed about is looked at once a state, and every action is tried once."""
    looked_at: list[PolyMesh] = []
    asked: list[Action] = []

    def look(mesh: PolyMesh, silhouette: Silhouette) -> placement.Disagreement:
        looked_at.append(mesh)
        return placement.Disagreement(mesh, silhouette)

    def ask(disagreement: placement.Disagreement, action: Action, axis: float | None) -> placement.Trial:
        asked.append(action)
        return placement.tried(disagreement, action, axis)

    game = simulator(BOTTLE, symmetry=symmetry)
    state = game.initial()
    monkeypatch.setattr("autopoly_env.simulator.Disagreement", look)
    monkeypatch.setattr("autopoly_env.simulator.tried", ask)
    game.transition(state, Action("edge_subdivide", 1))
    assert (looked_at, asked) == ([state.mesh], [Action("edge_subdivide", 1)])
    actions = legal_actions(state.mesh, game.operators)
    looked_at.clear(), asked.clear()
    game.transition_all(state, actions)
    assert (looked_at, asked) == ([state.mesh], actions)


def test_transition__leaves_the_state_as_it_was() -> None:
    game = simulator(HOUSE)
    state = game.initial()
    before = pickle.dumps(state)
    game.transition_all(state)
    assert pickle.dumps(state) == before
    with pytest.raises(FrozenInstanceError):
        state.step = 3  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        state.mesh.vertices[0, 0] = 0.0


def test_state_and_simulator__play_on_after_pickling() -> None:
    game = Simulator(noise(7), resolution=32, operators="paper", weights=ScoreWeights(w_sc=1.0))
    state = next(after for _, after in played(game, 2, 1))
    other_game, other_state = pickle.loads(pickle.dumps((game, state)))
    assert_same(state, other_state)
    assert other_game.settings() == game.settings()
    action = game.legal_actions(state)[-1]
    assert_same(game.transition(state, action), other_game.transition(other_state, action))


def test_settings__come_back_from_a_construction_sequence() -> None:
    game = simulator(HOUSE, operators="paper", weights=ScoreWeights(w_sc=1.0), max_steps=7, match_threshold=0.9)
    state = game.initial()
    after = game.transition(state, Action("edge_subdivide", 0))
    steps = [(after.action, after.choice, after.mesh, after.score.as_dict())]
    sequence = ConstructionSequence.record(game.settings(), state.mesh, state.score.as_dict(), steps)  # type: ignore[arg-type]
    read = ConstructionSequence.from_json(sequence.to_json())
    assert read.settings == game.settings()
    assert read.final() == after.mesh
    weights = {name: read.settings[name] for name in asdict(ScoreWeights())}
    names = ("operators", "resolution", "max_steps", "match_threshold")
    same = Simulator(painted(HOUSE), weights=ScoreWeights(**weights), **{name: read.settings[name] for name in names})
    assert_same(same.transition(same.initial(), Action("edge_subdivide", 0)), after)


def test_final_score__is_at_the_silhouettes_own_resolution() -> None:
    game = Simulator(noise(2, 96), resolution=16)
    mesh = game.initial().mesh
    assert game.final_score(mesh) == score(mesh, game.silhouette.target(96), game.weights)
    assert game.score(mesh) == score(mesh, game.silhouette.target(16), game.weights)


# --- random play ---


@pytest.mark.slow
@given(st.integers(0, 99), st.integers(0, 2**32 - 1), st.sampled_from(("paper", "full")))
@settings(max_examples=25)
def test_random_play__never_does_worse_than_the_operators(target: int, seed: int, operators: str) -> None:
    """Crossings and flipped faces; and every mesh is valid, finite and scored as it is, its new ids unused before."""
    game = Simulator(noise(target, 32), resolution=32, operators=operators)
    for before, after in played(game, seed, 12):
        action = after.action
        assert action is not None and 0 <= action.element < OPERATORS[action.operator].element.count(before.mesh)
        made = OPERATORS[action.operator].apply(before.mesh, action.element, after.choice)
        assert made.with_vertices(after.mesh.vertices) == after.mesh
        assert all(np.less_equal(defects_of(after.mesh), defects_of(made)))
        assert defects_of(after.mesh) == (0, 0)
        assert is_valid(after.mesh)
        assert after.score == game.score(after.mesh) and after.step == before.step + 1
        assert min({*after.mesh.vertex_ids} - {*before.mesh.vertex_ids}, default=10**9) >= before.mesh.next_vertex_id


@given(st.integers(0, 99), st.integers(0, 2**32 - 1))
@example(45, 174)  # loses three hairlines, and a point of r_all with them
@settings(max_examples=15)
def test_polish__never_lowers_what_a_mesh_is_worth(target: int, seed: int) -> None:
    game = Simulator(noise(target, 48), resolution=32)
    for _, after in played(game, seed, 4):
        polished = game.polish(after.mesh)
        assert polished.topology is after.mesh.topology
        assert game.worth(polished) >= game.worth(after.mesh)


# --- what a refit aims at ---


def disc() -> Silhouette:
    y, x = np.mgrid[:96, :96]
    return Silhouette((x - 47.5) ** 2 + (y - 47.5) ** 2 < 36**2)


def test_refit_target__weighs_the_background_by_the_iou_to_a_sixteenth() -> None:
    game = Simulator(disc(), resolution=32)
    picture = game.refit_target(0.51).pictures[-1]
    assert picture.weight_sum.size
    covered = game.silhouette.target(32).coverage
    assert np.allclose(np.diff(picture.weight_sum), covered + 0.5 * (1.0 - covered), atol=1e-6)
    assert game.refit_target(1.0).pictures[-1].weight_sum.size == 0  # none: all pixels count alike
    assert game.refit_target(0.52) is game.refit_target(0.48)


def test_refit_target__makes_the_iou_larger_than_least_squares_do() -> None:
    game = Simulator(disc(), resolution=96)
    angles = np.pi * np.array([1 / 6, 5 / 6, 3 / 2])
    triangle = PolyMesh.from_faces(0.5 + 0.4 * np.column_stack((np.cos(angles), np.sin(angles))), [(0, 1, 2)])
    plain = refit(triangle, game.refit_target(1.0), LOCAL).mesh
    iou = game.final_score(plain).iou
    aimed = refit(plain, game.refit_target(iou), LOCAL).mesh
    assert game.final_score(aimed).iou > iou + 0.002
    assert aimed.face_areas().sum() > plain.face_areas().sum()  # more of the disc for a little more of the outside


@pytest.mark.parametrize("symmetry", [None, 0.5])
def test_polish__puts_back_on_the_border_what_lies_beyond_it(symmetry: float | None) -> None:
    game = Simulator(painted(shapely.box(0.25, 0.0, 0.75, 0.5)), resolution=64, symmetry=symmetry)
    polished = game.polish(PolyMesh.rectangle(0.25, -0.1, 0.75, 0.5))
    assert polished.vertices[:, 1].min() == 0.0
    assert game.final_score(polished).iou == 1.0


def test_polish__goes_back_to_the_border_along_slanting_edges() -> None:
    ramp = shapely.Polygon([(0.25, 0.75), (0.35, -0.25), (0.65, -0.25), (0.75, 0.75)])
    game = Simulator(painted(ramp.intersection(shapely.box(0, 0, 1, 1)), 128), resolution=128, symmetry=0.5)
    start = PolyMesh.from_faces([(0.25, 0.75), (0.35, -0.25), (0.65, -0.25), (0.75, 0.75)], [(0, 1, 2, 3)])
    polished = game.polish(start)
    assert polished.vertices[:, 1].min() == 0.0 and game.guidance.is_symmetric(polished)
    assert np.abs(polished.vertices[1] - (0.325, 0.0)).max() < 0.005


def test_polish__leaves_beyond_the_border_what_is_worth_more_there() -> None:
    cut = shapely.Polygon([(0.5, -0.25), (1.0, 0.5), (0.5, 0.9), (0.0, 0.5)]).intersection(shapely.box(0, 0, 1, 1))
    game = Simulator(painted(cut), resolution=64)
    polished = game.polish(PolyMesh.from_faces([(0.5, -0.25), (0.0, 0.5), (0.5, 0.9), (1.0, 0.5)], [(0, 3, 2, 1)]))
    assert polished.vertices[:, 1].min() < -0.1 and game.final_score(polished).iou > 0.99


def test_polish__is_never_worse_at_the_silhouettes_own_resolution() -> None:
    game = Simulator(disc(), resolution=32)
    for n in (3, 5, 8):
        angles = 2 * np.pi * np.arange(n) / n
        ring = PolyMesh.from_faces(0.5 + 0.37 * np.column_stack((np.cos(angles), np.sin(angles))), [tuple(range(n))])
        assert game.final_score(game.polish(ring)).total > game.final_score(ring).total
