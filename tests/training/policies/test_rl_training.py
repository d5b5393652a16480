"""Training of policies: every algorithm, runs that go on, what they begin with, exams, the command; all very small."""

import json
import zipfile
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
import torch
from sb3_contrib import MaskablePPO
from stable_baselines3 import PPO

from agents.registry import make_agent
from agents.rl.config import Rules, SpaceSpec
from agents.rl.envs import NativeVecEnv
from agents.rl.network import MeshNet
from agents.rl.player import Player
from agents.rl.policies import net_of
from agents.rl.weights import load_policy
from autopoly_env.errors import ConfigError, RunError
from autopoly_env.mesh import check_faces
from autopoly_env.operators import preset
from autopoly_env.score import ScoreWeights
from autopoly_env.simulator import Simulator
from autopoly_env.targets import HELD_OUT
from tests.helpers.paths import ROOT
from tests.helpers.policies import ALGORITHMS, config, rows, written
from training import train_rl
from training.options import read_config
from training.policies import export as rl_export
from training.policies import training_log
from training.policies.clone_samples import CloneConfig
from training.policies.config import LearningRateConfig, TrainRlConfig
from training.policies.evaluation import Evaluation, evaluate, evaluations_of, mean_final, play_all
from training.policies.run_state import LearningRate, RunState
from training.policies.session import Session

torch.set_num_threads(1)  # as tests run beside each other

pytestmark = pytest.mark.slow  # policies are trained


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
    exams = rows(folder, "eval")
    assert meta.algorithm == name and [row["step"] for row in exams] == [128, 256]
    assert meta.metrics["final"] == max(row["eval/final"] for row in exams)
    silhouette = evaluations_of(config().env, 1, 32)[0].simulators[0].silhouette
    simulator = Simulator(silhouette, resolution=32, weights=ScoreWeights(w_sc=1.0))
    agent = make_agent(name.replace("_", "-"), weights=str(folder / "policy.safetensors"))
    assert agent.solve(simulator).score.total >= simulator.final_score(simulator.initial().mesh).total
    fresh = MeshNet(net.config, net.spec)
    torch.manual_seed(0)
    assert any(not torch.equal(a, b) for a, b in zip(net.parameters(), fresh.parameters(), strict=True))


def test_log__says_where_the_time_went(
    trained: dict[str, Path], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(training_log, "LOG_EVERY", 100)
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
    steps = [row["step"] for row in rows(tmp_path, "eval")]
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
    assert zipped.spec == net.spec


def test_zip_of_an_older_version__can_be_begun_with_and_loaded(trained: dict[str, Path], tmp_path: Path) -> None:
    """The spaces were "rules" then, in the note and in what is pickled."""
    path = tmp_path / "checkpoint.zip"
    with zipfile.ZipFile(trained["ppo"] / "checkpoint.zip") as new, zipfile.ZipFile(path, "w") as old:
        for name in new.namelist():
            content = new.read(name)
            if name == "autopoly.json":
                note = json.loads(content)
                content = json.dumps({**note, "rules": note.pop("spec")}).encode()
            old.writestr(name, content)
    net = train_rl.initial_net(config(f"run.init={path}"), trust=False)
    model = PPO.load(trained["ppo"] / "checkpoint.zip", device="cpu")
    model.policy_kwargs["rules"] = Rules(**asdict(model.policy_kwargs.pop("spec")))
    model.save(path)
    again = PPO.load(path, device="cpu")
    spec = SpaceSpec(max_vertices=16, obs_resolution=32, max_steps=5, faces=("any",), w_sc=(0.3, 1.0))
    assert net.spec == net_of(again.policy).spec == spec
    zipped = train_rl.initial_net(config(f"run.init={path}"), trust=True)
    assert all(torch.equal(a, b) for a, b in zip(net.parameters(), zipped.parameters(), strict=True))


def test_run_from_a_policy__is_never_worse_than_it(trained: dict[str, Path], tmp_path: Path) -> None:
    path = trained["maskable_ppo"] / "policy.safetensors"
    settings = config(f"run.init={path}", "run.total_steps=128")
    state = train_rl.train_rl(settings, tmp_path)
    given = mean_final(evaluate(evaluations_of(settings.env, 1, 32), load_policy(path)[0]))
    exams = rows(tmp_path, "eval")
    assert exams[0]["step"] == 0 and exams[0]["eval/final"] == pytest.approx(given) and len(exams) > 1
    assert state.best == max(exam["eval/final"] for exam in exams)


@pytest.mark.parametrize(("minutes", "is_over"), [(0.349, True), (0.351, False)])
def test_minutes__have_room_for_the_first_exam(minutes: float, is_over: bool, tmp_path: Path) -> None:
    settings = config(
        f"run.minutes={minutes}", "run.eval_resolution=64", "run.n_eval=3"
    )  # 2 * 3 episodes, 5 steps each
    state = RunState()
    session = Session(settings, tmp_path, state, LearningRate(settings.optim))
    session.num_timesteps, state.seconds = 100, 100 * 0.13125
    # 13.125 seconds are gone, 0.13125 a step; an exam is 60 steps, at twice the resolution: 7.875 seconds
    assert session.is_over == is_over


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
    said = capsys.readouterr().out
    assert "exported to" in said and " on auto, " not in said
    assert make_agent("maskable-ppo").name == "maskable-ppo" and make_agent("rl-prior").name == "rl-prior"
    card = (tmp_path / "weights" / "maskable_ppo.md").read_text()
    assert "w_sc 0.3" in card and "`python -m training.train_rl " in card
    assert sum(file.stat().st_size for file in (tmp_path / "weights").iterdir()) < 5e6


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["algorithm=sarsa"], "algorithm"),
        (["ppo.n_stepz=3"], "unknown option 'n_stepz'"),
        (["ppo.batch_size=0"], "error: override 'ppo.batch_size=0': ppo.batch_size=0: expected a number of at least 2"),
        (["run.minutes=-1"], "run.minutes=-1.0: expected a number of at least 0"),
        (["ppo.gamma=2", "run.seed=3"], "error: override 'ppo.gamma=2': ppo.gamma=2.0: expected a discount, 0 to 1"),
        (["env.obs_resolution=0"], "env.obs_resolution"),
        (["run.n_envs=1"], "1 environments for 2 tasks"),
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


@pytest.mark.parametrize("name", [*ALGORITHMS, "both", "clone", "clone_both"])
def test_shipped_config__can_be_read_and_begins_with_its_command(name: str) -> None:
    path = ROOT / "configs" / "train" / f"{name}.yaml"
    script, default = ("rl_clone", CloneConfig()) if "clone" in name else ("train_rl", TrainRlConfig())
    assert path.read_text().startswith(f"# python -m training.{script} --config configs/train/{name}.yaml: ")
    read = read_config(path, [], default)  # type: ignore[type-var]
    if isinstance(read, TrainRlConfig):
        assert read.algorithm == ("maskable_ppo" if name == "both" else name)


# --- examination ---


def test_learning_rate__rises_and_falls() -> None:
    optim = LearningRateConfig(lr=1.0, last=0.1, warmup=0.1)
    assert [round(optim.lr_at(done), 3) for done in (0.0, 0.05, 0.1, 0.55, 1.0)] == [0.02, 0.5, 1.0, 0.55, 0.1]


def test_evaluation__is_of_held_out_targets_and_plays_as_the_agent_does(trained: dict[str, Path]) -> None:
    path = trained["maskable_ppo"] / "policy.safetensors"
    exams = evaluations_of(config().env, 2, 32)
    assert [exam.name for exam in exams] == ["construction", "objects"]
    assert int(exams[0].simulators[1].silhouette.name.rpartition("_")[2]) == HELD_OUT[1]
    player = Player(load_policy(path)[0])
    for path_of_states, simulator in zip(play_all(player, exams[0].simulators), exams[0].simulators, strict=True):
        state = simulator.initial()
        for following in path_of_states[1:]:
            ranked = player.ranked(simulator, state)
            assert following.action in ranked
            state = following
    assert isinstance(exams[0], Evaluation)


def test_exam_of_a_course__is_under_its_rule_and_at_its_prices() -> None:
    course = '{"targets": "objects", "w_sc": [0.1, 1.6], "faces": "quads", "policy_operators": "modeller"}'
    env = config(f'env.courses=[{course}, {{"targets": "objects", "w_sc": 0.3}}]').env
    quads, paper = evaluations_of(env, 2, 32)
    assert [simulator.weights.w_sc for simulator in quads.simulators] == pytest.approx([0.2, 0.8])
    for simulator in quads.simulators:
        assert simulator.faces == "quads" and set(simulator.operators) == {o.name for o in preset("modeller")}
    assert {(simulator.faces, simulator.weights.w_sc, simulator.operators) for simulator in paper.simulators} == {
        ("any", 0.3, tuple(o.name for o in preset("full")))
    }
    assert env.spec().operators[:7] == tuple(o.name for o in preset("full")) and len(env.spec().operators) == 12
    net = MeshNet(config().net, env.spec())
    for episode in play_all(Player(net), quads.simulators):
        for state in episode:
            check_faces(state.mesh, "quads", "the mesh")
