"""The rule of faces as a setting: of the simulator, of sequences, and of the environment."""

import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autopoly_env.conformance import check_env, check_simulator
from autopoly_env.env import AutoPolyEnv
from autopoly_env.errors import ConfigError, IllegalActionError, SequenceError
from autopoly_env.mesh import FaceRule, PolyMesh, broken_faces, defects_of, images_of
from autopoly_env.operators import Action
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.simulator import Simulator, State
from tests.helpers.drawings import BOTTLE, L_SHAPE, noise, painted
from tests.helpers.shapes import polygon

DART = polygon(np.array([(0.2, 0.2), (0.5, 0.4), (0.8, 0.2), (0.5, 0.8)]))
SQUARE = PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75)
OPERATOR_SETS = (
    "edge_extrude,face_delete",
    "edge_extrude,face_delete,edge_subdivide,edge_dissolve,vertex_dissolve",
    "full",
)


def played(game: Simulator, seed: int, n_steps: int) -> list[State]:
    """The states of random legal play, operators drawn before elements."""
    rng, states = np.random.default_rng(seed), [game.initial()]
    while len(states) <= n_steps and not states[-1].done:
        legal = game.legal_actions(states[-1])[1:]
        if not legal:
            break
        names = sorted({action.operator for action in legal})
        name = names[rng.integers(len(names))]
        of_it = [action for action in legal if action.operator == name]
        try:
            states.append(game.transition(states[-1], of_it[rng.integers(len(of_it))]))
        except IllegalActionError:  # it has no room
            states.append(game.idle(states[-1]))
    return [state for state in states if state.action is not None or state is states[0]]


def recorded(game: Simulator, states: list[State]) -> ConstructionSequence:
    """The states as a sequence."""
    rows = [(s.action, s.choice, s.mesh, s.score.as_dict()) for s in states[1:]]
    return ConstructionSequence.record(game.settings(), states[0].mesh, states[0].score.as_dict(), rows)  # type: ignore[arg-type]


@pytest.mark.slow  # long games
@pytest.mark.parametrize("rule", ["convex", "quads"])
@pytest.mark.parametrize("operators", OPERATOR_SETS)
@given(st.integers(0, 2**32 - 1))
@settings(max_examples=5)
def test_long_games__keep_the_rule_in_every_mesh(operators: str, rule: FaceRule, seed: int) -> None:
    game = Simulator(noise(seed, 32), resolution=32, operators=operators, faces=rule, max_steps=40)
    states = played(game, seed, 40)
    for state in states:
        assert not broken_faces(state.mesh, rule)
        assert game.is_sane(state.mesh)
    polished = game.polish(states[-1].mesh)
    assert game.is_sane(polished)
    sequence = recorded(game, states)
    assert sequence.faces == rule and ConstructionSequence.from_json(sequence.to_json()) == sequence


@pytest.mark.parametrize("rule", ["convex", "quads"])
def test_simulator__conforms_under_a_rule(rule: FaceRule) -> None:
    check_simulator(Simulator(painted(L_SHAPE), resolution=16, max_steps=8, faces=rule), n_steps=12)


def test_any__is_the_game_without_a_rule() -> None:
    plain, ruled = Simulator(painted(BOTTLE), resolution=32), Simulator(painted(BOTTLE), resolution=32, faces="any")
    assert plain.settings() == ruled.settings() and "faces" not in plain.settings()
    assert [s.mesh for s in played(plain, 1, 5)] == [s.mesh for s in played(ruled, 1, 5)]


def test_actions_that_break_the_rule__are_illegal() -> None:
    game = Simulator(painted(BOTTLE), resolution=32, faces="quads", start=SQUARE)
    state = game.initial()
    legal = {action.operator for action in game.legal_actions(state)}
    assert "edge_extrude" in legal and not legal & {"edge_subdivide", "face_hole"}  # which make five corners and more
    with pytest.raises(
        IllegalActionError, match="edge_subdivide edge 0–1 leaves a face that faces=quads does not allow"
    ):
        game.transition(state, Action("edge_subdivide", 0))
    assert game.transition_all(state, [Action("edge_subdivide", 0)]) == []
    convex = Simulator(painted(BOTTLE), resolution=32, faces="convex", start=SQUARE)
    subdivided = convex.transition(convex.initial(), Action("edge_subdivide", 0)).mesh
    assert len(subdivided.vertices) == 5 and convex.is_sane(subdivided)


def test_an_edge_between_faces__is_not_subdivided_where_corners_have_to_turn() -> None:
    game = Simulator(painted(BOTTLE), resolution=32, faces="convex", start=PolyMesh.grid(2, 0.25, 0.25, 0.75, 0.75))
    inner = np.flatnonzero(~game.initial().mesh.topology.is_boundary_edge).tolist()
    legal = [a.element for a in game.legal_actions(game.initial()) if a.operator == "edge_subdivide"]
    assert legal and not set(legal) & set(inner)


@pytest.mark.slow
@given(st.integers(0, 2**32 - 1))
@settings(max_examples=5)
def test_symmetry_and_locks__hold_under_the_rule(seed: int) -> None:
    mirror = Simulator(noise(seed, 32), resolution=32, operators=OPERATOR_SETS[1], faces="quads", symmetry=0.5)
    for state in played(mirror, seed, 12):
        assert mirror.is_sane(state.mesh) and images_of(state.mesh, 0.5) is not None
        assert state.halfway is None or mirror.is_sane(state.halfway.mesh)
    game = Simulator(noise(seed, 32), resolution=32, faces="quads", start=SQUARE, locked=(0, 2))
    for state in played(game, seed, 8):
        at = [state.mesh.vertices[state.mesh.vertex_index(name)] for name in (0, 2)]
        assert game.is_sane(state.mesh) and (at == SQUARE.vertices[[0, 2]]).all()


def test_simulators__keep_their_rule_when_pickled() -> None:
    assert pickle.loads(pickle.dumps(Simulator(painted(BOTTLE), faces="convex"))).faces == "convex"
    assert Simulator(painted(BOTTLE), faces="quads").settings()["faces"] == "quads"
    assert Simulator(painted(BOTTLE), faces="quads").defects_of(DART) == (0, 1) != defects_of(DART)


# --- sequences


def sequence_of(mesh: PolyMesh, **told: Any) -> ConstructionSequence:
    score = {"iou": 0.5, "complexity": mesh.complexity, "self_intersections": 0, "total": 1.0}
    return ConstructionSequence.record(told, mesh, score, [])


def test_sequences__without_the_setting_have_any_faces() -> None:
    assert sequence_of(DART).faces == "any" and sequence_of(SQUARE, faces="quads").faces == "quads"
    assert sequence_of(SQUARE).under("quads").settings["faces"] == "quads"
    assert sequence_of(SQUARE, faces="quads").under("any").settings == {}
    assert sequence_of(SQUARE).under(None) == sequence_of(SQUARE)


def test_sequences__that_break_their_rule_are_refused() -> None:
    text = sequence_of(DART).to_json().replace('"settings": {}', '"settings": {"faces": "convex"}')
    with pytest.raises(SequenceError, match="face 0 of the start mesh has a reflex corner at vertex 1; faces=convex"):
        ConstructionSequence.from_json(text)
    with pytest.raises(SequenceError, match="face 0 of the start mesh has a reflex corner"):
        sequence_of(DART).under("quads")
    with pytest.raises(SequenceError, match="settings: faces 'round': expected one of any, convex, quads"):
        ConstructionSequence.from_json(text.replace("convex", "round"))


def test_a_step_that_breaks_the_rule__is_named() -> None:
    score = {"iou": 0.5, "complexity": 9, "self_intersections": 0, "total": 1.0}
    made = PolyMesh.from_faces([*SQUARE.vertices, (0.5, 0.25)], [(0, 4, 1, 2, 3)])
    with pytest.raises(SequenceError, match="face 0 of the mesh after step 1 has 5 corners"):
        ConstructionSequence.record(
            {"faces": "quads"}, SQUARE, score, [(Action("edge_subdivide", 0), None, made, score)]
        )


@pytest.mark.parametrize("start", [DART, sequence_of(DART)], ids=["mesh", "sequence"])
def test_starts_that_break_the_rule__are_refused(start: PolyMesh | ConstructionSequence) -> None:
    with pytest.raises(ConfigError, match=r"face 0 of .* has a reflex corner at vertex 1; faces=quads"):
        Simulator(painted(BOTTLE), faces="quads", start=start)
    with pytest.raises(ConfigError, match="face 0 of the mesh has a reflex corner"):
        Simulator(painted(BOTTLE), faces="quads").initial(DART)


def test_unknown_rules__are_refused() -> None:
    with pytest.raises(ConfigError, match="faces 'round': expected one of any, convex, quads"):
        Simulator(painted(BOTTLE), faces="round")  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match="faces"):
        AutoPolyEnv(faces="round")


# --- the environment


def test_environment__conforms_under_a_rule_and_masks_what_breaks_it() -> None:
    env = AutoPolyEnv(operators="full", faces="quads", resolution=16, obs_resolution=16, max_steps=8, max_vertices=16)
    check_env(env, n_steps=8)
    env.reset(seed=3)
    legal = {env.codec.decode(int(k)).operator for k in np.flatnonzero(env.action_masks())}
    assert "edge_extrude" in legal and "edge_subdivide" not in legal
    with pytest.raises(ConfigError, match="reflex corner"):
        env.reset(options={"mesh": DART})
