"""Policies as agents: what they may choose, what is refused, how many plays they take, and the search with one."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from agents.budget import Budget, Meter
from agents.registry import AGENTS, make_agent
from agents.rl.player import Player
from agents.rl.weights import load_policy, save_policy
from agents.solution import Track
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import STOP, Action
from autopoly_env.score import ScoreWeights
from autopoly_env.simulator import Simulator, State
from tests.helpers.drawings import L_SHAPE, painted
from tests.helpers.networks import SPEC, policy, saved_policy
from training import evaluate

torch.set_num_threads(1)  # as tests run beside each other

NAMES = ("ppo", "maskable-ppo", "a2c", "dqn")


def game(**settings: Any) -> Simulator:
    return Simulator(painted(L_SHAPE), resolution=32, **settings)


@pytest.fixture(scope="module")
def weights(tmp_path_factory: pytest.TempPathFactory) -> str:
    return saved_policy(tmp_path_factory.mktemp("policy"))


# --- what they choose ---


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_ranked__are_the_legal_actions_and_no_others(seed: int) -> None:
    player, simulator = Player(policy(seed)), game()
    state = simulator.initial()
    for step in range(4):
        legal = {
            a for a in simulator.legal_actions(state) if player.codec.legal_mask(state.mesh)[player.codec.encode(a)]
        }
        for rng in (None, np.random.default_rng(step)):
            ranked = player.ranked(simulator, state, rng)
            assert len(ranked) == len(set(ranked)) and set(ranked) == legal
        odds = player.probabilities(simulator, state)
        assert set(odds) == legal and sum(odds.values()) == pytest.approx(1.0)
        made = simulator.transition_all(state, [a for a in player.ranked(simulator, state) if a != STOP][:3])
        if made[0].done:
            break
        state = made[0]


@pytest.mark.slow
def test_sampling__draws_by_the_probabilities() -> None:
    player, simulator = Player(policy()), game()
    state = simulator.initial()
    odds = player.probabilities(simulator, state)
    drawn = [player.ranked(simulator, state, np.random.default_rng(k))[0] for k in range(80)]
    likeliest = max(odds, key=lambda action: odds[action])
    assert drawn.count(likeliest) / 80 == pytest.approx(odds[likeliest], abs=0.2)
    cold = [player.ranked(simulator, state, np.random.default_rng(k), temperature=1e-7)[0] for k in range(5)]
    assert set(cold) == {likeliest} == {player.ranked(simulator, state)[0]}


def test_guidance__is_heeded(weights: str) -> None:
    start = PolyMesh.rectangle(0.2, 0.2, 0.7, 0.8)
    simulator = game(start=start, locked=(0, 1, 2, 3))
    found = make_agent("maskable-ppo", weights=weights).solve(simulator, Budget(refits=8))
    moved = {name: tuple(p) for name, p in zip(found.mesh.vertex_ids, found.mesh.vertices, strict=True)}
    assert [moved[k] for k in range(4)] == [tuple(point) for point in start.vertices]


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_agent__plays_what_the_policy_says(name: str, weights: str) -> None:
    agent, simulator = make_agent(name, weights=weights), game()
    state = simulator.initial()
    player = Player(load_policy(Path(weights))[0])
    decision = agent.act(simulator, state)
    assert agent.name == name
    assert decision.action == player.ranked(simulator, state)[0]
    assert max(decision.policy, key=lambda action: decision.policy[action]) == decision.action
    solution = agent.solve(simulator)
    assert solution.score.total >= simulator.final_score(state.mesh).total
    assert solution.sequence.final() == solution.mesh


@pytest.mark.slow
def test_more_plays__are_no_worse_and_keep_to_the_budget(weights: str) -> None:
    one = make_agent("maskable-ppo", weights=weights).solve(game())
    eight = make_agent("maskable-ppo", weights=weights, k=8).solve(game())
    assert eight.score.total >= one.score.total - 1e-9 and eight.stats.n_refits > 2 * one.stats.n_refits
    short = make_agent("maskable-ppo", weights=weights, k=8).solve(game(), Budget(refits=10))
    assert short.stats.n_refits < 20 and short.stats.stopped_by == "refits"


@pytest.mark.slow
def test_seed__decides_what_is_sampled(weights: str) -> None:
    def steps(seed: int) -> Any:
        return make_agent("ppo", weights=weights, play="sampled", seed=seed).solve(game()).sequence

    assert steps(1) == steps(1)
    assert len({json.dumps([s.operator for s in steps(seed).steps]) for seed in range(4)}) > 1


def test_policy__stops_after_as_many_steps_as_it_was_trained_to_take(weights: str) -> None:
    agent, simulator = make_agent("ppo", weights=weights), game()
    state = simulator.initial()
    for _ in range(SPEC.max_steps):
        state = simulator.idle(state)
    assert agent.act(simulator, state).action == STOP


def test_rl_prior__searches_with_the_policys_odds(weights: str) -> None:
    agent = make_agent("rl-prior", weights=weights, n_simulations=4, patience=1)
    found = agent.solve(game(), Budget(refits=60))
    played = make_agent("maskable-ppo", weights=weights).solve(game())
    assert agent.name == "rl-prior"
    assert found.score.total >= played.score.total >= game().final_score(game().initial().mesh).total


def test_rl_prior__knows_nothing_of_meshes_that_do_not_fit() -> None:
    from agents.rl.evaluator import RlEvaluator

    evaluator, simulator = RlEvaluator(Player(policy())), game()
    small, large = simulator.initial(), simulator.initial(PolyMesh.grid(4, 0.1, 0.1, 0.9, 0.9))
    legal = simulator.legal_actions(small)[1:]
    prior = evaluator.prior(simulator, small, legal)
    assert prior.sum() == pytest.approx(1.0) and prior.std() > 1e-3
    many = simulator.legal_actions(large)[1:]
    assert evaluator.prior(simulator, large, many) == pytest.approx(np.full(len(many), 1.0 / len(many)))


# --- what is refused ---


def test_operators_that_only_one_side_knows__are_masked(weights: str) -> None:
    agent = make_agent("maskable-ppo", weights=weights)
    fewer = game(operators="edge_subdivide,vertex_dissolve")
    taken = {step.operator for step in agent.solve(fewer).sequence.steps}
    assert taken and taken <= {"edge_subdivide", "vertex_dissolve"}
    more = game(operators="full,examples.edge_collapse:edge_collapse")
    solution = agent.solve(more)
    assert solution.sequence.steps == agent.solve(game()).sequence.steps
    assert solution.sequence.settings["operators"].endswith(",edge_collapse")


def test_policy_that_knows_none_of_the_operators__is_refused_with_both_named(weights: str) -> None:
    agent = make_agent("maskable-ppo", weights=weights)
    with pytest.raises(ConfigError, match=r"maskable-ppo was trained with operators full and knows none of edge_coll"):
        agent.solve(game(operators="examples.edge_collapse:edge_collapse"))


NOTED = replace(SPEC, faces=("any", "quads"), w_sc=(0.1, 1.5))


@pytest.mark.parametrize("name", ["maskable-ppo", "rl-prior"])
@pytest.mark.parametrize(
    ("settings", "complaint"),
    [
        ({"faces": "convex"}, "these weights know faces=any, quads, not convex: give one of them, or others"),
        ({"weights": ScoreWeights(w_sc=3.0)}, "these weights know w_sc 0.1 to 1.5, not 3: give others"),
    ],
    ids=["rule", "price"],
)
def test_rules_and_prices_that_weights_do_not_know__are_refused_in_one_line(
    name: str, settings: dict[str, Any], complaint: str, tmp_path: Path
) -> None:
    agent = make_agent(name, weights=saved_policy(tmp_path, NOTED))
    simulator = game(**settings)
    for ask in (agent.check, agent.solve, lambda given: agent.act(given, given.initial())):
        with pytest.raises(ConfigError) as caught:
            ask(simulator)
        assert str(caught.value) == complaint
    assert agent.suits(game(faces="quads", weights=ScoreWeights(w_sc=0.1)))


def test_weights_from_before_rules_were_noted__play_under_any(tmp_path: Path) -> None:
    path = Path(saved_policy(tmp_path))
    meta = json.loads(path.with_suffix(".json").read_text())
    for new in ("faces", "w_sc"):
        del meta["spec"][new]
    path.with_suffix(".json").write_text(json.dumps(meta))
    agent, simulator = make_agent("ppo", weights=str(path)), game(faces="quads", weights=ScoreWeights(w_sc=3.0))
    found = agent.solve(simulator, Budget(refits=12))
    assert found.stats.n_refits > 2 and simulator.is_sane(found.mesh)


def test_play_under_a_rule__is_that_of_the_exact_mask() -> None:
    simulator, player = game(faces="quads", operators="full"), Player(policy())
    state = simulator.initial()
    for track in player.play(simulator, Track(state), Meter.unlimited()):
        legal = simulator.legal_actions(state)
        ranked = player.ranked(simulator, state)
        assert set(ranked) <= set(legal) and track.state.action in legal
        tried = [action for action in ranked if action == track.state.action or not _has_room(simulator, state, action)]
        assert ranked[: len(tried)] == tried
        state = track.state


def _has_room(simulator: Simulator, state: State, action: Action) -> bool:
    return bool(simulator.step_many([state], [action])[0])


def test_a_mesh_that_does_not_fit__is_refused_with_both_numbers(weights: str) -> None:
    agent, start = make_agent("maskable-ppo", weights=weights), PolyMesh.grid(4, 0.1, 0.1, 0.9, 0.9)
    with pytest.raises(ConfigError, match="25; at most 16 fit max_vertices=16"):
        agent.solve(game(start=start))


def test_play__ends_where_an_action_and_its_mirror_image_leave_the_padding() -> None:
    simulator, spec = game(symmetry=True, operators="edge_subdivide"), replace(SPEC, max_vertices=5)
    n_vertices = set()
    for seed in range(6):
        player = Player(policy(seed, spec))
        played = list(player.play(simulator, Track(simulator.initial()), Meter.unlimited()))
        assert all(player.fits(track.state) for track in played[:-1])
        n_vertices.add(len(played[-1].state.mesh.vertices))
    assert n_vertices == {5, 6}


def test_agents_without_weights__say_so_in_one_line(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("agents.rl.weights.SHIPPED", tmp_path)
    for name in (*NAMES, "rl-prior"):
        with pytest.raises(ConfigError, match=r"comes without weights: .* and give weights=PATH$"):
            make_agent(name)


def _cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-7])


def _edit(**changes: Any) -> Any:
    def edit(path: Path) -> None:
        meta = json.loads(path.with_suffix(".json").read_text())
        path.with_suffix(".json").write_text(json.dumps({**meta, **changes}))

    return edit


@pytest.mark.parametrize(
    ("damage", "complaint"),
    [
        (_cut, "sha256 differs"),
        (lambda path: path.unlink(), "no weights at .*docs/rl.md"),
        (lambda path: path.with_suffix(".json").unlink(), "no weights at .*json"),
        (lambda path: path.with_suffix(".json").write_text("{"), "not JSON"),
        (_edit(version=7), "format version 7; this code reads version 1"),
        (_edit(algorithm="sarsa"), "algorithm 'sarsa'"),
        (_edit(net={"width": 12, "widths": [4, 4, 4], "n_rounds": 1}), "has shape .*, the settings want"),
        (_edit(net={"width": "wide"}), "settings do not fit"),
    ],
    ids=["cut", "gone", "no-json", "no-json-at-all", "version", "algorithm", "network", "settings"],
)
def test_damaged_weights__are_refused_in_one_line(damage: Any, complaint: str, tmp_path: Path) -> None:
    path = save_policy(tmp_path / "p.safetensors", policy(), "ppo", {}, {})
    damage(path)
    with pytest.raises(ConfigError, match=complaint) as caught:
        make_agent("ppo", weights=str(path))
    assert "\n" not in str(caught.value)


def test_weights_that_are_no_numbers__are_refused(tmp_path: Path) -> None:
    net = policy()
    torch.nn.init.constant_(net.value_net.layers[0].bias, float("nan"))
    path = save_policy(tmp_path / "p.safetensors", net, "ppo", {}, {})
    with pytest.raises(ConfigError, match="a weight is not a number"):
        load_policy(path)


def test_agents__are_in_the_registry_with_the_same_options() -> None:
    assert {*NAMES, "rl-prior"} <= {*AGENTS}
    with pytest.raises(ConfigError, match="temperature = 0"):
        make_agent("ppo", temperature=0)
    with pytest.raises(ConfigError, match="has no option 'w'; its options are weights, play, k, temperature, seed"):
        make_agent("dqn", w=1)


# --- through the evaluation ---


@pytest.mark.slow
def test_evaluate__measures_them_beside_the_others(
    weights: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    suite = tmp_path / "mine.yaml"
    entries = [f"  - {{agent: {name}, options: {{weights: {weights}}}}}" for name in (*NAMES, "rl-prior")]
    spec = "targets: {kind: construction, n: 1, resolution: 64}\nresolution: 32\nbudget: {refits: 12}\nagents:\n"
    suite.write_text(spec + "\n".join([*entries, "  - {agent: random}"]))
    assert evaluate.main([str(suite), "--out", str(tmp_path / "run"), "--engine", "serial", "--quiet", "--json"]) == 0
    rows = [json.loads(line) for line in capsys.readouterr().out.splitlines() if line.startswith("{")]
    assert [row["agent"] for row in rows][1:] == [*NAMES, "rl-prior", "random"]
    assert not any(row["failed"] for row in rows)
