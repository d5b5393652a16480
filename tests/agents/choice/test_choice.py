"""ChoiceNet in NumPy: what it sees, what it says, what its weights refuse, and the agent that is led by it."""

import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import safetensors.numpy
import torch

from agents.budget import Budget, Meter
from agents.choice.config import ChoiceConfig, classes_of
from agents.choice.features import N_NUMBERS, look
from agents.choice.network import batch_of, choose, gains
from agents.choice.weights import load_choice
from agents.knowing import Known
from agents.registry import make_agent
from agents.search.config import MctsConfig
from agents.search.evaluator import ResidualEvaluator
from agents.search.search import Search
from agents.search.tree import Node
from agents.solution import Track
from agents.weights_meta import packed, unpacked
from autopoly_env.arrays import FloatArray
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh
from autopoly_env.score import ScoreWeights
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator, State
from tests.helpers.choosing import SMALL, evaluator, quads_game, saved_choice, tensors_of
from tests.helpers.drawings import BOTTLE, painted
from tests.helpers.paths import ROOT
from tests.helpers.searches import PLAIN, Game, InOrder, name_of
from tests.helpers.solving import assert_consistent, simulator
from training.improvement.network import ChoiceModule, TensorBatch


def seen_in(game: Simulator, mesh: PolyMesh | None = None, config: ChoiceConfig = SMALL):  # type: ignore[no-untyped-def]
    state = game.initial(mesh)
    return look(game, state, game.legal_actions(state)[1:], config.classes, config.side)[0]


# --- what it sees ---


def test_classes__are_those_of_both_presets_each_once() -> None:
    classes = classes_of("modeller", "full")
    assert len(set(classes)) == len(classes) and {"edge_cap", "face_hole_3", "edge_subdivide"} <= set(classes)


@pytest.mark.parametrize("quarter_turns", [1, 2, 3])
def test_look__at_a_turned_picture_is_the_same(quarter_turns: int) -> None:
    """Patches lie along their actions: turning mesh and target about the middle changes nothing that is seen."""
    mask = painted(BOTTLE).mask
    mesh = PolyMesh.rectangle(0.25, 0.25, 0.625, 0.75)
    x, y = mesh.vertices.T
    places = {1: (y, 1 - x), 2: (1 - x, 1 - y), 3: (1 - y, x)}
    turned = mesh.with_vertices(np.column_stack(places[quarter_turns]))
    games = (Simulator(Silhouette(m), operators="paper") for m in (mask, np.rot90(mask, quarter_turns).copy()))
    straight, other = (seen_in(game, shape) for game, shape in zip(games, (mesh, turned), strict=True))
    assert (straight.classes == other.classes).all()
    assert np.allclose(straight.numbers, other.numbers, atol=1e-3)
    assert np.allclose(straight.value, other.value, atol=1e-3) and np.allclose(straight.whole, other.whole, atol=1e-3)
    on_edges = [k for k, name in enumerate(straight.classes) if SMALL.classes[name].startswith("edge")]
    off = np.abs(straight.patches[on_edges] - other.patches[on_edges]) > 0.05
    assert off.mean() < 0.02  # a pixel on a border may differ


def test_look__shows_target_and_rendering_on_the_right_sides_of_an_edge() -> None:
    """A square under a twice as high target: above its upper edge there is target and no rendering, below both."""
    mask = np.zeros((64, 64), np.bool_)
    mask[16:48, 24:40] = True
    game = Simulator(Silhouette(mask), operators=["edge_extrude"])
    mesh = PolyMesh.rectangle(0.375, 0.5, 0.625, 0.75)
    seen = seen_in(game, mesh, replace(SMALL, side=8))
    actions = game.legal_actions(game.initial(mesh))[1:]
    upper = next(k for k, a in enumerate(actions) if (mesh.vertices[mesh.edges[a.element]][:, 1] == 0.5).all())
    target, shown = seen.patches[upper, 0, :, :, 3:5]  # the middle columns; rows go across the edge, 0.094 each
    above, below = (0, slice(4, None)) if shown[:4].sum() == 0.0 else (4, slice(None, 4))
    assert (shown[above : above + 4] == 0.0).all() and shown[below].sum() == 3 * 2
    assert target[above : above + 4].sum() == 3 * 2 and (target[below] == shown[below]).all()


def test_look__of_a_state_without_actions_is_empty() -> None:
    game = simulator("house")
    seen, residual = look(game, game.initial(), [], SMALL.classes, SMALL.side)
    assert seen.numbers.shape == (0, N_NUMBERS) and residual.shape == (0,) and np.isfinite(seen.value).all()


# --- what it says ---


def test_numpy__says_what_torch_says() -> None:
    """Several states at once, of both styles; the network that is trained and the one that is asked are the same."""
    looks = [seen_in(quads_game(name)) for name in ("L", "house", "blobs")] + [seen_in(simulator("frame"))]
    tensors, batch = tensors_of(), batch_of(looks)
    module = ChoiceModule(SMALL).eval()
    module.fill(tensors)
    given = TensorBatch.of(batch)
    with torch.no_grad():
        assert np.allclose(choose(tensors, batch), module.choose(given).numpy(), rtol=1e-5, atol=1e-5)
        theirs = module.gains(given.whole, given.value).numpy()
    assert np.allclose(gains(tensors, batch.whole, batch.value), theirs, rtol=1e-5, atol=1e-5)
    assert {name: array.tolist() for name, array in module.arrays().items()} == {
        name: array.tolist() for name, array in tensors.items()
    }


def test_batch__says_of_each_state_what_it_says_of_it_alone() -> None:
    looks, tensors = [seen_in(quads_game(name)) for name in ("L", "blobs", "house")], tensors_of()
    alone = [choose(tensors, batch_of([one])) for one in looks]
    assert np.allclose(np.concatenate(alone), choose(tensors, batch_of(looks)), atol=1e-5)


def test_prior__is_a_probability_and_does_not_depend_on_the_order_of_actions() -> None:
    game, ours = quads_game("blobs"), evaluator()
    state = game.initial()
    actions = game.legal_actions(state)[1:]
    prior = ours.prior(game, state, actions)
    assert prior.sum() == pytest.approx(1.0) and (prior > 0.0).all()
    assert np.allclose(ours.prior(game, state, actions[::-1]), prior[::-1], atol=1e-6)
    [first, second] = ours.priors(game, [(state, actions), (state, actions[:3])])
    assert np.allclose(first, prior, atol=1e-6) and second.shape == (3,)


def test_foresee__expects_no_less_than_what_is_there_and_nothing_more_where_it_is_over() -> None:
    game, ours = simulator("blobs"), evaluator()
    state = game.initial()
    foreseen = ours.foresee(game, [state, replace(state, done="max_steps")])
    assert foreseen[0] > state.score.total and foreseen[1] == state.score.total
    assert ours.foresee(game, []).shape == (0,)


def test_unknown_operators__come_last_and_where_all_are_unknown_the_picture_decides() -> None:
    known = replace(SMALL, classes=("edge_subdivide", "face_split"))
    game = simulator("house", operators="full")
    state = game.initial()
    actions = game.legal_actions(state)[1:]
    ours = evaluator(known)
    prior = ours.prior(game, state, actions)
    unknown = [k for k, action in enumerate(actions) if action.operator not in known.classes]
    assert prior[unknown].max() < min(np.delete(prior, unknown)) and "face_hole" in ours.known.unknown(game)
    only = [action for action in actions if action.operator == "edge_extrude"]
    residual = ResidualEvaluator().prior(game, state, only)
    assert np.allclose(ours.prior(game, state, only), residual)


# --- what it refuses ---


@pytest.mark.parametrize(
    ("settings", "complaint"),
    [
        ({"faces": "convex"}, r"know faces=any, quads, not convex"),
        ({"weights": ScoreWeights(w_sc=3.0)}, r"know w_sc 0\.1 to 1\.5, not 3"),
        ({"operators": "face_inset", "faces": "any"}, r"none of which is an operator here"),
    ],
)
def test_agent__refuses_what_the_weights_do_not_know(
    tmp_path: Path, settings: dict[str, object], complaint: str
) -> None:
    config = replace(SMALL, classes=("edge_extrude", "edge_fill"))
    agent = make_agent("choice-prior", weights=saved_choice(tmp_path, config), seeds=())
    game = quads_game("L", **settings)
    for ask in (agent.check, agent.solve, lambda game: agent.act(game, game.initial())):
        with pytest.raises(ConfigError, match=complaint):
            ask(game)  # type: ignore[operator]


def test_weights__that_are_torn_or_of_another_network_are_refused(tmp_path: Path) -> None:
    path = Path(saved_choice(tmp_path))
    data, meta = path.read_bytes(), json.loads(path.with_suffix(".json").read_text())
    with pytest.raises(ConfigError, match=r"no weights at .*training\.improve"):
        load_choice(tmp_path / "none.safetensors")
    path.write_bytes(data[:-4])
    with pytest.raises(ConfigError, match="sha256 differs"):
        load_choice(path)
    path.write_bytes(data)
    for change, complaint in (
        ({"kind": "nfap"}, "weights of 'nfap'; expected those of 'choice'"),
        ({"config": meta["config"] | {"width": 18}}, "the settings want"),
        ({"config": meta["config"] | {"rules": ["round"]}}, "its settings do not fit"),
        ({"version": 2}, "format version 2"),
    ):
        path.with_suffix(".json").write_text(json.dumps(meta | change))
        with pytest.raises(ConfigError, match=complaint):
            load_choice(path)


def test_weights__that_are_not_numbers_are_refused(tmp_path: Path) -> None:
    from agents.choice.weights import save_choice

    tensors = tensors_of()
    tensors["choose"][0] = np.nan
    path = save_choice(tmp_path / "w.safetensors", SMALL, tensors, {}, {})
    with pytest.raises(ConfigError, match="a weight is not a number"):
        load_choice(path)


def test_file__is_a_safetensors_file() -> None:
    tensors = tensors_of()
    read = safetensors.numpy.load(packed(tensors))
    assert {name: array.tolist() for name, array in read.items()} == {k: v.tolist() for k, v in tensors.items()}
    ours = unpacked(safetensors.numpy.save(tensors), "a file")
    assert {name: array.tolist() for name, array in ours.items()} == {k: v.tolist() for k, v in tensors.items()}


@pytest.mark.parametrize(
    "data", [b"", b"\xff" * 40, (8).to_bytes(8, "little") + b'{"a": 1}', packed(tensors_of())[:-1]]
)
def test_file__of_something_else_is_refused_in_a_line(data: bytes) -> None:
    with pytest.raises(ConfigError, match="a file: no safetensors file") as caught:
        unpacked(data, "a file")
    assert "\n" not in str(caught.value)


# --- the agent ---


@pytest.mark.parametrize("value", ["foreseen", "best"])
@pytest.mark.parametrize("style", ["modeller", "paper"])
def test_agent__solves_in_both_styles(tmp_path: Path, value: str, style: str) -> None:
    game = quads_game("L") if style == "modeller" else simulator("L")
    agent = make_agent("choice-prior", weights=saved_choice(tmp_path), seeds=(), hop_patience=0, value=value)
    solution = agent.solve(game, Budget(refits=40))
    assert_consistent(solution, game)
    assert solution.score.total >= game.final_score(game.initial().mesh).total
    again = agent.solve(game, Budget(refits=40))
    assert again.sequence == solution.sequence


def test_foreseen_value__is_what_the_tree_backs_up() -> None:
    """Of two children that are worth the same, the one that is foreseen to become more is committed."""

    class Foreseeing(InOrder):
        def foresee(self, simulator: Simulator, states: Sequence[State]) -> FloatArray:
            return np.array([50.0 if name_of(state) == "b" else state.score.total for state in states])

    game = Game({"r": 10.0, "a": 12.0, "b": 12.0}, {"r": "ab"})
    for value, committed in (("best", "a"), ("foreseen", "b")):
        config = MctsConfig(**{**PLAIN, "n_simulations": 2, "value": value, "backup": "max"})
        rng = np.random.default_rng(0)
        tree = Search(game, Foreseeing(), config, rng, Node(Track(game.states["r"])))  # type: ignore[arg-type]
        found = list(tree.grow(Meter.unlimited()))
        assert [name_of(track.state) for track in found] == ["a", "b"]
        chosen = tree.committed()
        assert chosen is not None and name_of(chosen.track.state) == committed


def test_agent__needs_neither_torch_nor_safetensors(tmp_path: Path) -> None:
    path = saved_choice(tmp_path)
    program = (
        "import sys\n"
        "sys.modules['torch'] = sys.modules['safetensors'] = None\n"
        "from agents.registry import make_agent\n"
        "from agents.budget import Budget\n"
        "from tests.helpers.choosing import quads_game\n"
        f"agent = make_agent('choice-prior', weights={path!r}, seeds=())\n"
        "print(agent.solve(quads_game('L'), Budget(refits=10)).score.total)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) > 0.0


# --- with nFAP-Net ---


def test_joint_prior__is_the_geometric_mean_of_the_two() -> None:
    game = quads_game()
    state = game.initial()
    actions = game.legal_actions(state)[1:]
    choice, nfap = (make_agent(name)._evaluator for name in ("choice-prior", "nfap-prior"))  # type: ignore[attr-defined]
    joint = make_agent("choice-prior", with_nfap=True)._evaluator  # type: ignore[attr-defined]
    one, other, both = (evaluator.prior(game, state, actions) for evaluator in (choice, nfap, joint))
    assert both.sum() == pytest.approx(1.0)
    ratios = both**2 / (one * other)
    assert ratios == pytest.approx(np.full(len(actions), ratios[0]), rel=1e-9)
    assert np.abs(one - other).max() > 0.05  # they are not of one mind


def test_joint_prior__knows_what_both_know() -> None:
    one = Known(("edge_cap", "edge_fill"), ("any", "quads"), (0.1, 1.0))
    other = Known(("edge_fill", "face_delete"), ("quads",), (0.3, 1.5))
    assert one.shared_with(other) == Known(("edge_cap", "edge_fill", "face_delete"), ("quads",), (0.3, 1.0))
    silent = Known(("face_delete",), (), None)
    assert one.shared_with(silent) == Known(("edge_cap", "edge_fill", "face_delete"), one.rules, one.w_sc)


def test_joint_prior__refuses_what_either_refuses() -> None:
    agent = make_agent("choice-prior", with_nfap=True)
    game = Simulator(painted(BOTTLE), operators="modeller", faces="quads", weights=ScoreWeights(w_sc=2.0))
    with pytest.raises(ConfigError, match=r"these weights know w_sc 0\.1 to 1\.5, not 2"):
        agent.solve(game, Budget(20))
    assert_consistent(agent.solve(quads_game(), Budget(60)), quads_game())
