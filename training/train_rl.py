"""Train a policy with an algorithm of Stable-Baselines3: PPO, A2C, DQN, or sb3-contrib's MaskablePPO (docs/rl.md).

    python -m training.train_rl --config configs/train/maskable_ppo.yaml                              # from nothing
    python -m training.train_rl --config configs/train/maskable_ppo.yaml run.init=runs/clone/policy.safetensors
    python -m training.train_rl --config configs/train/ppo.yaml --minutes 30 run.seed=1 --out runs/ppo_1
    python -m training.train_rl --config configs/train/maskable_ppo.yaml run.envs=subproc run.n_envs=64   # many cores

The same command goes on with a run that was stopped. Overrides: section.key=value. The run's folder gets log.jsonl,
checkpoint.zip, and the best policy so far, by r_all of unseen targets: policy.safetensors; --export makes it the one
that comes with the project.
"""

import math
import sys
import time
from collections import deque
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import torch
import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.utils import set_random_seed
from stable_baselines3.common.vec_env import VecEnv

from agents.commands.running import GOES_ON, run_command
from agents.rl.algorithms import load_checkpoint, make_model, net_of_zip, read_note, save_checkpoint
from agents.rl.envs import Course, Table, make_vec_env
from agents.rl.network import MeshNet
from agents.rl.policies import net_of, put_net
from agents.rl.weights import load_policy, read_policy_meta, save_policy
from autopoly_env.errors import ConfigError, RunError
from training.options import check_same_run, plain, read_config
from training.policies.config import HARMLESS, RunConfig, TrainRlConfig
from training.policies.exam import exams_of, mean_final, sit_all, told
from training.policies.export import export_policy
from training.run_log import RunLog

_LOG_EVERY = 5_000  # steps
_N_RECENT = 200  # episodes that the log's means are over


@dataclass
class Standing:
    """Where a run stands; a checkpoint notes it."""

    step: int = 0
    seconds: float = 0.0
    best: float = -math.inf  # mean r_all in the best exam
    best_step: int = 0
    n_updates: int = 0


@dataclass
class Annealing:
    """The learning rate, by the share of the training that is done; SB3 asks it."""

    config: TrainRlConfig
    done: float = 0.0  # 0 to 1

    def __call__(self, _remaining: float) -> float:
        return self.config.optim.lr_at(self.done)


@dataclass
class Clock:
    """Seconds spent on each kind of work since the last line of the log."""

    rollout: float = 0.0
    update: float = 0.0
    env: float = 0.0
    steps: int = 0

    def shares(self) -> dict[str, float]:
        """Steps a second, and shares of the time: environments, the policy's own inference, updates."""
        whole = max(self.rollout + self.update, 1e-9)
        return {
            "steps_per_second": self.steps / whole,
            "share_env": self.env / whole,
            "share_inference": (self.rollout - self.env) / whole,
            "share_update": self.update / whole,
        }


class Session(BaseCallback):
    """Everything that happens between rollouts: log, exams, checkpoints, the end."""

    def __init__(self, config: TrainRlConfig, folder: Path, standing: Standing, lr: Annealing) -> None:
        super().__init__()
        self.config, self.folder, self.standing, self.lr = config, folder, standing, lr
        self.exams = exams_of(config.env, config.run.n_eval, config.run.eval_resolution)
        self.log = RunLog(folder, standing.step)
        self._clock, self._mark, self._recent = Clock(), time.perf_counter(), deque[dict[str, Any]](maxlen=_N_RECENT)
        self._env_seconds = 0.0
        self._logged = self._saved = self._examined = standing.step
        self._most = 0
        self.bar: Any = None

    @property
    def is_over(self) -> bool:
        """Whether the budget of steps or minutes is spent."""
        return self._done() >= 1.0

    def _done(self) -> float:
        run = self.config.run
        timed = self.standing.seconds / (60.0 * run.minutes) if run.minutes else 0.0
        return min(1.0, max(self.standing.step / run.total_steps, timed))

    def _on_training_start(self) -> None:
        if self.config.run.init and not math.isfinite(self.standing.best):
            self.examine()  # what it begins with is the best so far
        self._mark = time.perf_counter()

    def _on_rollout_start(self) -> None:
        """After an update, or at the very beginning."""
        self._count(update=self._lap())
        standing, run = self.standing, self.config.run
        standing.step, standing.n_updates = self.num_timesteps, int(getattr(self.model, "_n_updates", 0))
        self.lr.done = self._done()
        self._set_difficulty()
        if standing.step - self._logged >= _LOG_EVERY:
            self._write()
        if standing.step - self._examined >= run.eval_every:
            self.examine()
        if standing.step - self._saved >= run.save_every or (self.is_over and standing.step > self._saved):
            self.save()
        self._env_seconds = self._seconds_in_envs()
        self._mark = time.perf_counter()

    def _on_step(self) -> bool:
        self._recent.extend(info for info in self.locals["infos"] if "episode" in info)
        if self.bar is not None:
            self.bar(self.num_timesteps)
        return not self.is_over

    def _on_rollout_end(self) -> None:
        spent = self._lap()
        self._count(rollout=spent, env=self._seconds_in_envs() - self._env_seconds)
        self._clock.steps += self.num_timesteps - self.standing.step
        self._check()

    def _lap(self) -> float:
        now = time.perf_counter()
        spent, self._mark = now - self._mark, now
        return spent

    def _count(self, rollout: float = 0.0, update: float = 0.0, env: float = 0.0) -> None:
        self._clock.rollout += rollout
        self._clock.update += update
        self._clock.env += env
        self.standing.seconds += rollout + update

    def _seconds_in_envs(self) -> float:
        return float(getattr(self.training_env, "seconds", math.nan))

    def _set_difficulty(self) -> None:
        """The curriculum's, where it has changed."""
        rule = self.config.curriculum
        if not rule.enabled:
            return
        highest = max(course.difficulty[1] for course in self.config.env.courses)
        most = 1 + round((highest - 1) * min(1.0, self._done() / rule.until))
        if most != self._most:
            self._most = most
            self.training_env.env_method("set_difficulty", most)

    def _check(self) -> None:
        """Raise RunError if a weight is no number any more."""
        if not all(bool(torch.isfinite(p).all()) for p in self.model.policy.parameters()):
            raise RunError(
                f"a weight is not a number at step {self.num_timesteps}; the same command goes on from the last "
                "checkpoint: give a lower optim.lr"
            )

    def _write(self) -> None:
        """A line of the log."""
        self._logged = self.standing.step
        values = {
            k: float(v) for k, v in self.model.logger.name_to_value.items() if isinstance(v, int | float | np.number)
        }
        self.model.logger.name_to_value.clear()
        values = {name.removeprefix("train/"): value for name, value in values.items() if math.isfinite(value)}
        values |= {"lr": self.config.optim.lr_at(self.lr.done), "minutes": self.standing.seconds / 60.0}
        values |= {name: value for name, value in self._clock.shares().items() if math.isfinite(value)}
        if self._recent:
            for name, key in (("final_r_all", "r_all"), ("r_sm", "r_sm"), ("r_sc", "r_sc")):
                values[name] = float(np.mean([info[key] for info in self._recent]))
            values["return"] = float(np.mean([info["episode"]["r"] for info in self._recent]))
            values["length"] = float(np.mean([info["episode"]["l"] for info in self._recent]))
        self.log.write(self.standing.step, "train", values)
        self._clock = Clock()

    def examine(self) -> None:
        """Let the policy build the unseen targets; keep it if no earlier one was better."""
        standing, net = self.standing, net_of(self.model.policy)
        self._examined = standing.step
        marks = sit_all(self.exams, net)
        mean = mean_final(marks)
        values = {f"{course}_{name}": value for course, one in marks.items() for name, value in asdict(one).items()}
        self.log.write(standing.step, "exam", {"final": mean, "minutes": standing.seconds / 60.0, **values})
        if mean > standing.best:
            standing.best, standing.best_step = mean, standing.step
            metrics = {"step": standing.step, "final": mean, **values}
            save_policy(self.folder / "policy.safetensors", net, self.config.algorithm, plain(self.config), metrics)
        print(f"step {standing.step}, {standing.seconds / 60.0:.1f} min: {told(marks)}", flush=True)

    def save(self) -> None:
        """Write the checkpoint."""
        self._saved = self.standing.step
        rules = plain(self.config.env.rules())
        note = {
            **asdict(self.standing),
            "algorithm": self.config.algorithm,
            "rules": rules,
            "net": plain(self.config.net),
            "settings": plain(self.config),
        }
        note["best"] = self.standing.best if math.isfinite(self.standing.best) else None
        save_checkpoint(self.folder / "checkpoint.zip", self.model, note)

    def end(self) -> None:
        """What is due when the training is over."""
        if self._examined < self.standing.step or not math.isfinite(self.standing.best):
            self.examine()
        self.save()


def train_rl(config: TrainRlConfig, folder: Path, trust: bool = False) -> Standing:
    """Train to the end, or go on with what `folder` holds.

    Raises RunError if the folder belongs to a run with other settings, ConfigError for settings and weights that do
    not fit together.
    """
    run = config.run
    if run.n_threads:
        torch.set_num_threads(run.n_threads)
    standing, lr = _standing(config, folder), Annealing(config)
    envs = _environments(config, standing.step)
    try:
        model = make_model(
            config.algorithm,
            envs,
            config.net,
            config.env.rules(),
            lr,
            asdict(config.options()),
            run.seed,
            run.device,
        )
        model.set_logger(Logger(None, []))
        if standing.step:
            load_checkpoint(folder / "checkpoint.zip", model, asdict(standing))
            set_random_seed(_seed(run, standing.step))
            print(f"{folder}: goes on at step {standing.step}", flush=True)
        elif run.init:
            put_net(model.policy, initial_net(config, trust))
        session = Session(config, folder, standing, lr)
        if not session.is_over:
            with _Bar(run, standing) as session.bar:
                model.learn(run.total_steps - standing.step, session, log_interval=None, reset_num_timesteps=False)  # type: ignore[arg-type]
            session.standing.step = model.num_timesteps
            session.end()
    finally:
        envs.close()
    return standing


def initial_net(config: TrainRlConfig, trust: bool) -> MeshNet:
    """The network that `run.init` names. Raises ConfigError, which names both settings, if it is for another game."""
    path, rules = Path(config.run.init), config.env.rules()
    if path.suffix == ".zip":
        net = MeshNet(config.net, rules)
        net_of_zip(path, net, trust)
        return net
    net, _ = load_policy(path)
    rules.check_same(net.rules, "this run", str(path))
    if net.config != config.net:
        raise ConfigError(f"{path}: a network {net.config}; this run: {config.net}: make them agree")
    return net


def _environments(config: TrainRlConfig, step: int) -> VecEnv:
    env = config.env
    table = Table(env.rules(), env.resolution, env.reward_scale, env.illegal_penalty, env.n_plays)
    courses = [Course(**asdict(course)) for course in env.courses]
    return make_vec_env(table, courses, config.run.n_envs, config.run.envs, _seed(config.run, step))


def _seed(run: RunConfig, step: int) -> int:
    """Of the environments and of sampling, from a step on."""
    return int(np.random.SeedSequence((run.seed, step)).generate_state(1)[0] >> 1)


def _standing(config: TrainRlConfig, folder: Path) -> Standing:
    """Where the run in the folder stands. Raises RunError if it is another one."""
    path = folder / "checkpoint.zip"
    if not path.exists():
        return Standing()
    note = read_note(path)
    if note is None:
        raise RunError(f"{path} was not written by this project's training; give another --out")
    check_same_run(folder, note["settings"], plain(config), HARMLESS)
    best = -math.inf if note["best"] is None else float(note["best"])
    best_step = int(note["best_step"])
    try:  # a policy may have been kept after the checkpoint
        kept = read_policy_meta(folder / "policy.safetensors").metrics
        best, best_step = float(kept["final"]), int(kept["step"])
    except (ConfigError, KeyError, TypeError, ValueError):
        pass
    return Standing(int(note["step"]), float(note["seconds"]), best, best_step, int(note["n_updates"]))


class _Bar:
    """A progress bar where there is a terminal."""

    def __init__(self, run: RunConfig, standing: Standing) -> None:
        console = Console(stderr=True)
        columns = (TextColumn("steps"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
        self._bar = Progress(*columns, console=console, disable=not console.is_terminal)
        self._task = self._bar.add_task("steps", total=run.total_steps, completed=standing.step)

    def __enter__(self) -> "_Bar":
        self._bar.start()
        return self

    def __call__(self, step: int) -> None:
        self._bar.update(self._task, completed=step)

    def __exit__(self, *_error: object) -> None:
        self._bar.stop()


HELP = """Train a policy with an algorithm of Stable-Baselines3.

\b
Examples:
  python -m training.train_rl --config configs/train/maskable_ppo.yaml
  python -m training.train_rl --config configs/train/maskable_ppo.yaml run.init=runs/clone/policy.safetensors
  python -m training.train_rl --config configs/train/ppo.yaml --minutes 30 run.seed=1 --out runs/ppo_1

The same command goes on with a run that was stopped. At the end the folder has policy.safetensors, the best policy by
r_all of unseen targets. A zip of SB3 as run.init is refused unless this training wrote it or --trust is given: to read
it can run code that is in it. See docs/rl.md.
"""

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command(help=HELP)
def main_command(
    overrides: Annotated[list[str] | None, typer.Argument(metavar="SECTION.KEY=VALUE")] = None,
    config: Annotated[Path | None, typer.Option(help="A YAML file; what it leaves out is at its default.")] = None,
    out: Annotated[Path | None, typer.Option(help="The run's folder.", show_default="runs/ and the algorithm")] = None,
    minutes: Annotated[float | None, typer.Option(min=0.0, help="After which it ends, as run.minutes.")] = None,
    trust: Annotated[bool, typer.Option("--trust", help="Load a zip from elsewhere, though it can run code.")] = False,
    export: Annotated[bool, typer.Option("--export", help="Make the result the project's own weights.")] = False,
) -> int:
    settings = read_config(config, overrides or [], TrainRlConfig())
    if minutes is not None:
        settings = replace(settings, run=replace(settings.run, minutes=minutes))
    folder = out or Path("runs") / settings.algorithm
    standing = train_rl(settings, folder, trust)
    path = folder / "policy.safetensors"
    print(f"{path}: the policy of step {standing.best_step}, mean r_all {standing.best:.2f}")
    if export:
        print(f"exported to {export_policy(path, settings.algorithm, sys.argv[1:])}")
    return 0


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns the exit code."""
    return run_command(app, arguments, "python -m training.train_rl", stopped=GOES_ON)


if __name__ == "__main__":
    sys.exit(main())
