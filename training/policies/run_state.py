"""Where a training run stands, how that is read back from its folder, and the learning rate that hangs on it."""

import math
from dataclasses import dataclass
from pathlib import Path

from agents.rl.algorithms import read_note
from agents.rl.weights import read_policy_meta
from autopoly_env.errors import ConfigError, RunError
from training.options import check_same_run, claim_run, plain
from training.policies.config import HARMLESS, LearningRateConfig, RlRunConfig, TrainRlConfig


@dataclass
class RunState:
    """Where a run stands; a checkpoint notes it."""

    step: int = 0
    seconds: float = 0.0
    best: float = -math.inf  # mean r_all in the best evaluation
    best_step: int = 0
    n_updates: int = 0
    rectangle: float = -math.inf  # mean r_all, in that evaluation, of what the policy is given to begin with

    @property
    def has_learnt(self) -> bool:
        """Whether what the best policy makes is worth more than the untouched rectangle."""
        return self.best > self.rectangle

    def share_done(self, run: RlRunConfig) -> float:
        """The share of the budget of steps or minutes that is spent, whichever is more, 0 to 1."""
        timed = self.seconds / (60.0 * run.minutes) if run.minutes else 0.0
        return min(1.0, max(self.step / run.total_steps, timed))


def state_in(folder: Path, config: TrainRlConfig) -> RunState:
    """Where the run in a folder stands. Raises RunError if it is another one."""
    path = folder / "checkpoint.zip"
    if not path.exists():
        claim_run(folder, plain(config), HARMLESS)
        return RunState()
    note = read_note(path)
    if note is None:
        raise RunError(f"{path} was not written by this project's training; give another --out")
    check_same_run(folder, note["settings"], plain(config), HARMLESS)
    best = -math.inf if note["best"] is None else float(note["best"])
    best_step, rectangle = int(note["best_step"]), -math.inf
    try:  # a policy may have been kept after the checkpoint
        kept = read_policy_meta(folder / "policy.safetensors").metrics
        best, best_step = float(kept["final"]), int(kept["step"])
        rectangle = float(kept["start"])
    except (ConfigError, KeyError, TypeError, ValueError):
        pass
    return RunState(int(note["step"]), float(note["seconds"]), best, best_step, int(note["n_updates"]), rectangle)


@dataclass
class LearningRate:
    """The learning rate, by the share of the training that is done; SB3 asks it."""

    config: LearningRateConfig
    done: float = 0.0  # 0 to 1

    def __call__(self, _remaining: float = 0.0) -> float:
        return self.config.lr_at(self.done)
