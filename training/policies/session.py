"""What happens between the rollouts of a training: `Session`, which Stable-Baselines3 calls, asks each of its parts.

The parts are the log, the curriculum, the evaluation that keeps the best policy, and the checkpoints. All of them read
`RunState`, which says where the run stands.
"""

import math
import time
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
from training.policies.evaluation import evaluate, evaluations_of, flat, mean_final, mean_start, summary
from training.policies.run_state import LearningRate, RunState
from training.policies.training_log import TrainingLog
from training.telling import duration


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

    @property
    def n_steps(self) -> float:
        """Steps of the training that an evaluation is as much work as; refits take as long as pictures are high."""
        env, run = self._config.env, self._config.run
        return len(env.courses) * run.n_eval * env.max_steps * run.eval_resolution / env.resolution

    def is_due(self, state: RunState) -> bool:
        """Whether it is time for an evaluation."""
        return state.step - self._last >= self._config.run.eval_every

    def steps_left(self, state: RunState) -> int:
        """Until the next evaluation."""
        return max(0, self._last + self._config.run.eval_every - state.step)

    def is_behind(self, state: RunState) -> bool:
        """Whether the policy of this step has not been evaluated, or none was kept."""
        return self._last < state.step or not math.isfinite(state.best)

    def evaluate(self, net: MeshNet, state: RunState, log: TrainingLog) -> None:
        """Let the policy build the held-out targets, and note how good it is."""
        self._last = state.step
        metrics = evaluate(self._evaluations, net)
        values = {"final": mean_final(metrics), "start": mean_start(metrics), **flat(metrics)}
        log.write_evaluation(state, values)
        if values["final"] > state.best:
            state.best, state.best_step, state.rectangle = values["final"], state.step, values["start"]
            settings = plain(self._config)
            kept = {"step": state.step, **values}
            save_policy(self._folder / "policy.safetensors", net, self._config.algorithm, settings, kept)
        print(f"step {state.step}, {state.seconds / 60.0:.1f} min: exam: {summary(metrics)}", flush=True)


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
            "rectangle": None,
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
        self.last_step = config.last_step(state.step)
        self.log = TrainingLog(folder, state)
        self.curriculum = Curriculum(config)
        self.best = BestPolicy(config, folder, state)
        self.checkpoints = Checkpoints(config, folder, state)
        self.bar: Progress | None = None  # of steps
        self.is_timed = False  # whether the clock is running, and not an exam or saving
        self._is_updating = False
        self._exam_seconds = self._update_seconds = 0.0  # that the last ones took
        self._begun_at = (state.step, state.seconds)
        self._told = -math.inf  # when there was a line of an update

    @property
    def is_over(self) -> bool:
        """Whether the budget of steps or minutes is spent, or is by the time that the last exam is done."""
        return self.state.share_done(self.config.run) >= 1.0 or self._is_late()

    def _is_late(self) -> bool:
        minutes = self.config.run.minutes
        spent = self._spent()
        return bool(minutes) and spent + self._exam_takes(spent) + self._update_seconds >= 60.0 * minutes

    def _spent(self) -> float:
        return self.state.seconds + (self.log.clock.running() if self.is_timed else 0.0)

    def _exam_takes(self, spent: float) -> float:
        """Seconds of an exam: as long as the last one or, before the first, as so many steps of the training."""
        n_steps, seconds = self.num_timesteps - self._begun_at[0], spent - self._begun_at[1]
        if self._exam_seconds or n_steps <= 0:
            return self._exam_seconds
        return self.best.n_steps * seconds / n_steps

    def stands(self) -> str:
        """Where the training stands, in a few words."""
        state = self.state
        spent = self._spent()
        what = (", updating the policy" if self._is_updating else "") if self.is_timed else ", exam or saving"
        return f"step {max(state.step, self.num_timesteps)} of {self.last_step}, {duration(spent)}{what}"

    def _on_training_start(self) -> None:
        if self.config.run.init and not math.isfinite(self.state.best):
            self._evaluate()  # what it begins with is the best so far
        self.log.clock.start()
        self.is_timed = True

    def _on_rollout_start(self) -> None:
        """After an update, or at the very beginning."""
        state = self.state
        self.is_timed = self._is_updating = False
        self._update_seconds = self.log.clock.stop_update()
        state.seconds += self._update_seconds
        state.step, state.n_updates = self.num_timesteps, int(getattr(self.model, "_n_updates", 0))
        self.lr.done = state.share_done(self.config.run)
        self.curriculum.apply(self.training_env, self.lr.done)
        self._tell()
        if self.log.is_due(state):
            self.log.write(state, self.lr(), self.model.logger.name_to_value)
        if self.best.is_due(state):
            self._evaluate()
        if self.checkpoints.is_due(state):
            self.checkpoints.save(self.model, state)
        self.log.clock.start(self._env_seconds())
        self.is_timed = True

    def _tell(self) -> None:
        """A line at each update, though not more than one a second."""
        state, speed = self.state, self.log.clock.steps_per_second
        if state.step == 0 or time.monotonic() - self._told < 1.0:
            return
        self._told = time.monotonic()
        line = f"step {state.step}, {duration(state.seconds)}: {speed:.0f} steps a second"
        if speed > 0.0:
            line += f", exam in {duration(self.best.steps_left(state) / speed)}"
        print(f"{line}; {self.log.recent()}", flush=True)

    def _on_step(self) -> bool:
        self.log.add(self.locals["infos"])
        if self.bar is not None:
            self.bar.update(TASK, completed=self.num_timesteps)
        return not self.is_over

    def _on_rollout_end(self) -> None:
        n_steps, self._is_updating = self.num_timesteps - self.state.step, True
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
        began = time.monotonic()
        self.best.evaluate(net_of(self.model.policy), self.state, self.log)
        self._exam_seconds = time.monotonic() - began
        self.state.seconds += self._exam_seconds

    def end(self) -> None:
        """What is due when the training is over."""
        if self.is_timed:
            self.state.seconds += self.log.clock.running()
            self.is_timed = False
        is_late = self._is_late()
        self.state.step = self.model.num_timesteps
        if self.best.is_behind(self.state):
            self._evaluate()
        if is_late:  # what is left is too little to go on with
            self.state.seconds = max(self.state.seconds, 60.0 * self.config.run.minutes)
        self.checkpoints.save(self.model, self.state)
