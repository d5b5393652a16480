"""nFAP-Net, its weights, and the agents that are guided by it; weights are random ones made here, and quickly."""

import hashlib
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
import torch

from agents.budget import Budget
from agents.guided.config import CLASSES, NfapConfig, WarpConfig, class_of
from agents.guided.evaluator import CarryingEvaluator, NfapEvaluator, QuickEvaluator, WarpEvaluator
from agents.guided.measures import N_MEASURES, action_measures, action_spots
from agents.guided.nfap import NfapLabels, NfapNet, candidates_of, loss_terms
from agents.guided.pictures import draw_inputs
from agents.guided.regions import N_POINTS, action_points, region_image
from agents.guided.warp import WarpNet
from agents.guided.weights import SHIPPED, NetworkMeta, load_nfap, load_warpnet, save_weights
from agents.registry import make_agent
from agents.search.evaluator import ResidualEvaluator
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh, is_sane
from autopoly_env.operators import OPERATORS, PRESETS, STOP, Action, legal_actions
from autopoly_env.placement import Disagreement
from autopoly_env.raster import coverage
from autopoly_env.score import ScoreWeights
from autopoly_env.simulator import Simulator, State
from tests.helpers.drawings import BOTTLE, FRAME, HOUSE, painted
from tests.helpers.networks import PAPER, RICH, TOLD, make_net, saved_networks
from tests.helpers.paths import ROOT
from training.networks.labelling import SourceConfig
from training.networks.samples import LabelConfig
from training.networks.streams import Live, NfapStream, collate

torch.set_num_threads(1)  # as tests run beside each other

FULL = [operator.name for operator in PRESETS["full"]]
MESH = PolyMesh.grid(2, 0.2, 0.2, 0.8, 0.8)


def meta_of(training: dict[str, Any]) -> NetworkMeta:
    return NetworkMeta(kind="nfap", config={}, shapes={}, sha256="", training=training, metrics={})


def make_evaluator(net: NfapNet | None = None, temperature: float = 0.5) -> NfapEvaluator:
    labels = {"labels": {"w_sc": 0.3, "temperature": temperature}}
    return NfapEvaluator(net or make_net(), meta_of(labels))


@pytest.fixture
def weights(tmp_path: Path) -> dict[str, str]:
    """Files of random weights of both networks."""
    return saved_networks(tmp_path)


# --- regions ---


def test_classes__tell_stopping_and_every_operator_apart() -> None:
    assert CLASSES[0] == "stop" and class_of(STOP) == 0
    found = {CLASSES[class_of(action)] for action in legal_actions(MESH, FULL)}
    assert found | {"stop"} == {*CLASSES}
    assert CLASSES[class_of(Action("face_hole", 5))] == "face_hole_4"


def test_action_points__lie_on_the_element() -> None:
    actions = [
        Action("edge_subdivide", 0),
        Action("vertex_dissolve", 2),
        Action("face_delete", 3),
        Action("face_split", 0),
    ]
    edge, vertex, face, corner = action_points(MESH, actions)
    (ax, ay), (bx, by) = MESH.vertices[MESH.edges[0]]
    assert np.allclose((edge - (ax, ay)) @ np.array([by - ay, ax - bx]), 0.0)
    assert (vertex == MESH.vertices[2]).all()
    assert (0.5 < face).all() and (face < 0.8).all()
    first = MESH.vertices[list(MESH.faces[0])]
    assert (first.min(axis=0) < corner).all() and (corner < first.max(axis=0)).all()
    assert action_points(MESH, [Action("face_hole", 6)])[0] == pytest.approx(face)


def test_region__of_a_face_is_its_coverage() -> None:
    expected = coverage(PolyMesh.rectangle(0.5, 0.5, 0.8, 0.8), 32)
    assert np.allclose(region_image(MESH, Action("face_delete", 3), 32), expected, atol=1e-6)
    assert np.allclose(region_image(MESH, Action("face_hole", 7), 32), expected, atol=1e-6)


def test_region__of_an_edge_falls_off_with_the_distance() -> None:
    mesh = PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75)
    top = mesh.edge_index(0, 1)
    picture = region_image(mesh, Action("edge_extrude", top), 64)
    assert picture[:, 32].argmax() in (15, 16) and picture.max() > 0.95
    assert picture[32, 32] < 1e-6 and picture[16, 4] < 1e-6


def test_region__of_stopping_is_nowhere() -> None:
    assert not region_image(MESH, STOP, 16).any()


@pytest.mark.parametrize("action", legal_actions(MESH, FULL), ids=str)
def test_region__is_where_the_points_are(action: Action) -> None:
    columns, rows = np.floor(64 * action_points(MESH, [action])[0]).astype(int).T
    assert (region_image(MESH, action, 64)[rows, columns] > 0.6).all()


def test_inputs__are_drawn_in_the_order_asked_for() -> None:
    target = np.zeros((16, 16))
    target[:8] = 1.0
    mesh = PolyMesh.rectangle(0.0, 0.0, 0.5, 1.0)
    drawn = draw_inputs(mesh, target, ("difference", "edges", "vertices", "target", "current"))
    assert drawn.dtype == np.float32 and drawn.shape == (5, 16, 16)
    assert drawn[3].tolist() == target.tolist() and drawn[4, :, :8].all() and not drawn[4, :, 8:].any()
    assert (drawn[0] == drawn[3] - drawn[4]).all()
    assert drawn[1, :, 8].all() and drawn[1, 0, :9].all() and not drawn[1, 3:13, 3].any()
    assert drawn[2].sum() == 2 and drawn[2, 0, 0] == drawn[2, 0, 8] == 1.0  # the others lie below the last row


# --- the network ---


@pytest.mark.parametrize("config", [PAPER, RICH, TOLD], ids=["paper", "rich", "told"])
def test_net__foresees_n_stages(config: NfapConfig) -> None:
    said = make_net(config)(torch.rand(3, len(config.inputs), 32, 32), torch.rand(3, config.n_told))
    n_regions = 1 if config.regions == "one" else len(config.classes)
    assert said.operators.shape == (3, 2, len(config.classes))
    assert said.regions.shape == (3, 2, n_regions, 32, 32)
    assert said.images is not None and said.images.shape == (3, 2, 32, 32)


def test_net__says_the_same_of_stage_one_without_the_others() -> None:
    net, pictures = make_net(), torch.rand(2, 4, 32, 32)
    nothing = torch.zeros(2, 0)
    alone, all_of_it = net(pictures, nothing, n_stages=1, with_images=False), net(pictures, nothing)
    assert alone.images is None and alone.operators.shape[1] == 1
    assert torch.equal(alone.regions[:, 0], all_of_it.regions[:, 0])


def test_choice__is_the_operators_share_and_what_the_region_shows() -> None:
    net = make_net(PAPER)
    with torch.no_grad():
        net.region_weight.fill_(2.0)
    operators = torch.zeros(1, len(CLASSES))
    operators[0, 1] = np.log(3.0)  # subdivision: 3 of 3 + K - 1
    regions = torch.zeros(1, 1, 32, 32)
    regions[:, :, :, 16:] = 1.0  # the right half, in log-odds
    points = torch.tensor([[[0.2, 0.5]], [[0.8, 0.5]], [[0.8, 0.5]], [[0.0, 0.0]]])[None]
    classes = torch.tensor([[1, 1, 2, -1]])
    logits = net.choice_logits(operators, regions, points, classes, torch.zeros(1, 4))[0]
    share = np.log([3 / 2, 3 / 2, 1.0]) - np.log(len(CLASSES) + 2)
    assert logits[:3].tolist() == pytest.approx((share + [0.0, 2.0, 2.0]).tolist(), abs=1e-5)
    assert logits[3] == -torch.inf


def test_choice__reads_its_own_operators_region_and_the_residual() -> None:
    net = make_net(RICH)
    regions = torch.zeros(1, len(CLASSES), 32, 32)
    regions[:, 2] = 1.0
    points, classes = torch.full((1, 2, 1, 2), 0.5), torch.tensor([[1, 2]])
    logits = net.choice_logits(torch.zeros(1, len(CLASSES)), regions, points, classes, torch.tensor([[0.0, -0.25]]))[0]
    assert (logits[1] - logits[0]).item() == pytest.approx(1.0 - 0.25)


@pytest.mark.slow
@pytest.mark.parametrize("config", [PAPER, RICH, replace(RICH, judge=True)], ids=["paper", "rich", "judge"])
def test_net__learns_one_batch(config: NfapConfig) -> None:
    stream = NfapStream(Live(SourceConfig(source="simulator", difficulty=(2, 3))), config, LabelConfig(), seed=0)
    batch = collate([stream[i] for i in range(8)])
    net = make_net(config).train()
    optimizer = torch.optim.Adam(net.parameters(), lr=2e-2)
    truth = NfapLabels.of(batch)
    losses = []
    for _ in range(25):
        terms = loss_terms(net, net(batch["pictures"], batch["told"]), truth)
        losses.append({name: term.item() for name, term in terms.items()})
        optimizer.zero_grad()
        torch.stack(list(terms.values())).sum().backward()
        optimizer.step()
    assert all(losses[-1][name] < 0.8 * losses[0][name] for name in ("image", "operator", "choice"))


# --- measures ---


def test_action_measures__are_those_of_the_edge_to_blame() -> None:
    mesh = PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75)
    target = painted(shapely.box(0.25, 0.25, 1.0, 0.75))  # wider
    actions = [Action("edge_subdivide", k) for k in range(4)]
    measures = action_measures(Disagreement(mesh, target), actions)
    right = mesh.edge_index(1, 2)
    assert measures.shape == (4, N_MEASURES)
    assert measures[:, 0] == pytest.approx(0.5)  # lengths
    assert measures[right, 1] == pytest.approx(np.sqrt(0.25 * 0.5), rel=0.05)  # missing
    assert measures[right, 2] == pytest.approx(0.25, abs=0.02)  # its depth
    assert np.delete(measures, right, axis=0)[:, 1:5].max() == 0.0
    assert measures[:, 7] == pytest.approx(measures[right, 1])  # of all edges in sum


def test_action_measures__a_vertex_spans_more_the_more_it_bulges() -> None:
    mesh = PolyMesh.from_faces([(0.2, 0.2), (0.5, 0.1), (0.8, 0.2), (0.8, 0.8), (0.5, 0.6), (0.2, 0.8)], [range(6)])
    actions = [Action("vertex_dissolve", k) for k in range(6)]
    spanned = action_measures(Disagreement(mesh, painted(HOUSE)), actions)[:, 5]
    assert spanned[1] == pytest.approx(np.sqrt(0.5 * 0.6 * 0.1))
    assert spanned[4] == pytest.approx(-np.sqrt(0.5 * 0.6 * 0.2))  # it dents
    spots = action_spots(mesh, actions, action_points(mesh, actions))
    assert spots[1, :, 1] == pytest.approx(0.2) and spots[1, :, 0].mean() == pytest.approx(0.5)


def test_judge__begins_as_no_correction_and_does_not_mind_how_edges_are_numbered() -> None:
    config = replace(RICH, judge=True)
    net = make_net(config)
    stream = NfapStream(Live(SourceConfig(source="simulator", difficulty=(2, 3))), config, LabelConfig(), seed=0)
    batch = collate([stream[0]])
    said, candidates = net(batch["pictures"], batch["told"]), candidates_of(batch)
    without = net.choice_logits(
        said.operators[:, 0], said.regions[:, 0], candidates.points, candidates.classes, candidates.log_residual
    )
    assert torch.equal(net.choose(said, candidates), without)
    assert net.judge is not None
    torch.nn.init.normal_(net.judge.last.weight)
    there, back = candidates, replace(candidates, spots=candidates.spots.flip(2))
    assert not torch.allclose(net.choose(said, there), without)
    assert torch.allclose(net.choose(said, there), net.choose(said, back), atol=1e-5)


# --- evaluators ---


def game(shape: Any = HOUSE, **options: Any) -> Simulator:
    return Simulator(painted(shape), resolution=64, **options)


@pytest.mark.parametrize("shape", [HOUSE, BOTTLE, FRAME])
def test_prior__sums_to_one_and_leaves_nothing_out(shape: Any) -> None:
    simulator = game(shape)
    state = simulator.initial()
    actions = simulator.legal_actions(state)[1:]
    prior = make_evaluator().prior(simulator, state, actions)
    assert prior.shape == (len(actions),) and prior.sum() == pytest.approx(1.0) and prior.min() > 0.0


def test_prior__goes_with_the_action_and_not_with_its_place() -> None:
    simulator = game()
    state = simulator.initial()
    actions = simulator.legal_actions(state)[1:]
    evaluator = make_evaluator()
    forth, back = (evaluator.prior(simulator, state, order) for order in (actions, actions[::-1]))
    assert forth == pytest.approx(back[::-1], rel=1e-5)


def test_prior__is_the_same_alone_and_in_a_batch() -> None:
    simulator, net = game(BOTTLE), make_net()
    state, evaluator = simulator.initial(), make_evaluator(net)
    children = evaluator.expand(simulator, state, simulator.legal_actions(state)[1:])
    for child in children[-3:]:
        actions = simulator.legal_actions(child)[1:]
        alone = make_evaluator(net).prior(simulator, child, actions)
        assert evaluator.prior(simulator, child, actions) == pytest.approx(alone, rel=1e-3)


def test_prior__is_about_the_target_at_hand() -> None:
    evaluator, mesh = make_evaluator(), PolyMesh.rectangle(0.2, 0.2, 0.8, 0.8)
    for shape in (HOUSE, FRAME):
        simulator = game(shape)
        state = simulator.initial(mesh)
        actions = simulator.legal_actions(state)[1:]
        fresh = make_evaluator().prior(simulator, state, actions)
        assert evaluator.prior(simulator, state, actions) == pytest.approx(fresh, rel=1e-6)


def test_prior__knows_that_elements_cost_more_elsewhere() -> None:
    actions = [Action("edge_subdivide", 0), Action("edge_extrude", 0)]  # +2 and +6 elements
    ratios = []
    for w_sc in (0.3, 0.5):
        simulator = game(weights=ScoreWeights(w_sc=w_sc))
        subdivide, extrude = make_evaluator(temperature=0.5).prior(simulator, simulator.initial(), actions)
        ratios.append((extrude - 1e-4) / (subdivide - 1e-4))
    assert ratios[1] / ratios[0] == pytest.approx(np.exp(-(0.5 - 0.3) * (6 - 2) / 0.5), rel=0.02)


def test_untrained_prior__with_the_residual_is_near_it() -> None:
    simulator = game()
    state = simulator.initial()
    actions = [Action("edge_subdivide", edge) for edge in range(4)]
    net = make_net()
    with torch.no_grad():
        net.region_weight.zero_()
    expected = ResidualEvaluator().prior(simulator, state, actions)
    assert make_evaluator(net).prior(simulator, state, actions) == pytest.approx(expected, abs=1e-3)


# --- what it is told ---


def test_told__is_the_rule_and_the_logarithm_of_the_price() -> None:
    config = NfapConfig(rules=("any", "quads"), w_sc=(0.1, 10.0))  # 1 is in the middle
    assert config.n_told == 3
    assert config.told("quads", 1.0) == pytest.approx((0.0, 1.0, 0.0))
    assert config.told("any", np.e) == pytest.approx((1.0, 0.0, 1.0))
    assert NfapConfig().told("any", 1.0) == ()


def costly_net() -> NfapNet:
    """One that is told the price, with a judge that subtracts what an action's elements cost, and knows no more."""
    net = make_net(TOLD)
    assert net.judge is not None
    with torch.no_grad():
        net.memory.weight_ih[:, -TOLD.n_told :].zero_()  # so that the operators' shares do not change with it
        for layer in (net.judge.first, net.judge.second, net.judge.last):
            layer.weight.zero_()
            layer.bias.zero_()
        net.judge.first.weight[0, -1] = net.judge.second.weight[0, 0] = 1.0
        net.judge.last.weight[0, 0] = -2.0
    return net


def test_prior__is_told_the_price() -> None:
    """The net subtracts 2 x price in middle prices x elements / 4, so the ratio of two actions is known."""
    actions = [Action("edge_subdivide", 0), Action("edge_extrude", 0)]  # +2 and +6 elements
    evaluator, ratios = NfapEvaluator(costly_net(), meta_of({})), []
    simulator = game()
    for w_sc in (0.1, 1.5, 0.1):  # one evaluator is asked about one target at several prices
        simulator.weights = ScoreWeights(w_sc=w_sc)
        subdivide, extrude = evaluator.prior(simulator, simulator.initial(), actions)
        ratios.append((extrude - 1e-4) / (subdivide - 1e-4))
    assert ratios[2] == ratios[0] > ratios[1]
    change = (1.5 - 0.1) / TOLD.middle_price
    assert ratios[1] / ratios[0] == pytest.approx(np.exp(-2.0 * change * (6 - 2) / 4), rel=0.02)


def test_prior__at_another_price_or_rule_is_not_what_was_remembered() -> None:
    evaluator, fresh = (NfapEvaluator(make_net(TOLD), meta_of({})) for _ in range(2))
    target, mesh = painted(HOUSE), PolyMesh.rectangle(0.2, 0.2, 0.8, 0.8)
    actions = [Action("edge_extrude", edge) for edge in range(4)] + [Action("vertex_dissolve", 0)]
    priors = []
    for faces, w_sc in (("any", 0.1), ("any", 1.5), ("quads", 1.5)):
        simulator = Simulator(target, resolution=64, faces=faces, weights=ScoreWeights(w_sc=w_sc))  # type: ignore[arg-type]
        priors.append(evaluator.prior(simulator, simulator.initial(mesh), actions))
    assert not np.allclose(priors[0], priors[1], rtol=1e-4) and not np.allclose(priors[1], priors[2], rtol=1e-4)
    assert fresh.prior(simulator, simulator.initial(mesh), actions) == pytest.approx(priors[2], rel=1e-5)


def test_shipped_prior__takes_away_rather_where_elements_are_dear() -> None:
    net, meta = load_nfap()
    shares = []
    for w_sc in (0.1, 0.3, 1.0, 1.5):
        simulator = game(BOTTLE, weights=ScoreWeights(w_sc=w_sc))
        state = simulator.initial(PolyMesh.grid(2, 0.2, 0.2, 0.8, 0.8))  # eight elements more than it needs
        actions = simulator.legal_actions(state)[1:]
        prior = NfapEvaluator(net, meta).prior(simulator, state, actions)
        removes = [OPERATORS[action.operator].removes for action in actions]
        shares.append(float(prior[removes].sum()))
    assert shares == sorted(shares) and shares[-1] > shares[0] + 0.1


@pytest.mark.parametrize("name", ["nfap-prior", "nfap-mcts"])
def test_agent__plays_in_the_modellers_style(name: str, weights: dict[str, str]) -> None:
    simulator = game(HOUSE, operators="modeller", faces="quads", max_steps=3)
    options: dict[str, Any] = {"nfap_weights": weights["told"], "n": 2, "n_simulations": 4}
    solution = make_agent(name, **options).solve(simulator, Budget(refits=30))
    assert is_sane(solution.mesh, "quads") and solution.score.total > simulator.initial().score.total


def test_prior__of_an_operator_that_the_weights_do_not_know_is_nothing() -> None:
    net = make_net(replace(TOLD, classes=("stop", "edge_extrude", "face_delete")))
    simulator = game()
    prior = NfapEvaluator(net, meta_of({})).prior(
        simulator, simulator.initial(), [Action("edge_subdivide", 0), Action("edge_extrude", 0)]
    )
    assert prior.tolist() == [0.0, 1.0]


@pytest.mark.parametrize("name", ["nfap-prior", "nfap-mcts"])
@pytest.mark.parametrize(
    ("settings", "complaint"),
    [
        ({"faces": "convex"}, r"^these weights know faces=any, quads, not convex: give one of them, or others$"),
        ({"weights": ScoreWeights(w_sc=3.0)}, r"^these weights know w_sc 0\.1 to 1\.5, not 3: give others$"),
        ({"weights": ScoreWeights(w_sc=0.05)}, r"^these weights know w_sc 0\.1 to 1\.5, not 0\.05: give others$"),
        ({"operators": "face_inset"}, r"^these weights know stop, edge_extrude, none of which is an operator here"),
    ],
)
def test_agent__refuses_what_the_weights_do_not_know(
    tmp_path: Path, name: str, settings: dict[str, Any], complaint: str
) -> None:
    net = make_net(replace(TOLD, classes=("stop", "edge_extrude")))
    path = save_weights(tmp_path / "w.safetensors", net, {}, {})
    agent, simulator = make_agent(name, nfap_weights=str(path), n=2), game(**settings)
    for ask in (agent.check, agent.solve, lambda game: agent.act(game, game.initial())):
        with pytest.raises(ConfigError, match=complaint):
            ask(simulator)


def test_old_weights__are_told_nothing_and_refuse_nothing(weights: dict[str, str]) -> None:
    path = Path(weights["nfap"]).with_suffix(".json")
    meta = json.loads(path.read_text())
    for name in ("rules", "w_sc", "classes"):  # as they were written before there were these
        del meta["config"][name]
    path.write_text(json.dumps(meta))
    net, _ = load_nfap(weights["nfap"])
    assert net.config == RICH
    agent = make_agent("nfap-prior", nfap_weights=weights["nfap"], n=2)
    agent.check(game(faces="quads", weights=ScoreWeights(w_sc=3.0)))


def test_weights__keep_what_they_know(tmp_path: Path) -> None:
    path = save_weights(tmp_path / "w.safetensors", make_net(TOLD), {}, {})
    assert load_nfap(path)[0].config == TOLD


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"w_sc": [0.0, 1.0]}, "expected two prices above 0, the lower first"),
        ({"w_sc": [1.0, 0.5]}, "expected two prices above 0, the lower first"),
        ({"rules": ["any", "any"]}, "expected none twice"),
        ({"rules": ["round"]}, "its settings do not fit"),
        ({"rules": ["any"]}, "has shape .* the settings want"),
    ],
)
def test_weights__that_know_nonsense_are_refused(tmp_path: Path, changes: dict[str, Any], complaint: str) -> None:
    path = save_weights(tmp_path / "w.safetensors", make_net(TOLD), {}, {})
    meta = json.loads(path.with_suffix(".json").read_text())
    path.with_suffix(".json").write_text(json.dumps(meta | {"config": meta["config"] | changes}))
    with pytest.raises(ConfigError, match=complaint):
        load_nfap(path)


def carrying(geometry: str, placed: bool) -> CarryingEvaluator:
    if geometry == "quick":
        return QuickEvaluator(make_net(), meta_of({}), placed=placed)
    torch.manual_seed(1)
    warp = WarpNet(WarpConfig(image_size=32, grid=4, feature=16, widths=(4, 4, 8, 8)))
    torch.nn.init.normal_(warp.head.weight, std=0.01)
    return WarpEvaluator(make_net(), meta_of({}), warp, placed=placed)


@pytest.mark.parametrize("geometry", ["warpnet", "quick"])
@pytest.mark.parametrize("placed", [True, False])
def test_carrying_expand__needs_no_refit_and_is_never_worse_than_the_bare_action(geometry: str, placed: bool) -> None:
    simulator = game(BOTTLE)
    evaluator = carrying(geometry, placed)
    state = simulator.initial()
    actions = simulator.legal_actions(state)[1:]
    children = evaluator.expand(simulator, state, actions)
    assert [child.action for child in children] == [a for a in actions if a in {c.action for c in children}]
    assert {child.n_refits for child in children} == {0} and {child.step for child in children} == {1}
    if not placed:
        for child in children:
            assert child.action is not None
            bare = OPERATORS[child.action.operator].apply(state.mesh, child.action.element, child.choice)
            assert child.score.total >= simulator.score(bare).total
            assert bare.with_vertices(child.mesh.vertices) == child.mesh


# --- agents ---


def geometry_of(geometry: str, weights: dict[str, str]) -> dict[str, str]:
    """Options of `nfap-mcts`."""
    return {"geometry": geometry} | ({"warpnet_weights": weights["warpnet"]} if geometry == "warpnet" else {})


def test_mcts_with_networks__refuses_weights_that_it_would_not_use(weights: dict[str, str]) -> None:
    with pytest.raises(ConfigError, match="not used with geometry=quick: give geometry=warpnet"):
        make_agent("nfap-mcts", warpnet_weights=weights["warpnet"])


@pytest.mark.slow
@pytest.mark.parametrize("told", ["nfap", "told"])
@pytest.mark.parametrize("name", ["nfap-prior", "nfap-mcts"])
def test_agent__plays(name: str, told: str, weights: dict[str, str]) -> None:
    options: dict[str, Any] = {"nfap_weights": weights[told], "n": 2, "n_simulations": 4}
    if name == "nfap-mcts":
        options |= {"geometry": "warpnet", "warpnet_weights": weights["warpnet"], "n_rollout": 1}
    simulator = game(HOUSE, max_steps=3)
    first, second = (make_agent(name, **options).solve(simulator, Budget(refits=60)) for _ in range(2))
    assert first.score.total >= simulator.final_score(simulator.initial().mesh).total
    assert first.sequence == second.sequence
    assert first.sequence.final() == first.mesh


def test_quick_expand__has_what_quick_refits_have_and_breaks_no_mesh() -> None:
    simulator = game(BOTTLE)
    state = simulator.initial()
    children = carrying("quick", placed=True).expand(simulator, state, simulator.legal_actions(state)[1:])
    bare = [simulator.trial_of(Disagreement(state.mesh, simulator.silhouette), _taken(child)) for child in children]
    gains = [
        child.score.iou - simulator.score(trial.starts[0].mesh).iou for child, trial in zip(children, bare, strict=True)
    ]
    assert max(gains) > 0.02 and sum(gains) > 0.0
    assert all(is_sane(child.mesh) for child in children)


def _taken(state: State) -> Action:
    assert state.action is not None
    return state.action


@pytest.mark.slow
@pytest.mark.parametrize("geometry", ["warpnet", "quick"])
def test_mcts_with_networks__refits_only_what_it_commits(weights: dict[str, str], geometry: str) -> None:
    agent = make_agent(
        "nfap-mcts", nfap_weights=weights["nfap"], n=2, n_simulations=8, **geometry_of(geometry, weights)
    )
    solution = agent.solve(game(BOTTLE, max_steps=2))
    assert solution.stats.n_refits <= 2 + 2 * 3  # two rectangles, then at most three starts for each of two steps


@pytest.mark.slow
@pytest.mark.parametrize("geometry", ["warpnet", "quick"])
def test_mcts_with_networks__ends_where_its_simulations_do_not(weights: dict[str, str], geometry: str) -> None:
    """Warps and quick refits cost no refit, so that a budget of refits alone would be no bound."""
    agent = make_agent(
        "nfap-mcts", nfap_weights=weights["nfap"], n=2, n_simulations=10**9, **geometry_of(geometry, weights)
    )
    assert agent.solve(game(BOTTLE), Budget(refits=1)).stats.stopped_by in ("refits", "states")
    assert agent.solve(game(BOTTLE), Budget(seconds=0.5)).stats.stopped_by == "seconds"


@pytest.mark.parametrize("name", ["nfap-prior", "nfap-mcts"])
def test_agent__leaves_locked_vertices_where_they_are(name: str, weights: dict[str, str]) -> None:
    start = PolyMesh.rectangle(0.3, 0.3, 0.7, 0.7)
    simulator = Simulator(painted(BOTTLE), resolution=64, max_steps=2, start=start, locked=[0])
    options = geometry_of("warpnet", weights) if name == "nfap-mcts" else {}
    solution = make_agent(name, nfap_weights=weights["nfap"], n=2, n_simulations=2, **options).solve(simulator)
    assert solution.sequence.steps and solution.mesh.vertices[solution.mesh.vertex_index(0)].tolist() == [0.3, 0.3]


def test_agent__needs_weights_of_its_n(weights: dict[str, str]) -> None:
    with pytest.raises(ConfigError, match="n = 5: the weights foresee 2 stages"):
        make_agent("nfap-prior", nfap_weights=weights["nfap"], n=5)


def test_agent__without_torch_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "safetensors", None)
    with pytest.raises(ConfigError, match=r"'nfap-mcts' needs the package safetensors.*pip install -e '\.\[learn\]'"):
        make_agent("nfap-mcts")


def test_algorithm_1__has_no_seeds() -> None:
    with pytest.raises(ConfigError, match="begins at the rectangle"):
        make_agent("nfap-mcts", seeds=["climb"])


@pytest.mark.slow
def test_registry__does_not_import_torch() -> None:
    command = [sys.executable, "-c", "import sys, agents.registry; sys.exit('torch' in sys.modules)"]
    assert subprocess.run(command, cwd=ROOT, check=False).returncode == 0


# --- weights ---


def test_weights__come_back_as_they_were(weights: dict[str, str]) -> None:
    net, meta = load_nfap(weights["nfap"])
    expected = make_net().state_dict()
    assert net.config == RICH and meta.training["labels"]["w_sc"] == 0.3 and not net.training
    assert all(torch.equal(tensor, expected[name]) for name, tensor in net.state_dict().items())


def edit(path: str, **changes: Any) -> None:
    meta = Path(path).with_suffix(".json")
    meta.write_text(json.dumps({**json.loads(meta.read_text()), **changes}))


def test_weights__that_are_missing_are_asked_for(tmp_path: Path, weights: dict[str, str]) -> None:
    with pytest.raises(ConfigError, match=r"no weights at .*none\.json \(No such file"):
        load_nfap(tmp_path / "none.safetensors")
    Path(weights["nfap"]).unlink()
    with pytest.raises(ConfigError, match=r"no weights at .*a\.safetensors"):
        load_nfap(weights["nfap"])


def test_weights__that_are_truncated_are_refused(weights: dict[str, str]) -> None:
    path = Path(weights["nfap"])
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(ConfigError, match=r"sha256 differs, \d+ bytes"):
        load_nfap(path)


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"version": 2}, "format version 2; this code reads version 1"),
        ({"sha256": "0" * 64}, "sha256 differs"),
        ({"kind": "warpnet"}, "weights of 'warpnet'; expected those of 'nfap'"),
        ({"config": {"n": 0}}, "expected 1 to 16 stages"),
        ({"config": {"image_size": 64, "n": 2}}, "has shape .* the settings want"),
        ({"config": {"n": "two"}}, "settings do not fit"),
        ({"shapes": 3}, "shapes: "),
    ],
)
def test_weights__that_do_not_fit_are_refused_in_a_line(
    weights: dict[str, str], changes: dict[str, Any], complaint: str
) -> None:
    edit(weights["nfap"], **changes)
    with pytest.raises(ConfigError, match=complaint) as caught:
        load_nfap(weights["nfap"])
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["", "{", "[]", "3", "\x00", "[" * 9000])
def test_weights__with_a_broken_description_are_refused(weights: dict[str, str], text: str) -> None:
    Path(weights["nfap"]).with_suffix(".json").write_text(text)
    with pytest.raises(ConfigError, match=r"not JSON|format version None"):
        load_nfap(weights["nfap"])


def test_weights__of_something_that_is_no_safetensors_file_are_refused(weights: dict[str, str]) -> None:
    Path(weights["nfap"]).write_bytes(b"hello")
    edit(weights["nfap"], sha256=hashlib.sha256(b"hello").hexdigest())
    with pytest.raises(ConfigError, match="no safetensors file"):
        load_nfap(weights["nfap"])


def test_shipped_weights__load_and_are_small() -> None:
    assert load_nfap()[0].config.n == 3
    assert load_warpnet()[0].config.image_size == 64
    files = [path for path in SHIPPED.iterdir() if path.suffix in (".safetensors", ".json", ".md")]
    assert len(files) == 6 and sum(path.stat().st_size for path in files) <= 10e6
    assert N_POINTS == 8  # which the shipped weights were trained with
