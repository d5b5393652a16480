"""Training of policies: environments, algorithms, cloning, resuming, and what is refused; all as small as it can be."""

import json
import zipfile
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import yaml
from sb3_contrib import MaskablePPO
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import SubprocVecEnv

from agents.registry import make_agent
from agents.rl.algorithms import MaskedDqn, make_model
from agents.rl.envs import N_SEEDS, Course, NativeVecEnv, Table, make_vec_env
from agents.rl.network import NEVER, MeshNet, observer_of
from agents.rl.player import Player
from agents.rl.policies import net_of, put_net
from agents.rl.weights import load_policy, save_policy
from autopoly_env.errors import AutoPolyError, ConfigError, RunError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import ActionCodec
from autopoly_env.score import ScoreWeights
from autopoly_env.simulator import Simulator
from tests.helpers.paths import ROOT
from training import rl_clone, train_rl
from training.networks.labelling import SourceConfig, build_trajectory
from training.networks.samples import LabelConfig, collate, stored
from training.networks.trainer import Place, train
from training.networks.trajectories import Shard, Trajectory
from training.options import read_config
from training.policies import export as rl_export
from training.policies.config import OptimConfig, TrainRlConfig
from training.policies.exam import HELD_OUT, Exam, exams_of, mean_final, play_all, sit_all
from training.rl_clone import CloneConfig, CloneTask, prepared, sample_of, turned

torch.set_num_threads(1)  # as tests run beside each other

NET = {"width": 8, "widths": [4, 4, 4], "n_rounds": 1}
ENV = {"obs_resolution": 32, "resolution": 32, "max_vertices": 16, "max_steps": 5}
ALGORITHMS = ("maskable_ppo", "ppo", "a2c", "dqn")
SMALL: dict[str, Any] = {
    "net": NET,
    "env": ENV,
    "ppo": {"n_steps": 32, "batch_size": 32, "n_epochs": 1},
    "a2c": {"n_steps": 8},
    "dqn": {"buffer_size": 300, "learning_starts": 40, "batch_size": 16, "gradient_steps": 1},
    "run": {"total_steps": 256, "n_envs": 4, "n_eval": 1, "eval_resolution": 32, "eval_every": 128, "save_every": 128},
}


def config(*overrides: str, **more: Any) -> TrainRlConfig:
    values = {**SMALL, **more}
    flat = [f"{section}.{key}={json.dumps(value)}" for section, keys in values.items() for key, value in keys.items()]
    return read_config(None, [*flat, *overrides], TrainRlConfig())


def written(folder: Path, *overrides: str) -> Path:
    """The small config as a file."""
    path = folder / "small.yaml"
    path.write_text(yaml.safe_dump(SMALL))
    return path


def rows(folder: Path, group: str) -> list[dict[str, float]]:
    lines = [json.loads(line) for line in (folder / "log.jsonl").read_text().splitlines()]
    return [line for line in lines if any(key.startswith(f"{group}/") for key in line)]


# --- environments ---


def table() -> Table:
    return Table(config().env.rules(), resolution=32)


def test_practice__is_the_environment_with_mask_and_price() -> None:
    env = table().make(Course("objects", w_sc=0.3))
    seen, info = env.reset(seed=3)
    assert env.observation_space.contains(seen)
    assert np.array_equal(seen["action_mask"], info["action_mask"]) and seen["price"].tolist() == [np.float32(0.3)]
    total, rewards = info["r_all"], 0.0
    over = False
    while not over:
        seen, reward, over, truncated, info = env.step(int(np.flatnonzero(seen["action_mask"])[-1]))
        assert not truncated  # the steps that are left are in the observation
        rewards += reward
    assert rewards == pytest.approx(0.1 * (info["r_all"] - total)) == pytest.approx(info["episode"]["r"])
    assert info["episode"]["l"] == 5 and int(info["target"].rpartition("_")[2]) < N_SEEDS


def test_native_environments__do_what_each_does_alone() -> None:
    many = make_vec_env(table(), [Course(), Course("objects", 0.3)], 4, "native", seed=5)
    alone = [table().make((Course(), Course("objects", 0.3))[k % 2]) for k in range(4)]
    seen = many.reset()
    starts = [env.reset(seed=5 + k)[0] for k, env in enumerate(alone)]
    rng = np.random.default_rng(0)
    for _ in range(8):
        for name, array in seen.items():
            assert np.array_equal(array, np.stack([one[name] for one in starts])), name
        actions = [int(rng.choice(np.flatnonzero(mask))) for mask in seen["action_mask"]]
        seen, rewards, dones, infos = many.step(np.array(actions))
        for k, env in enumerate(alone):
            starts[k], reward, over, _, _ = env.step(actions[k])
            assert rewards[k] == pytest.approx(reward) and dones[k] == over
            if over:
                assert np.array_equal(infos[k]["terminal_observation"]["vertices"], starts[k]["vertices"])
                starts[k], _ = env.reset()
    assert isinstance(many, NativeVecEnv) and many.seconds > 0.0


def test_processes__do_the_same_as_one() -> None:
    courses = [Course(difficulty=(1, 2))]
    native = make_vec_env(table(), courses, 2, "native", seed=1)
    workers = make_vec_env(table(), courses, 2, "subproc", seed=1)
    try:
        assert isinstance(workers, SubprocVecEnv)
        first, second = native.reset(), workers.reset()
        assert all(np.array_equal(first[name], second[name]) for name in first)
        for envs in (native, workers):
            envs.env_method("set_difficulty", 1)
        assert (
            np.stack(workers.env_method("action_masks")).tolist()
            == np.stack(native.env_method("action_masks")).tolist()
        )
        third, fourth = native.step(np.array([1, 0])), workers.step(np.array([1, 0]))
        assert np.allclose(third[1], fourth[1]) and third[2].tolist() == fourth[2].tolist() == [False, True]
    finally:
        workers.close()


def test_target__comes_as_often_as_it_is_to_be_played() -> None:
    env = Table(table().rules, resolution=32, n_plays=3).make(Course())
    starts = [env.reset(seed=2), *(env.reset() for _ in range(3))]
    targets = [info["target"] for _, info in starts]
    assert targets[0] == targets[1] == targets[2] != targets[3]
    assert all(np.array_equal(starts[0][0][name], starts[2][0][name]) for name in starts[0][0])
    assert env.reset(seed=2)[1]["target"] == targets[0] and env.reset(seed=3)[1]["target"] != targets[0]


def test_curriculum__draws_easy_constructions_first() -> None:
    env = table().make(Course(difficulty=(1, 5)))
    env.set_difficulty(1)
    env.reset(seed=0)
    assert env.unwrapped.targets.source.difficulty == (1, 1)
    env.set_difficulty(9)
    assert env.unwrapped.targets.source.difficulty == (1, 5)


# --- algorithms ---


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A short run of every algorithm."""
    folder = tmp_path_factory.mktemp("runs")
    for name in ALGORITHMS:
        train_rl.train_rl(config(f"algorithm={name}"), folder / name)
    return {name: folder / name for name in ALGORITHMS}


@pytest.mark.parametrize("name", ALGORITHMS)
def test_algorithm__trains_and_its_agent_plays(name: str, trained: dict[str, Path]) -> None:
    folder = trained[name]
    net, meta = load_policy(folder / "policy.safetensors")
    exams = rows(folder, "exam")
    assert meta.algorithm == name and [row["step"] for row in exams] == [128, 256]
    assert meta.metrics["final"] == max(row["exam/final"] for row in exams)
    silhouette = exams_of(config().env, 1, 32)[0].simulators[0].silhouette
    simulator = Simulator(silhouette, resolution=32, weights=ScoreWeights(w_sc=1.0))
    agent = make_agent(name.replace("_", "-"), weights=str(folder / "policy.safetensors"))
    assert agent.solve(simulator).score.total >= simulator.final_score(simulator.initial().mesh).total
    fresh = MeshNet(net.config, net.rules)
    torch.manual_seed(0)
    assert any(not torch.equal(a, b) for a, b in zip(net.parameters(), fresh.parameters(), strict=True))


@pytest.mark.parametrize("name", ALGORITHMS)
def test_algorithm__never_takes_an_illegal_action(name: str) -> None:
    settings = config(f"algorithm={name}", "dqn.exploration_final_eps=0.9")
    envs = make_vec_env(table(), [Course()], 4, "native", seed=0)
    taken: list[bool] = []

    def noted(actions: Any, step: Any = envs.step_async) -> None:
        masks = np.stack(envs.env_method("action_masks"))
        taken.extend(masks[np.arange(4), actions].tolist())
        step(actions)

    envs.step_async = noted  # type: ignore[method-assign]
    model = make_model(
        name, envs, settings.net, settings.env.rules(), lambda _: 1e-3, asdict(settings.options()), 0, "cpu"
    )
    model.learn(128)
    assert len(taken) == 128 and all(taken)
    seen = envs.reset()
    masks = np.stack(envs.env_method("action_masks"))
    for _ in range(10):
        given = {"action_masks": masks} if name == "maskable_ppo" else {}
        actions, _ = model.predict(seen, deterministic=False, **given)
        assert masks[np.arange(4), actions].all()


def test_dqn__hopes_for_legal_actions_only() -> None:
    settings = config("algorithm=dqn")
    envs = make_vec_env(table(), [Course()], 2, "native", seed=0)
    model: Any = make_model(
        "dqn", envs, settings.net, settings.env.rules(), lambda _: 1e-3, asdict(settings.dqn), 0, "cpu"
    )
    assert isinstance(model, MaskedDqn)
    seen = {name: torch.from_numpy(array) for name, array in envs.reset().items()}
    with torch.no_grad():
        q = model.q_net(seen)
    assert torch.equal(q > 0.5 * NEVER, seen["action_mask"] > 0)


@pytest.mark.parametrize("name", ALGORITHMS)
def test_network_of_a_policy__is_the_policy(name: str) -> None:
    settings = config(f"algorithm={name}")
    envs = make_vec_env(table(), [Course()], 2, "native", seed=0)
    model: Any = make_model(
        name, envs, settings.net, settings.env.rules(), lambda _: 1e-3, asdict(settings.options()), 0, "cpu"
    )
    net = MeshNet(settings.net, settings.env.rules())
    for parameter in net.parameters():
        torch.nn.init.normal_(parameter, std=0.3)
    put_net(model.policy, net)
    seen = {key: torch.from_numpy(array) for key, array in envs.reset().items()}
    with torch.no_grad():
        logits, value = net(seen)
        again, _ = net_of(model.policy)(seen)
        assert torch.equal(logits, again)
        if name == "dqn":
            legal = seen["action_mask"] > 0
            assert torch.allclose(model.q_net(seen)[legal], (logits + value[:, None])[legal], atol=1e-5)
        else:
            said = model.policy.get_distribution(seen).distribution.logits
            assert torch.allclose(said, logits.log_softmax(-1), atol=1e-4)
            assert torch.allclose(model.policy.predict_values(seen)[:, 0], value, atol=1e-5)


def test_log__says_where_the_time_went(
    trained: dict[str, Path], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(train_rl, "_LOG_EVERY", 100)
    train_rl.train_rl(config(), tmp_path)
    row = rows(tmp_path, "train")[-1]
    shares = [row[f"train/share_{part}"] for part in ("env", "inference", "update")]
    assert sum(shares) == pytest.approx(1.0) and min(shares) >= 0.0
    assert {"train/final_r_all", "train/loss", "train/lr", "train/steps_per_second", "train/r_sc"} <= {*row}


# --- stopping and going on ---


class _KilledError(Exception):
    pass


@pytest.mark.parametrize("name", ["maskable_ppo", "dqn"])
def test_killed_run__goes_on_to_its_end(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = config(f"algorithm={name}", "run.total_steps=384")
    step = NativeVecEnv.step_wait
    n_steps = 0

    def killed(envs: NativeVecEnv) -> Any:
        nonlocal n_steps
        n_steps += 1
        if n_steps > 80:
            raise _KilledError
        return step(envs)

    monkeypatch.setattr(NativeVecEnv, "step_wait", killed)
    with pytest.raises(_KilledError):
        train_rl.train_rl(settings, tmp_path)
    monkeypatch.setattr(NativeVecEnv, "step_wait", step)
    assert not list(tmp_path.glob("*.tmp"))
    end = train_rl.train_rl(settings, tmp_path)
    assert "goes on at step 256" in capsys.readouterr().out
    assert end.step >= 384
    steps = [row["step"] for row in rows(tmp_path, "exam")]
    assert steps == sorted(set(steps)) and steps[-1] == end.step
    once_more = train_rl.train_rl(settings, tmp_path)  # there is nothing left to do
    assert once_more.step == end.step


def test_run_of_other_settings__is_refused(trained: dict[str, Path]) -> None:
    with pytest.raises(RunError, match=r"another env\.max_steps; give another --out"):
        train_rl.train_rl(config("env.max_steps=4"), trained["maskable_ppo"])
    with pytest.raises(RunError, match="another algorithm"):
        train_rl.train_rl(config("algorithm=ppo"), trained["maskable_ppo"])


def test_half_a_checkpoint__is_refused(trained: dict[str, Path], tmp_path: Path) -> None:
    whole = (trained["ppo"] / "checkpoint.zip").read_bytes()
    (tmp_path / "checkpoint.zip").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(RunError, match=r"cannot read .*checkpoint\.zip"):
        train_rl.train_rl(config("algorithm=ppo"), tmp_path)


def test_checkpoint__is_a_zip_that_sb3_knows(trained: dict[str, Path]) -> None:
    model = MaskablePPO.load(trained["maskable_ppo"] / "checkpoint.zip", device="cpu")
    net, _ = load_policy(trained["maskable_ppo"] / "policy.safetensors")
    assert net_of(model.policy).config == net.config
    with zipfile.ZipFile(trained["maskable_ppo"] / "checkpoint.zip") as archive:
        assert json.loads(archive.read("autopoly.json"))["step"] == 256


# --- what to begin with ---


def test_init__takes_over_the_network(trained: dict[str, Path]) -> None:
    path = trained["ppo"] / "policy.safetensors"
    net = train_rl.initial_net(config(f"run.init={path}"), trust=False)
    assert all(torch.equal(a, b) for a, b in zip(net.parameters(), load_policy(path)[0].parameters(), strict=True))
    zipped = train_rl.initial_net(config(f"run.init={trained['dqn'] / 'checkpoint.zip'}"), trust=False)
    assert zipped.rules == net.rules


def test_run_from_a_policy__is_never_worse_than_it(trained: dict[str, Path], tmp_path: Path) -> None:
    path = trained["maskable_ppo"] / "policy.safetensors"
    settings = config(f"run.init={path}", "run.total_steps=128")
    standing = train_rl.train_rl(settings, tmp_path)
    given = mean_final(sit_all(exams_of(settings.env, 1, 32), load_policy(path)[0]))
    exams = rows(tmp_path, "exam")
    assert exams[0]["step"] == 0 and exams[0]["exam/final"] == pytest.approx(given) and len(exams) > 1
    assert standing.best == max(exam["exam/final"] for exam in exams)


@pytest.mark.parametrize("file", ["policy.safetensors", "checkpoint.zip"])
@pytest.mark.parametrize(
    ("override", "complaint"),
    [
        ("env.max_steps=4", "max_steps 5; this run: max_steps 4"),
        ("env.max_vertices=20", "max_vertices 16; this run: max_vertices 20"),
        ("env.obs_resolution=48", "obs_resolution 32; this run: obs_resolution 48"),
        ("env.operators=paper", "operators full; this run: operators paper"),
        ("net.width=12", "width=8.*this run.*width=12"),
    ],
)
def test_init_for_another_game__is_refused_with_both_named(
    file: str, override: str, complaint: str, trained: dict[str, Path]
) -> None:
    with pytest.raises(ConfigError, match=complaint):
        train_rl.initial_net(config(override, f"run.init={trained['maskable_ppo'] / file}"), trust=False)


def test_zip_from_elsewhere__is_refused_unless_trusted(trained: dict[str, Path], tmp_path: Path) -> None:
    model = MaskablePPO.load(trained["maskable_ppo"] / "checkpoint.zip", device="cpu")
    model.save(tmp_path / "theirs.zip")
    settings = config(f"run.init={tmp_path / 'theirs.zip'}")
    with pytest.raises(ConfigError, match=r"can run code .* give --trust"):
        train_rl.initial_net(settings, trust=False)
    trusted = train_rl.initial_net(settings, trust=True)
    ours = net_of(model.policy)
    assert all(torch.equal(a, b) for a, b in zip(trusted.parameters(), ours.parameters(), strict=True))
    other = PPO("MlpPolicy", "CartPole-v1", n_steps=8, batch_size=8, device="cpu")
    other.save(tmp_path / "theirs.zip")
    with pytest.raises(ConfigError, match="no policy of this project"):
        train_rl.initial_net(settings, trust=True)


# --- the command ---


def test_command__trains_and_exports(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(rl_export, "SHIPPED", tmp_path / "weights")
    monkeypatch.setattr("agents.rl.weights.SHIPPED", tmp_path / "weights")
    arguments = ["--config", str(written(tmp_path)), "--out", str(tmp_path / "run"), "run.total_steps=128", "--export"]
    assert train_rl.main(arguments) == 0
    assert "exported to" in capsys.readouterr().out
    assert make_agent("maskable-ppo").name == "maskable-ppo" and make_agent("rl-prior").name == "rl-prior"
    card = (tmp_path / "weights" / "maskable_ppo.md").read_text()
    assert "w_sc 0.3" in card and "`python -m training.train_rl " in card
    assert sum(file.stat().st_size for file in (tmp_path / "weights").iterdir()) < 5e6


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["algorithm=sarsa"], "algorithm"),
        (["ppo.n_stepz=3"], "unknown option 'n_stepz'"),
        (["ppo.batch_size=0"], "batch_size = 0: expected at least 2"),
        (["run.n_envs=1"], "1 environments for 2 courses"),
        (["env.operators=melt"], "operators 'melt' are unknown"),
        (["env.courses=[{targets: nowhere}]"], "nowhere"),
        (["run.init=nowhere.safetensors"], "no weights at nowhere"),
        (["run.init=nowhere.zip"], "cannot read nowhere.zip"),
        (["--config", "nowhere.yaml"], "cannot read nowhere.yaml"),
    ],
)
def test_command__says_in_one_line_what_is_wrong(
    arguments: list[str], complaint: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    base = [] if "--config" in arguments else ["--config", str(written(tmp_path))]
    assert train_rl.main([*base, *arguments, "--out", str(tmp_path / "run")]) in (1, 2)
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and complaint in lines[0]


@pytest.mark.parametrize("name", [*ALGORITHMS, "clone"])
def test_shipped_config__can_be_read_and_begins_with_its_command(name: str) -> None:
    path = ROOT / "configs" / "train" / f"{name}.yaml"
    script, default = ("rl_clone", CloneConfig()) if name == "clone" else ("train_rl", TrainRlConfig())
    assert path.read_text().startswith(f"# python -m training.{script} --config configs/train/{name}.yaml: ")
    read = read_config(path, [], default)  # type: ignore[type-var]
    if isinstance(read, TrainRlConfig):
        assert read.algorithm == name


# --- examination ---


def test_learning_rate__rises_and_falls() -> None:
    optim = OptimConfig(lr=1.0, last=0.1, warmup=0.1)
    assert [round(optim.lr_at(done), 3) for done in (0.0, 0.05, 0.1, 0.55, 1.0)] == [0.02, 0.5, 1.0, 0.55, 0.1]


def test_exam__is_of_held_out_targets_and_plays_as_the_agent_does(trained: dict[str, Path]) -> None:
    path = trained["maskable_ppo"] / "policy.safetensors"
    exams = exams_of(config().env, 2, 32)
    assert [exam.name for exam in exams] == ["construction", "objects"]
    assert int(exams[0].simulators[1].silhouette.name.rpartition("_")[2]) == HELD_OUT + 1
    player = Player(load_policy(path)[0])
    for path_of_states, simulator in zip(play_all(player, exams[0].simulators), exams[0].simulators, strict=True):
        state = simulator.initial()
        for following in path_of_states[1:]:
            ranked = player.ranked(simulator, state)
            assert following.action in ranked
            state = following
    assert isinstance(exams[0], Exam)


# --- cloning ---

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
        "optim.n_steps=40",
        "optim.batch_size=16",
        "optim.warmup=2",
        "optim.lr=0.01",
        "run.n_workers=0",
        "run.eval_every=20",
        "n_exam=1",
    ]
    return read_config(None, [*given, *overrides], CloneConfig())


def test_sample__has_the_gains_at_its_price(trajectory: Trajectory, shards: Path) -> None:
    settings = clone_config(shards)
    one = prepared(trajectory, settings.env.rules())[0]
    for w_sc in (0.3, 1.0):
        sample = sample_of(one, w_sc, 0, settings)
        gains = LabelConfig(w_sc=w_sc).gains(one.state)
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
    one = prepared(trajectory, settings.env.rules())[-1]
    sample = sample_of(one, 1.0, way, settings)
    n_vertices, n_edges, _, n_corners = one.seen["counts"].tolist()
    points = sample["vertices"].reshape(-1, 2)[:n_vertices].astype(float)
    corners = sample["faces"].reshape(-1, 2)[:n_corners]
    faces = [tuple(corners[corners[:, 0] == f, 1].tolist()) for f in range(int(one.seen["counts"][2]))]
    mesh = PolyMesh.from_faces(points, faces)  # which refuses areas that are not positive
    seen = observer_of(settings.env.rules()).observe(mesh, sample["target"], 5)
    assert np.array_equal(seen["edges"], sample["edges"]) and np.array_equal(seen["faces"], sample["faces"])
    assert np.abs(seen["rendering"].astype(int) - sample["rendering"]).max() <= 1
    rules = settings.env.rules()
    assert np.array_equal(ActionCodec(rules.operators, rules.max_vertices).legal_mask(mesh), sample["action_mask"] > 0)
    assert set(turned(one.seen, way)) == set(one.seen) and n_edges > 0


def test_clone__learns_goes_on_and_can_be_begun_with(shards: Path, tmp_path: Path) -> None:
    task = CloneTask(clone_config(shards))
    with torch.no_grad():
        before = task.measure(torch.device("cpu"))
    train(task, task.config.optim, task.config.run, {"any": 1}, tmp_path, Place())
    with torch.no_grad():
        after = task.measure(torch.device("cpu"))
    assert after["choice"] < 0.8 * before["choice"] and after["value"] < before["value"]
    assert after["gain_share"] > before["gain_share"]
    path = rl_clone.finish_clone(task, tmp_path)
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
    net = MeshNet(settings.net, settings.env.rules())
    again, meta = load_policy(save_policy(tmp_path / "p.safetensors", net, "clone", {"a": 1}, {"b": 2.0}))
    assert again.rules == net.rules and meta.training == {"a": 1} and meta.metrics == {"b": 2.0}
    assert issubclass(ConfigError, AutoPolyError) and replace(settings, algorithm="ppo").options() == settings.ppo
