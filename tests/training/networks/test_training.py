"""Data, loop and commands of the networks' training, with networks and data as small as they can be."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from agents.choice.config import classes_of
from agents.guided.config import CLASSES, STOP_CLASS, NfapConfig, WarpConfig
from agents.guided.nfap import candidates_of
from agents.guided.regions import region_image
from agents.guided.weights import load_nfap, load_warpnet, save_weights
from autopoly_env.errors import ConfigError, RunError
from autopoly_env.mesh import PolyMesh, is_sane
from autopoly_env.operators import Action, operator_named
from autopoly_env.score import ScoreWeights
from autopoly_env.simulator import Simulator
from tests.helpers.networks import RICH, TOLD, make_net
from tests.helpers.paths import ROOT
from training import make_expert, measure_nfap, train_nfap, train_warpnet
from training.networks import finish
from training.networks.inherit import inherit
from training.networks.labelling import SourceConfig, build_trajectory
from training.networks.metrics import nfap_metrics
from training.networks.samples import LabelConfig, nfap_sample, turned
from training.networks.streams import Live, NfapStream, WarpStream, batches, collate, stored
from training.networks.trainer import OptimConfig, Process, RunConfig, train
from training.networks.trajectories import STOPPED, Labelled, Shard, Trajectory
from training.options import read_config

torch.set_num_threads(1)  # as tests run beside each other

TEACHER = SourceConfig(n_steps=3, resolution=64)
SIMULATOR = SourceConfig(source="simulator", difficulty=(2, 4), resolution=64)
TINY = {"n": 2, "image_size": 32, "feature": 8, "widths": [4, 4, 4, 4]}
NET = NfapConfig(n=2, image_size=32, feature=8, widths=(4, 4, 4, 4))


@pytest.fixture(scope="module")
def taught() -> Trajectory:
    return build_trajectory(TEACHER, 0)


@pytest.fixture(scope="module")
def shards(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a shard of six constructions."""
    folder = tmp_path_factory.mktemp("shards")
    Shard.pack([build_trajectory(SIMULATOR, k) for k in range(6)]).save(folder / "shard_00000.npz")
    return folder


# --- where labels come from ---


def test_teacher__knows_what_every_action_leads_to(taught: Trajectory) -> None:
    simulator = Simulator(taught.silhouette, resolution=64, weights=ScoreWeights(w_sc=0.3))
    labelled = taught.states[0]
    state = simulator.initial(labelled.mesh)
    assert list(labelled.actions) == simulator.legal_actions(state)[1:]
    for action, outcome in list(zip(labelled.actions, labelled.outcomes, strict=True))[::3]:
        children = simulator.transition_all(state, [action])
        if not children or not is_sane(children[0].mesh):
            assert np.isnan(outcome).all()
            continue
        score = children[0].score
        assert outcome.tolist() == pytest.approx((score.iou, score.complexity, score.self_intersections), abs=1e-6)


def test_teacher__goes_on_with_the_action_that_it_chose(taught: Trajectory) -> None:
    for before, after in zip(taught.states, taught.states[1:], strict=False):
        assert before.outcomes[before.chosen][0] == pytest.approx(after.score[0])
        assert before.outcomes[before.chosen][1] == after.mesh.complexity


def test_simulator__labels_what_was_done_and_then_stops() -> None:
    trajectory = build_trajectory(SIMULATOR, 3)
    assert trajectory.ended and trajectory.states[-1].chosen == STOPPED
    assert trajectory.states[-1].score[0] == pytest.approx(1.0)  # the target is the last shape
    assert all(state.chosen >= 0 and np.isnan(state.outcomes).all() for state in trajectory.states[:-1])


def test_search__labels_what_an_agent_did() -> None:
    trajectory = build_trajectory(replace(TEACHER, source="search", agent="greedy", refits=60), 0)
    totals = [100.0 * s.score[0] - 0.3 * s.score[1] for s in trajectory.states]
    assert trajectory.ended and totals[-1] > totals[0]


@pytest.mark.parametrize("config", [TEACHER, SIMULATOR], ids=["teacher", "simulator"])
def test_trajectory__depends_on_its_number_alone(config: SourceConfig) -> None:
    first, again, other = (build_trajectory(config, k) for k in (5, 5, 6))
    assert np.array_equal(first.mask, again.mask) and not np.array_equal(first.mask, other.mask)
    assert [s.mesh for s in first.states] == [s.mesh for s in again.states]
    assert not np.array_equal(first.mask, build_trajectory(config, 5, held_out=True).mask)


def test_policy__is_a_softmax_of_what_is_gained(taught: Trajectory) -> None:
    state = taught.states[0]
    policy, gains = LabelConfig(temperature=2.0).policy(state, 0.3), LabelConfig().gains(state, 0.3)
    assert policy.sum() == pytest.approx(1.0)
    a, b = np.argsort(gains)[-2:]
    assert policy[1 + b] / policy[1 + a] == pytest.approx(np.exp((gains[b] - gains[a]) / 2.0))
    assert policy[1 + b] / policy[0] == pytest.approx(np.exp(gains[b] / 2.0))


# --- prices and rules ---

QUADS = SourceConfig(operators="modeller", faces="quads", n_steps=2, n_traced=2, resolution=64, w_sc=(0.1, 1.5))
BOTH = replace(NET, classes=("stop", *classes_of("full", "modeller")), rules=("any", "quads"), w_sc=(0.1, 1.5))


def toy(*outcomes: tuple[float, float, float]) -> Labelled:
    """A square whose score is 0.5 with 9 elements, and actions with these outcomes."""
    actions = tuple(Action("edge_subdivide", k) for k in range(len(outcomes)))
    score = np.array((0.5, 9.0, 0.0), np.float32)
    made = np.array(outcomes, np.float32).reshape(-1, 3)
    return Labelled(PolyMesh.rectangle(0.2, 0.2, 0.8, 0.8), score, actions, made, np.zeros(len(actions), np.float32), 0)


def test_policy__at_a_price_is_the_softmax_of_outcomes_at_that_price() -> None:
    """One action gains 2 points of IoU for 4 elements, one 1 point for 2, one is not known."""
    state = toy((0.52, 13.0, 0.0), (0.51, 11.0, 0.0), (np.nan, np.nan, np.nan))
    for price, gains in ((0.25, (1.0, 0.5)), (1.0, (-2.0, -1.0))):
        odds = np.exp(np.array((0.0, *gains)) / 0.5)
        expected = [*(odds / odds.sum()), 0.0]
        assert LabelConfig(temperature=0.5).policy(state, price) == pytest.approx(expected, abs=1e-5)


def test_outcomes__are_the_same_whatever_the_price() -> None:
    cheap, dear = (build_trajectory(replace(TEACHER, traced=0.0, n_random=0, w_sc=w_sc), 1) for w_sc in (0.1, 1.5))
    first, other = cheap.states[0], dear.states[0]
    assert first.actions == other.actions
    assert np.array_equal(first.outcomes, other.outcomes, equal_nan=True)


def test_teacher__keeps_the_rule_and_shards_remember_it(tmp_path: Path) -> None:
    found = build_trajectory(QUADS, 1)
    assert all(is_sane(state.mesh, "quads") for state in found.states)
    Shard.pack([found, build_trajectory(SIMULATOR, 0)]).save(tmp_path / "s.npz")
    shard = Shard.load(tmp_path / "s.npz")
    assert [one.faces for one in (shard[0], shard[1])] == ["quads", "any"]
    assert shard.operators & {"loop_cut", "edge_cap"} and "edge_subdivide" in shard.operators
    del shard.arrays["faces"]  # as shards were before there were rules
    Shard(shard.arrays).save(tmp_path / "old.npz")
    assert Shard.load(tmp_path / "old.npz")[0].faces == "any"
    Shard({**shard.arrays, "faces": np.array(["round", "any"])}).save(tmp_path / "odd.npz")
    with pytest.raises(ConfigError, match="names a rule of faces that there is not"):
        Shard.load(tmp_path / "odd.npz")


def test_sample__is_told_a_price_of_its_own_and_labelled_for_it() -> None:
    stream = NfapStream(Live(QUADS), BOTH, LabelConfig(w_sc=(0.1, 1.5)), seed=4)
    told = [stream[i]["told"] for i in range(3)]
    prices = [BOTH.middle_price * np.exp(row[-1]) for row in told]
    assert [row[:2].tolist() for row in told] == [[0.0, 1.0]] * 3
    assert all(0.1 <= price <= 1.5 for price in prices) and len({round(p, 6) for p in prices}) == 3
    assert stream[1]["told"].tolist() == told[1].tolist()  # it depends on seed and number alone
    trajectory = build_trajectory(QUADS, 1)
    sample, state = nfap_sample(trajectory, 0, BOTH, LabelConfig(), 1.5), trajectory.states[0]
    gains = 100.0 * (state.outcomes[:, 0] - state.score[0]) - 1.5 * (state.outcomes[:, 1] - state.score[1])
    known = np.isfinite(gains)
    assert sample["gains"][known] == pytest.approx(gains[known], abs=1e-3)
    assert sample["added"].tolist() == [
        sum(operator_named(a.operator).change_at(state.mesh, a.element)) for a in state.actions
    ]


@pytest.mark.parametrize(
    ("network", "labels", "source", "complaint"),
    [
        (
            NET,
            0.3,
            replace(QUADS, operators="full"),
            "keeps faces=quads, the network knows faces=any: add it with net.ru",
        ),
        (
            replace(BOTH, classes=CLASSES),
            0.3,
            QUADS,
            "the data has actions of edge_cap, the network's classes are stop",
        ),
        (
            NET,
            (0.1, 1.5),
            TEACHER,
            "labels are for w_sc 0.1 to 1.5, the network is told no price: give another net.w_sc",
        ),
        (BOTH, 3.0, TEACHER, "labels are for w_sc 3 to 3, the network knows w_sc 0.1 to 1.5: give another net.w_sc"),
    ],
)
def test_stream__of_what_the_network_does_not_know_is_refused(
    network: NfapConfig, labels: Any, source: SourceConfig, complaint: str
) -> None:
    with pytest.raises(ConfigError, match=complaint):
        NfapStream(Live(source), network, LabelConfig(w_sc=labels), seed=0)


@pytest.mark.parametrize(
    ("settings", "complaint"),
    [
        ({"w_sc": (1.0, 0.5)}, "expected one price above 0, or two, the lower first"),
        ({"w_sc": 0.0}, "expected one price above 0, or two, the lower first"),
        ({"operators": "nonsense"}, "operators 'nonsense' are unknown"),
        ({"source": "simulator", "faces": "quads"}, "builds meshes of any faces, not of quads: give source=teacher"),
    ],
)
def test_source__that_makes_no_sense_is_refused(settings: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ConfigError, match=complaint):
        SourceConfig(**settings)


# --- held-out metrics ---


def test_metrics__of_a_net_that_is_told_no_price_are_corrected_for_it(taught: Trajectory) -> None:
    """The more an element costs, the more the first actions are those that take away."""
    sample = nfap_sample(taught, 0, NET, LabelConfig(), 0.3)
    batch = collate([sample | {"gains": -sample["added"]}])  # whatever adds least is best
    batch["policy"] = torch.nn.functional.one_hot(batch["gains"].argmax(-1), batch["gains"].shape[1]).float()
    batch["gains"] += 10.0
    net = make_net(NET)
    with torch.inference_mode():
        said = net(batch["pictures"], batch["told"])
        assert nfap_metrics(net, said, batch, dearer=1e3)["gain_top3"] == pytest.approx(1.0)
        assert nfap_metrics(net, said, batch, dearer=-1e3)["gain_top3"] < 1.0


def test_measure_nfap__has_a_row_for_each_price_and_refuses_what_the_weights_do_not_know(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shards = tmp_path / "shards"
    shards.mkdir()
    Shard.pack([build_trajectory(QUADS, k, held_out=True) for k in range(2)]).save(shards / "shard_00000.npz")
    told = save_weights(tmp_path / "told.safetensors", make_net(TOLD), {}, {})
    old = save_weights(tmp_path / "old.safetensors", make_net(RICH), {}, {})
    prices = ["--w-sc", "0.3", "--w-sc", "1.5", "--n", "4"]
    assert measure_nfap.main([str(shards), "--weights", str(told), *prices]) == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines() if " told " in line]
    assert [row[3] for row in rows] == ["0.3", "1.5"]
    assert measure_nfap.main([str(shards), "--weights", str(old), *prices]) == 2
    assert "the data keeps faces=quads, the network knows faces=any" in capsys.readouterr().err


# --- a network that goes on from another ---


def test_inherit__says_of_known_classes_what_the_old_network_did(tmp_path: Path) -> None:
    rich = replace(RICH, judge=True)
    old, net = make_net(rich), make_net(TOLD, seed=1)
    assert old.judge is not None
    torch.nn.init.normal_(old.judge.last.weight)
    inherit(net, str(save_weights(tmp_path / "old.safetensors", old, {}, {})))
    stream = NfapStream(Live(SIMULATOR), TOLD, LabelConfig(), seed=0)
    sample = stream[0]
    batch = collate([sample])
    before, now = old(batch["pictures"], torch.zeros(1, 0)), net(batch["pictures"], batch["told"])
    rows = [TOLD.classes.index(name) for name in CLASSES]
    assert torch.equal(now.operators[:, :, rows], before.operators)
    assert torch.equal(now.regions[:, :, rows], before.regions)
    candidates = candidates_of(batch)
    classes = torch.tensor([[rows.index(row) for row in candidates.classes[0].tolist()]])
    theirs = old.judge(before.maps, before.feature, before.told, replace(candidates, classes=classes))
    assert net.judge is not None
    assert torch.allclose(net.judge(now.maps, now.feature, now.told, candidates), theirs, atol=1e-6)


@pytest.mark.parametrize(
    ("config", "complaint"),
    [
        (replace(TOLD, judge=True, feature=8), "weights of another network than net says"),
        (replace(TOLD, classes=("stop", "edge_extrude")), "it knows edge_subdivide, the network's classes do not"),
    ],
)
def test_inherit__refuses_what_does_not_fit(tmp_path: Path, config: NfapConfig, complaint: str) -> None:
    path = save_weights(tmp_path / "old.safetensors", make_net(replace(RICH, judge=True)), {}, {})
    with pytest.raises(ConfigError, match=complaint):
        inherit(make_net(config), str(path))


# --- shards ---


def test_shard__gives_back_what_was_packed(tmp_path: Path, taught: Trajectory) -> None:
    others = [build_trajectory(SIMULATOR, k) for k in range(2)]
    Shard.pack([*others, taught]).save(tmp_path / "s.npz")
    found = Shard.load(tmp_path / "s.npz")
    assert len(found) == 3
    for trajectory, expected in zip((found[0], found[2]), (others[0], taught), strict=True):
        assert np.array_equal(trajectory.mask, expected.mask) and trajectory.ended == expected.ended
        for state, before in zip(trajectory.states, expected.states, strict=True):
            assert state.mesh.faces == before.mesh.faces and state.actions == before.actions
            assert np.allclose(state.mesh.vertices, before.mesh.vertices, atol=1e-6)
            assert np.array_equal(state.outcomes, before.outcomes, equal_nan=True) and state.chosen == before.chosen


@pytest.mark.parametrize("length", [0, 1, 100, -1])
def test_shard__that_is_truncated_is_refused(tmp_path: Path, shards: Path, length: int) -> None:
    path = tmp_path / "s.npz"
    path.write_bytes((shards / "shard_00000.npz").read_bytes()[:length])
    with pytest.raises(ConfigError, match=r"cannot read the shard .*make it again") as caught:
        Shard.load(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("version", lambda a: a + 1),
        ("corners", lambda a: a + 1000),
        ("chosen", lambda a: a + 1000),
        ("actions", lambda a: a + 50),
        ("vertices", lambda a: a * np.nan),
        ("vertices", lambda a: a[:-1]),
        ("n_states", lambda a: a[:-1]),
        ("outcomes", lambda a: None),
    ],
)
def test_shard__that_does_not_fit_together_is_refused(tmp_path: Path, shards: Path, name: str, change: Any) -> None:
    with np.load(shards / "shard_00000.npz") as file:
        arrays = {key: file[key] for key in file.files}
    changed = change(arrays.pop(name))
    np.savez(tmp_path / "s.npz", **arrays, **({} if changed is None else {name: changed}))
    with pytest.raises(ConfigError, match="make it again"):
        Shard.load(tmp_path / "s.npz")


def test_shard__is_never_unpickled(tmp_path: Path) -> None:
    np.savez(tmp_path / "s.npz", version=np.array([print], dtype=object))
    with pytest.raises(ConfigError, match="cannot read the shard"):
        Shard.load(tmp_path / "s.npz")


def test_make_expert__makes_what_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(make_expert, "SHARD_SIZE", 2)
    command = [str(tmp_path), "source=simulator", "resolution=64", "--engine", "serial"]
    assert make_expert.main([*command, "--n", "4"]) == 0
    first = (tmp_path / "shard_00000.npz").read_bytes()
    (tmp_path / "shard_00000.npz").unlink()
    assert make_expert.main([*command, "--n", "4"]) == 0
    assert "1 of 1" in capsys.readouterr().out
    assert (tmp_path / "shard_00000.npz").read_bytes() == first and len(stored(str(tmp_path))) == 4
    meta = json.loads((tmp_path / "meta.json").read_text())
    assert meta["source"].pop("faces") == "any"
    (tmp_path / "meta.json").write_text(json.dumps(meta))  # as it was before there were rules
    assert make_expert.main([*command, "--n", "4"]) == 0
    capsys.readouterr()
    assert make_expert.main([*command, "--n", "4", "difficulty=[1,2]"]) == 2
    capsys.readouterr()
    assert make_expert.main([str(tmp_path), "source=teacher", "--n", "4"]) == 2
    assert "holds shards made with other settings" in capsys.readouterr().err


# --- samples ---


def test_sample__shows_the_region_to_be_expected_of_the_operator(taught: Trajectory) -> None:
    sample, state = nfap_sample(taught, 0, NET, LabelConfig(), 0.3), taught.states[0]
    odds = sample["policy"] * (sample["classes"] == sample["operators"][0])
    expected = sum(p * region_image(state.mesh, a, 32) for p, a in zip(odds, state.actions, strict=True)) / odds.sum()
    assert np.abs(sample["regions"][0] - expected).max() < 0.2  # unlikely actions are left out
    assert sample["regions"][0].sum() == pytest.approx(expected.sum(), rel=0.4)


def test_sample__after_the_end_is_a_stop() -> None:
    trajectory = build_trajectory(SIMULATOR, 1)
    sample = nfap_sample(trajectory, trajectory.n_actions, NET, LabelConfig(), 0.3)
    assert sample["operators"].tolist() == [STOP_CLASS] * 2 and sample["first"][STOP_CLASS] == 1.0
    assert not sample["regions"].any() and not sample["policy"].any()
    assert np.array_equal(sample["images"][1], sample["pictures"][0])


def test_sample__shows_what_comes_next(taught: Trajectory) -> None:
    sample = nfap_sample(taught, 0, NET, LabelConfig(), 0.3)
    assert np.array_equal(sample["images"][0], nfap_sample(taught, 1, NET, LabelConfig(), 0.3)["pictures"][0])
    chosen = taught.states[0].actions[taught.states[0].chosen]
    assert CLASSES[sample["operators"][0]].startswith(chosen.operator)
    assert sample["first"].sum() == pytest.approx(1.0, abs=1e-5) and len(sample["first"]) == len(CLASSES)


@pytest.mark.parametrize("way", range(8))
def test_symmetry__keeps_pictures_and_points_together(way: int) -> None:
    trajectory = build_trajectory(SIMULATOR, 2)
    plain = nfap_sample(trajectory, 0, NET, LabelConfig(), 0.3)
    state = trajectory.states[0]
    sample, chosen = turned(plain, way), state.chosen
    columns, rows = np.floor(32 * sample["points"][chosen]).astype(int).T
    assert (sample["regions"][0][rows, columns] > 0.5).all()
    assert sample["pictures"].sum() == pytest.approx(plain["pictures"].sum())
    warp = next(iter(batches(WarpStream(Live(SIMULATOR), WarpConfig(image_size=32), 0, turn=False), 1, 0)))
    one = turned({name: tensor[0].numpy() for name, tensor in warp.items()}, way)
    start, end = one["vertices"][one["edges"]].swapaxes(0, 1)
    assert 0.5 * (start[:, 0] * end[:, 1] - end[:, 0] * start[:, 1]).sum() > 0.0
    shown = one["pictures"][0].mean()
    assert 0.5 * (start[:, 0] * end[:, 1] - end[:, 0] * start[:, 1]).sum() == pytest.approx(shown, rel=0.02)


def test_collate__pads_to_the_longest(shards: Path) -> None:
    stream = NfapStream(stored(str(shards)), NET, LabelConfig(), seed=0)
    samples = [stream[i] for i in range(6)]
    batch = collate(samples)
    longest = max(len(sample["classes"]) for sample in samples)
    assert batch["classes"].shape == (6, longest) and batch["points"].shape[:2] == (6, longest)
    assert [(row >= 0).sum().item() for row in batch["classes"]] == [len(sample["classes"]) for sample in samples]


def test_stream__is_shared_out_among_processes(shards: Path) -> None:
    stream = NfapStream(stored(str(shards)), NET, LabelConfig(), seed=3)
    alone = batches(stream, 4, 0, first_step=2)
    parts = [next(batches(stream, 2, 0, first_step=2, rank=rank, n_ranks=2)) for rank in range(2)]
    assert torch.equal(next(alone)["pictures"], torch.cat([part["pictures"] for part in parts]))


def test_stream__without_shards_asks_for_some(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"no shards .*training\.make_expert"):
        stored(str(tmp_path))


# --- settings ---


def test_config__is_the_file_and_then_the_overrides(tmp_path: Path) -> None:
    path = tmp_path / "c.yaml"
    path.write_text("net:\n  n: 4\noptim:\n  lr: 1e-2\n")
    config = read_config(path, ["optim.lr=3e-4", "net.inputs=[target]"], train_nfap.TrainNfapConfig())
    assert (config.net.n, config.optim.lr, config.net.inputs) == (4, 3e-4, ("target",))


@pytest.mark.parametrize(
    ("override", "complaint"),
    [
        ("optim.rate=1", r"unknown option 'rate'; give one of lr, "),
        ("optim=1", r"'optim' is a section; give one of its options"),
        ("optim.lr=fast", r"optim\.lr: .* got 'fast'"),
        ("optim.lr=-1", r"^override 'optim\.lr=-1': optim\.lr=-1\.0: expected a number above 0$"),
        ("optim.lr", r"expected key=value, such as optim\.lr=1e-3"),
        ("net.inputs=[sound]", r"net\.inputs\.0: "),
        ("net.n=[", r"not YAML"),
    ],
)
def test_config__says_in_a_line_what_is_wrong(override: str, complaint: str) -> None:
    with pytest.raises(ConfigError, match=complaint) as caught:
        read_config(None, [override], train_nfap.TrainNfapConfig())
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["nfap", "warpnet"])
def test_config_file__says_its_command_and_fits(name: str) -> None:
    path = ROOT / "configs" / "train" / f"{name}.yaml"
    default: Any = train_nfap.TrainNfapConfig() if name == "nfap" else train_warpnet.TrainWarpnetConfig()
    read_config(path, [], default)
    assert path.read_text().startswith(f"# python -m training.train_{name} --config configs/train/{name}.yaml")


def test_learning_rate__rises_and_falls() -> None:
    optim = OptimConfig(lr=1.0, warmup=4, n_steps=104)
    assert [optim.lr_at(step) for step in (0, 3, 54)] == pytest.approx([0.25, 1.0, 0.5])
    assert optim.lr_at(103) < 1e-3


# --- the loop ---


def settings(shards: Path, *overrides: str) -> list[str]:
    tiny = [f"net.{key}={json.dumps(value)}" for key, value in TINY.items()]
    data = [f"data.shards={shards}", f"data.held_out={shards}", "data.n_held_out=8"]
    loop = ["optim.batch_size=4", "optim.n_steps=8", "run.eval_every=4", "run.save_every=2", "run.log_every=1"]
    return [*tiny, *data, *loop, "run.n_workers=0", "run.device=cpu", "run.n_threads=1", *overrides]


def nfap(shards: Path, out: Path, *overrides: str) -> int:
    return train_nfap.main([*settings(shards, *overrides), "--out", str(out)])


def lines(out: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (out / "log.jsonl").read_text().splitlines()]


@pytest.fixture(scope="module")
def finished(shards: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run that was never stopped."""
    out = tmp_path_factory.mktemp("run")
    assert nfap(shards, out) == 0
    return out


def test_run__leaves_log_pictures_report_and_weights(finished: Path) -> None:
    assert [line["step"] for line in lines(finished) if "train/loss" in line] == [*range(1, 9)]
    assert {"train/image", "train/operator", "train/region", "train/choice"} <= lines(finished)[0].keys()
    assert sorted(path.name for path in (finished / "pictures").iterdir()) == ["step_000004.png", "step_000008.png"]
    report = json.loads((finished / "report.json").read_text())
    expected = {"operator_accuracy", "element_top3", "element_top3_residual", "element_top3_chance", "action_top3"}
    assert expected <= report["metrics"].keys() and report["cost"]["megaflops"] > 0.0
    assert load_nfap(finished / "nfap.safetensors")[1].metrics["loss"] == report["metrics"]["loss"]


@pytest.mark.slow
def test_run__that_was_killed_goes_on_along_the_same_curve(
    shards: Path, finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from training.networks import trainer

    update, steps = trainer._update, []

    def dies(*arguments: Any) -> Any:
        steps.append(arguments[-1])
        if len(steps) == 6:  # step 5; the last checkpoint is that of step 4
            raise KeyboardInterrupt
        return update(*arguments)

    monkeypatch.setattr(trainer, "_update", dies)
    assert nfap(shards, tmp_path) == 130
    with (tmp_path / "log.jsonl").open("a") as file:
        file.write('{"step": 5, "tra')  # half a line, as a kill leaves it
    monkeypatch.undo()
    assert nfap(shards, tmp_path) == 0
    assert lines(tmp_path) == lines(finished)
    unbroken, resumed = (torch.load(out / "checkpoint.pt", weights_only=True) for out in (finished, tmp_path))
    assert all(torch.equal(resumed["net"][name], tensor) for name, tensor in unbroken["net"].items())
    assert (tmp_path / "nfap.safetensors").read_bytes() == (finished / "nfap.safetensors").read_bytes()


def test_run__with_other_settings_needs_another_folder(
    shards: Path, finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert nfap(shards, finished, "optim.lr=0.5") == 1
    assert "belongs to a run with another optim.lr" in capsys.readouterr().err


def test_run__with_a_damaged_checkpoint_says_so(
    shards: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "checkpoint.pt").write_bytes(b"not a checkpoint")
    assert nfap(shards, tmp_path) == 1
    error = capsys.readouterr().err
    assert "cannot read" in error and error.count("\n") == 1


class Dull:
    """A task whose held-out loss never falls, and whose loss is what it is told to be."""

    name = "dull"

    class Losses(torch.nn.Module):
        def __init__(self, net: torch.nn.Module, loss: float) -> None:
            super().__init__()
            self.net, self.loss = net, loss

        def forward(self, batch: Any) -> dict[str, torch.Tensor]:
            return {"loss": self.loss * self.net(batch["x"]).mean() ** 2, "part": torch.tensor(self.loss)}

    def __init__(self, loss: float) -> None:
        self.net = torch.nn.Linear(1, 1)
        self.losses = self.Losses(self.net, loss)
        self.stream = [{"x": np.ones(1, np.float32)}] * 10_000

    def measure(self, device: torch.device) -> dict[str, float]:
        return {"loss": 1.0}

    def draw(self, device: torch.device) -> np.ndarray:
        return np.zeros((4, 4), np.uint8)


RUN = RunConfig(n_workers=0, eval_every=2, patience=3, seed=17)


@pytest.mark.slow
def test_run__stops_early_where_the_held_out_loss_does_not_fall(tmp_path: Path) -> None:
    train(Dull(1.0), OptimConfig(n_steps=100, batch_size=2), RUN, {}, tmp_path, Process())
    measured = [line["step"] for line in lines(tmp_path) if "held_out/loss" in line]
    assert measured == [2, 4, 6, 8]  # the first is the best, three more are not better


def test_run__names_the_samples_of_a_loss_that_is_no_number(tmp_path: Path) -> None:
    with pytest.raises(RunError, match=r"loss is nan at step 0 \(loss, part\): samples 0\.\.1 of seed 17"):
        train(Dull(float("nan")), OptimConfig(n_steps=100, batch_size=2), RUN, {}, tmp_path, Process())


def test_warpnet__is_trained_and_exported(shards: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shipped = tmp_path / "shipped"
    monkeypatch.setattr(finish, "SHIPPED", shipped)
    overrides = [o for o in settings(shards, "net.grid=3", "optim.n_steps=4") if not o.startswith("net.n=")]
    assert train_warpnet.main([*overrides, "--out", str(tmp_path / "run"), "--export"]) == 0
    _, meta = load_warpnet(shipped / "warpnet.safetensors")
    assert {"iou_before", "iou_warped", "iou_full", "share"} <= meta.metrics.keys()
    card = (shipped / "warpnet.md").read_text()
    assert "iou_warped" in card and str(meta.training["run"]["seed"]) in card


def test_nfap__that_is_told_the_price_begins_with_earlier_weights_and_its_card_says_what_it_knows(
    shards: Path, finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shipped, begin = tmp_path / "shipped", finished / "nfap.safetensors"
    monkeypatch.setattr(finish, "SHIPPED", shipped)
    told = ["net.rules=[any]", "net.w_sc=[0.1, 1.5]", "labels.w_sc=[0.1, 1.5]", f"begin={begin}", "optim.n_steps=4"]
    both = [*settings(shards, *told), f"data.shards=[{shards}, {shards}]"]
    assert train_nfap.main([*both, "--out", str(tmp_path / "run"), "--export"]) == 0
    net, meta = load_nfap(shipped / "nfap.safetensors")
    assert net.config.rules == ("any",) and meta.training["begin"] == str(begin)
    card = (shipped / "nfap.md").read_text()
    assert "Rules of faces any; prices w_sc 0.1 to 1.5; what" in card and f"weights that were at `{begin}`" in card
    assert card.count("1 shards of") == 3  # two to learn from, one to measure with


@pytest.mark.slow
def test_two_processes__learn_together(shards: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "torch.distributed.run", "--standalone", "--nproc-per-node", "2"]
    command += ["-m", "training.train_nfap", "--out", str(tmp_path), *settings(shards, "optim.n_steps=4")]
    environment = os.environ | {"OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    one_process = tmp_path / "alone"  # of twice the batch: the mean of two gradients is the gradient of the mean
    assert nfap(shards, one_process, "optim.n_steps=4", "optim.batch_size=8") == 0
    losses = [
        [line["held_out/image"] for line in lines(out) if "held_out/loss" in line] for out in (tmp_path, one_process)
    ]
    assert losses[0] == pytest.approx(losses[1], rel=1e-3)


@pytest.mark.parametrize("command", [train_nfap, train_warpnet, make_expert, measure_nfap])
def test_help__shows_examples(command: Any, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["--help"]) == 0
    assert f"python -m {command.__name__}" in " ".join(capsys.readouterr().out.split())


def test_command__refuses_a_gpu_that_is_not_there(
    shards: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if torch.cuda.is_available():
        pytest.skip("there is a GPU")
    assert nfap(shards, tmp_path, "run.device=cuda") == 2
    assert "torch finds no GPU here" in capsys.readouterr().err
