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
from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import torch
import typer
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.utils import set_random_seed
from stable_baselines3.common.vec_env import VecEnv

from agents.commands.progress import progress_bar
from agents.commands.pulse import Pulse
from agents.rl.algorithms import load_checkpoint, make_model, net_of_zip
from agents.rl.envs import EnvFactory, make_vec_env
from agents.rl.growing import grown
from agents.rl.network import MeshNet
from agents.rl.policies import put_net
from training.networks.command import ConfigFile, Export, Overrides, ShowConfig, new_app, print_config, run_training
from training.options import read_config
from training.policies.config import RlRunConfig, TrainRlConfig
from training.policies.export import export_policy
from training.policies.run_state import LearningRate, RunState, state_in
from training.policies.session import Session
from training.policies.starting import begun_with


def train_rl(config: TrainRlConfig, folder: Path, trust: bool = False) -> RunState:
    """Train to the end, or go on with what `folder` holds.

    Raises RunError if the folder belongs to a run with other settings, ConfigError for settings and weights that do
    not fit together.
    """
    run = config.run
    if run.n_threads:
        torch.set_num_threads(run.n_threads)
    state = state_in(folder, config)
    lr, envs = LearningRate(config.optim), _environments(config, state.step)
    try:
        model = make_model(
            config.algorithm,
            envs,
            config.net,
            config.env.spec(),
            lr,
            asdict(config.options()),
            run.seed,
            run.device,
        )
        model.set_logger(Logger(None, []))
        if state.step:
            load_checkpoint(folder / "checkpoint.zip", model, asdict(state))
            set_random_seed(_seed(run, state.step))
            print(f"{folder}: goes on at step {state.step}", flush=True)
        elif run.init:
            put_net(model.policy, initial_net(config, trust))
        session = Session(config, folder, state, lr)
        if not session.is_over:
            print(_banner(config, folder, state, str(model.device)), flush=True)
            with Pulse(session.stands):
                with progress_bar(session.last_step, "steps", n_done=state.step, takes_prints=True) as session.bar:
                    model.learn(run.total_steps - state.step, session, log_interval=None, reset_num_timesteps=False)  # type: ignore[arg-type]
                session.end()
    finally:
        envs.close()
    return state


def _banner(config: TrainRlConfig, folder: Path, state: RunState, device: str) -> str:
    """What is about to happen."""
    run = config.run
    limit = f", {run.minutes:g} min at most with all exams" if run.minutes else ""
    n_steps, asked = config.last_step(state.step) - state.step, run.total_steps - state.step
    whole = f" ({asked} rounded up to whole rollouts of {config.rollout})" if n_steps > asked else ""
    first = "before the first step, then " if run.init and not state.step else ""
    return (
        f"{config.algorithm} in {folder}: {run.n_envs} environments ({run.envs}) on {device}, "
        f"{n_steps} steps{whole}{limit}\n"
        f"exams: {first}every {run.eval_every} steps, on {run.n_eval} unseen targets of each of "
        f"{len(config.env.courses)} tasks; steps a second and when the next exam comes are said after the first update"
    )


def initial_net(config: TrainRlConfig, trust: bool) -> MeshNet:
    """The network that `run.init` names. Raises ConfigError, which names both settings, if it is for another game."""
    path, spec = Path(config.run.init), config.env.spec()
    if path.suffix == ".zip":
        return grown(net_of_zip(path, config.net, spec, trust), spec)
    return begun_with(path, config.net, spec)


def _environments(config: TrainRlConfig, step: int) -> VecEnv:
    env = config.env
    factory = EnvFactory(env.spec(), env.resolution, env.reward_scale, env.illegal_penalty, env.n_plays)
    return make_vec_env(factory, env.tasks(), config.run.n_envs, config.run.envs, _seed(config.run, step))


def _seed(run: RlRunConfig, step: int) -> int:
    """Of the environments and of sampling, from a step on."""
    return int(np.random.SeedSequence((run.seed, step)).generate_state(1)[0] >> 1)


def told_of(state: RunState, path: Path) -> str:
    """What came out, beside what a policy is given to begin with."""
    result = f"{path}: the policy of step {state.best_step}, mean r_all {state.best:.2f}"
    if not math.isfinite(state.rectangle):
        return result
    if state.has_learnt:
        return f"{result} (the untouched rectangle has {state.rectangle:.2f}): the best so far"
    return f"{result}, is no better than the untouched rectangle ({state.rectangle:.2f}): it needs more steps"


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

app = new_app()


@app.command(help=HELP)
def main_command(
    overrides: Overrides = None,
    config: ConfigFile = None,
    out: Annotated[Path | None, typer.Option(help="The run's folder.", show_default="runs/ and the algorithm")] = None,
    minutes: Annotated[float | None, typer.Option(min=0.0, help="After which it ends, as run.minutes.")] = None,
    trust: Annotated[bool, typer.Option("--trust", help="Load a zip from elsewhere, though it can run code.")] = False,
    export: Export = False,
    show_config: ShowConfig = False,
) -> int:
    settings = read_config(config, overrides or [], TrainRlConfig())
    if show_config:
        return print_config(settings)
    if minutes is not None:
        settings = replace(settings, run=replace(settings.run, minutes=minutes))
    folder = out or Path("runs") / settings.algorithm
    state = train_rl(settings, folder, trust)
    path = folder / "policy.safetensors"
    print(told_of(state, path))
    if export:
        print(f"exported to {export_policy(path, settings.algorithm, sys.argv[1:])}")
    return 0


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns the exit code."""
    return run_training(app, arguments, "training.train_rl")


if __name__ == "__main__":
    sys.exit(main())
