"""What happens between the rollouts of a training: `Session`, which Stable-Baselines3 calls, asks each of its parts.

The parts are the log, the curriculum, the evaluation that keeps the best policy, and the checkpoints. All of them read
`RunState`, which says where the run stands.
"""

import math
from dataclasses import asdict
from pathlib import Path

import torch
from rich.progress import Progress
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnv

from agents.commands.progress import TASK
from agents.rl.algorithms import save_checkpoint
from agents.rl.network import MeshNet
from agents.rl.policies import net_of
from agents.rl.weights import save_policy
from autopoly_env.errors import RunError
from training.options import plain
from training.policies.config import TrainRlConfig
from training.policies.evaluation import evaluate, evaluations_of, flat, mean_final, summary
from training.policies.run_state import LearningRate, RunState
from training.policies.training_log import TrainingLog


class Curriculum:
    """Easy constructions first, where the settings want it."""

    def __init__(self, config: TrainRlConfig) -> None:
        self._config = config.curriculum
        self._hardest = max(task.difficulty[1] for task in config.env.courses)
        self._now = 0

    def apply(self, envs: VecEnv, done: float) -> None:
        """Tell the environments the difficulty that is due when this share of the training is done."""
        if not self._config.enabled:
            return
        due = 1 + round((self._hardest - 1) * min(1.0, done / self._config.until))
        if due != self._now:
            self._now = due
            envs.env_method("set_difficulty", due)


class BestPolicy:
    """Evaluates the policy on held-out targets and keeps it, as policy.safetensors, if no earlier one was better."""

    def __init__(self, config: TrainRlConfig, folder: Path, state: RunState) -> None:
        self._config, self._folder, self._last = config, folder, state.step
        self._evaluations = evaluations_of(config.env, config.run.n_eval, config.run.eval_resolution)

    def is_due(self, state: RunState) -> bool:
        """Whether it is time for an evaluation."""
        return state.step - self._last >= self._config.run.eval_every

    def is_behind(self, state: RunState) -> bool:
        """Whether the policy of this step has not been evaluated, or none was kept."""
        return self._last < state.step or not math.isfinite(state.best)

    def evaluate(self, net: MeshNet, state: RunState, log: TrainingLog) -> None:
        """Let the policy build the held-out targets, and note how good it is."""
        self._last = state.step
        metrics = evaluate(self._evaluations, net)
        values = {"final": mean_final(metrics), **flat(metrics)}
        log.write_evaluation(state, values)
        if values["final"] > state.best:
            state.best, state.best_step = values["final"], state.step
            settings = plain(self._config)
            kept = {"step": state.step, **values}
            save_policy(self._folder / "policy.safetensors", net, self._config.algorithm, settings, kept)
        print(f"step {state.step}, {state.seconds / 60.0:.1f} min: {summary(metrics)}", flush=True)


class Checkpoints:
    """checkpoint.zip, from which a run goes on."""

    def __init__(self, config: TrainRlConfig, folder: Path, state: RunState) -> None:
        self._config, self._path, self._last = config, folder / "checkpoint.zip", state.step

    def is_due(self, state: RunState) -> bool:
        """Whether it is time to save: now and then, and at the end."""
        run = self._config.run
        is_over = state.share_done(run) >= 1.0
        return state.step - self._last >= run.save_every or (is_over and state.step > self._last)

    def save(self, model: BaseAlgorithm, state: RunState) -> None:
        """Write the checkpoint."""
        self._last = state.step
        note = {
            **asdict(state),
            "best": state.best if math.isfinite(state.best) else None,
            "algorithm": self._config.algorithm,
            "spec": plain(self._config.env.spec()),
            "net": plain(self._config.net),
            "settings": plain(self._config),
        }
        save_checkpoint(self._path, model, note)


class Session(BaseCallback):
    """Asks the parts between rollouts, and ends the training when its budget is spent."""

    def __init__(self, config: TrainRlConfig, folder: Path, state: RunState, lr: LearningRate) -> None:
        super().__init__()
        self.config, self.state, self.lr = config, state, lr
        self.log = TrainingLog(folder, state)
        self.curriculum = Curriculum(config)
        self.best = BestPolicy(config, folder, state)
        self.checkpoints = Checkpoints(config, folder, state)
        self.bar: Progress | None = None  # of steps

    @property
    def is_over(self) -> bool:
        """Whether the budget of steps or minutes is spent."""
        return self.state.share_done(self.config.run) >= 1.0

    def _on_training_start(self) -> None:
        if self.config.run.init and not math.isfinite(self.state.best):
            self._evaluate()  # what it begins with is the best so far
        self.log.clock.start()

    def _on_rollout_start(self) -> None:
        """After an update, or at the very beginning."""
        state = self.state
        state.seconds += self.log.clock.stop_update()
        state.step, state.n_updates = self.num_timesteps, int(getattr(self.model, "_n_updates", 0))
        self.lr.done = state.share_done(self.config.run)
        self.curriculum.apply(self.training_env, self.lr.done)
        if self.log.is_due(state):
            self.log.write(state, self.lr(), self.model.logger.name_to_value)
        if self.best.is_due(state):
            self._evaluate()
        if self.checkpoints.is_due(state):
            self.checkpoints.save(self.model, state)
        self.log.clock.start(self._env_seconds())

    def _on_step(self) -> bool:
        self.log.add(self.locals["infos"])
        if self.bar is not None:
            self.bar.update(TASK, completed=self.num_timesteps)
        return not self.is_over

    def _on_rollout_end(self) -> None:
        n_steps = self.num_timesteps - self.state.step
        self.state.seconds += self.log.clock.stop_rollout(self._env_seconds(), n_steps)
        self._check()

    def _env_seconds(self) -> float:
        """Seconds spent in the environments so far; NaN where they do not count them."""
        return float(getattr(self.training_env, "seconds", math.nan))

    def _check(self) -> None:
        """Raise RunError if a weight is no number any more."""
        if not all(bool(torch.isfinite(p).all()) for p in self.model.policy.parameters()):
            raise RunError(
                f"a weight is not a number at step {self.num_timesteps}; the same command goes on from the last "
                "checkpoint: give a lower optim.lr"
            )

    def _evaluate(self) -> None:
        self.best.evaluate(net_of(self.model.policy), self.state, self.log)

    def end(self) -> None:
        """What is due when the training is over."""
        self.state.step = self.model.num_timesteps
        if self.best.is_behind(self.state):
            self._evaluate()
        self.checkpoints.save(self.model, self.state)
