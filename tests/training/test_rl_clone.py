"""Cloning: samples with their gains, turned ones, and a network that learns them."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from agents.rl.config import NetConfig
from agents.rl.network import MeshNet, observer_of
from agents.rl.weights import load_policy, save_policy
from autopoly_env.errors import AutoPolyError, ConfigError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import OPERATORS, PRESETS, Action, ActionCodec
from tests.helpers.policies import ENV, NET, config
from training import rl_clone, train_rl
from training.improvement.playing import PlayConfig, play
from training.improvement.plays import Play
from training.networks.labelling import SourceConfig, build_trajectory
from training.networks.samples import LabelConfig
from training.networks.streams import collate, stored
from training.networks.trainer import Process, train
from training.networks.trajectories import Shard, Trajectory
from training.options import read_config
from training.policies.clone_samples import CloneConfig, clone_sample, prepared, turned_observation
from training.policies.play_samples import play_sample, searched
from training.rl_clone import CloneTask

torch.set_num_threads(1)  # as tests run beside each other

pytestmark = pytest.mark.slow  # a network is trained


TEACHER = SourceConfig(n_steps=3, resolution=64)


@pytest.fixture(scope="module")
def shards(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("shards")
    Shard.pack([build_trajectory(TEACHER, k) for k in range(4)]).save(folder / "shard_00000.npz")
    return folder


@pytest.fixture(scope="module")
def trajectory(shards: Path) -> Trajectory:
    return stored(str(shards))[0]


def clone_config(shards: Path, *overrides: str) -> CloneConfig:
    given = [
        *(f"net.{key}={json.dumps(value)}" for key, value in NET.items()),
        *(f"env.{key}={json.dumps(value)}" for key, value in ENV.items()),
        f"data.shards={shards}",
        f"data.held_out={shards}",
        "data.n_held_out=8",
        "optim.n_steps=160",
        "optim.batch_size=16",
        "optim.warmup=2",
        "optim.lr=0.01",
        "run.n_workers=0",
        "run.eval_every=80",
        "n_exam=1",
    ]
    return read_config(None, [*given, *overrides], CloneConfig())


def test_sample__has_the_gains_at_its_price(trajectory: Trajectory, shards: Path) -> None:
    settings = clone_config(shards)
    one = prepared(trajectory, settings.env.spec())[0]
    for w_sc in (0.3, 1.0):
        sample = clone_sample(one, w_sc, 0, settings)
        gains = LabelConfig().gains(one.state, w_sc)
        for action, gain, number in zip(one.state.actions, gains, one.index, strict=True):
            assert sample["action_mask"][number] == 1, action
            if np.isfinite(gain):
                assert sample["gains"][number] == pytest.approx(gain, abs=1e-4)
                ratio = np.exp(gain / 0.5)  # of its odds to those of stopping, whose gain is 0
                assert sample["policy"][number] == pytest.approx(sample["policy"][0] * ratio, rel=1e-3, abs=1e-7)
        assert sample["policy"].sum() == pytest.approx(1.0)
        assert sample["value"][0] >= 0.0 and sample["price"][0] == np.float32(w_sc)


@pytest.mark.parametrize("way", range(8))
def test_turned_sample__is_what_the_turned_mesh_shows(way: int, trajectory: Trajectory, shards: Path) -> None:
    settings = clone_config(shards)
    one = prepared(trajectory, settings.env.spec())[-1]
    sample = clone_sample(one, 1.0, way, settings)
    n_vertices, n_edges, _, n_corners = one.seen.observation["counts"].tolist()
    points = sample["vertices"].reshape(-1, 2)[:n_vertices].astype(float)
    corners = sample["faces"].reshape(-1, 2)[:n_corners]
    faces = [tuple(corners[corners[:, 0] == f, 1].tolist()) for f in range(int(one.seen.observation["counts"][2]))]
    mesh = PolyMesh.from_faces(points, faces)  # which refuses areas that are not positive
    seen = observer_of(settings.env.spec()).observe(mesh, sample["target"], 5)
    assert np.array_equal(seen["edges"], sample["edges"]) and np.array_equal(seen["faces"], sample["faces"])
    assert np.abs(seen["rendering"].astype(int) - sample["rendering"]).max() <= 1
    spec = settings.env.spec()
    assert np.array_equal(ActionCodec(spec.operators, spec.max_vertices).legal_mask(mesh), sample["action_mask"] > 0)
    assert set(turned_observation(one.seen.observation, way)) == set(one.seen.observation) and n_edges > 0


def test_clone__learns_goes_on_and_can_be_begun_with(shards: Path, tmp_path: Path) -> None:
    task = CloneTask(clone_config(shards))
    with torch.no_grad():
        before = task.measure(torch.device("cpu"))
    train(task, task.config.optim, task.config.run, {"any": 1}, tmp_path, Process())
    with torch.no_grad():
        after = task.measure(torch.device("cpu"))
    assert after["choice"] < 0.8 * before["choice"] and after["value"] < before["value"]
    assert after["gain_share"] > before["gain_share"]
    path = rl_clone.finish_clone(task, {"any": 1}, tmp_path, torch.device("cpu"))
    net, meta = load_policy(path)
    assert meta.algorithm == "clone" and meta.metrics["choice"] == pytest.approx(after["choice"])
    assert train_rl.initial_net(config(f"run.init={path}"), trust=False).config == net.config


def test_clone_command__refuses_what_is_no_data(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert rl_clone.main([f"data.shards={tmp_path}", "--out", str(tmp_path / "run")]) == 2
    assert "no shards" in capsys.readouterr().err
    assert rl_clone.main(["data.temperature=0"]) == 2
    assert "temperature" in capsys.readouterr().err


def test_samples__can_be_collated(shards: Path) -> None:
    task = CloneTask(clone_config(shards))
    batch = collate([task.stream[k] for k in range(3)])
    assert all(len(tensor) == 3 for tensor in batch.values())
    assert all(
        torch.equal(a, b)
        for a, b in zip(batch.values(), collate([task.stream[k] for k in range(3)]).values(), strict=True)
    )


def test_weights__are_written_and_read_back(tmp_path: Path) -> None:
    settings = config()
    net = MeshNet(settings.net, settings.env.spec())
    again, meta = load_policy(save_policy(tmp_path / "p.safetensors", net, "clone", {"a": 1}, {"b": 2.0}))
    assert again.spec == net.spec and meta.training == {"a": 1} and meta.metrics == {"b": 2.0}
    assert issubclass(ConfigError, AutoPolyError) and replace(settings, algorithm="ppo").options() == settings.ppo


# --- what search found ---

BOTH = (
    'env.courses=[{"targets": "objects", "w_sc": [0.1, 1.5], "faces": "quads", "policy_operators": "modeller"}, '
    '{"targets": "construction", "w_sc": [0.1, 1.5]}]'
)
PLAYED = PlayConfig(refits=12, n_runs=1, modeller=1.0, n_least=1)


@pytest.fixture(scope="module")
def plays(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("plays")
    for k in range(3):
        play(PLAYED, seed=0, round_=1, number=k).save(folder / f"{k}.json")
    return folder


def test_play_sample__has_what_was_found_behind_each_action(plays: Path, shards: Path) -> None:
    settings = clone_config(shards, BOTH)
    spec = settings.env.spec()
    assert spec.operators == tuple(OPERATORS) and spec.faces == ("any", "quads") and spec.w_sc == (0.1, 1.5)
    codec, played = ActionCodec(spec.operators, spec.max_vertices), Play.load(plays / "0.json")
    kept = [one for one in played.states if one.best - one.total >= 0.05 and len(one.vertices) <= spec.max_vertices]
    made = searched(played, spec, 0.05)
    assert kept and len(made) == len(kept)
    for one, state in zip(made, kept, strict=True):
        sample = play_sample(one, 0, settings)
        assert sample["rule"].tolist() == [0.0, 0.0, 1.0] and sample["price"][0] == np.float32(played.w_sc)
        assert sample["value"][0] == pytest.approx(0.1 * (state.best - state.total), abs=1e-6)
        found = {codec.encode(Action(*a)): v for a, v in zip(state.actions, state.found, strict=True)}
        assert {k for k in found if sample["policy"][k] > 0} <= {k for k, v in found.items() if v is not None}
        best = max((k for k, v in found.items() if v is not None), key=lambda k: found[k] or 0.0)
        gain = (found[best] or 0.0) - state.total
        assert sample["gains"][best] == pytest.approx(gain, abs=1e-3) and sample["gains"][0] == 0.0
        assert sample["policy"][0] == pytest.approx(sample["policy"][best] * np.exp(-gain / 0.5), abs=1e-6)
        own = {operator.name for operator in PRESETS["modeller"]} | {"stop"}
        assert {codec.decode(int(k)).operator for k in np.flatnonzero(sample["action_mask"])} <= own


def test_clone__learns_from_plays_and_shards_and_begins_with_weights_of_fewer_operators(
    plays: Path, shards: Path, tmp_path: Path
) -> None:
    spec = replace(clone_config(shards).env.spec(), faces=(), w_sc=())
    old = save_policy(tmp_path / "old.safetensors", MeshNet(NetConfig(**NET), spec), "ppo", {}, {})
    settings = clone_config(shards, BOTH, f"data.plays={plays}", f"init={old}", "optim.n_steps=2")
    task = CloneTask(settings)
    assert {tuple(task.stream[k]["rule"].tolist()) for k in range(4)} == {(1.0, 0.0, 0.0), (0.0, 0.0, 1.0)}
    train(task, settings.optim, settings.run, {"any": 1}, tmp_path / "run", Process())
    assert task.net.spec == settings.env.spec()


def test_clone_of_a_rule_that_no_course_has__is_refused(shards: Path, tmp_path: Path) -> None:
    source = SourceConfig(n_steps=2, resolution=64, operators="modeller", faces="quads", traced=0.0)
    folder = tmp_path / "quads"
    folder.mkdir()
    Shard.pack([build_trajectory(source, 1)]).save(folder / "shard_00000.npz")
    (folder / "meta.json").write_text(json.dumps({"source": {"operators": "modeller", "faces": "quads"}}))
    assert clone_config(folder, BOTH).price("quads", np.random.default_rng(0)) > 0.1
    with pytest.raises(ConfigError, match=r"env\.courses: none has faces=quads"):
        CloneTask(clone_config(folder)).stream[0]
