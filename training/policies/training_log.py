"""The log of a training run: SB3's own numbers, means over the last episodes, and where the time went."""

import math
import time
from collections import deque
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from training.policies.run_state import RunState
from training.run_log import RunLog

LOG_EVERY = 5_000  # steps
N_RECENT = 200  # episodes that the log's means are over
_OF_EPISODES = {"final_r_all": "r_all", "r_sm": "r_sm", "r_sc": "r_sc"}  # in the log: in the last step's info


class Clock:
    """Seconds of rollouts, of updates and of the environments; what lies between `stop` and `start` counts for none."""

    def __init__(self) -> None:
        self._began, self._env_began = time.perf_counter(), 0.0
        self.reset()

    def reset(self) -> None:
        """Forget what was counted."""
        self._rollout = self._update = self._env = 0.0
        self._n_steps = 0

    def start(self, env_seconds: float = 0.0) -> None:
        """Begin to count; `env_seconds` were spent in the environments so far."""
        self._began, self._env_began = time.perf_counter(), env_seconds

    def stop_rollout(self, env_seconds: float, n_steps: int) -> float:
        """Count a rollout of `n_steps` steps; returns its seconds. An update begins."""
        spent = self._lap()
        self._rollout += spent
        self._env += env_seconds - self._env_began
        self._n_steps += n_steps
        return spent

    def stop_update(self) -> float:
        """Count an update; returns its seconds."""
        spent = self._lap()
        self._update += spent
        return spent

    def _lap(self) -> float:
        now = time.perf_counter()
        spent, self._began = now - self._began, now
        return spent

    def running(self) -> float:
        """Seconds since it was started or stopped last."""
        return time.perf_counter() - self._began

    @property
    def steps_per_second(self) -> float:
        """Of what was counted since the log's last line; 0 before anything was."""
        return self._n_steps / max(self._rollout + self._update, 1e-9)

    def shares(self) -> dict[str, float]:
        """Steps a second, and shares of the time: environments, the policy's own inference, updates."""
        whole = max(self._rollout + self._update, 1e-9)
        return {
            "steps_per_second": self._n_steps / whole,
            "share_env": self._env / whole,
            "share_inference": (self._rollout - self._env) / whole,
            "share_update": self._update / whole,
        }


class TrainingLog:
    """The lines of log.jsonl: what SB3 says of its updates, means over the last episodes, and where the time went."""

    def __init__(self, folder: Path, state: RunState) -> None:
        self._log, self._last = RunLog(folder, state.step), state.step
        self._episodes = deque[dict[str, Any]](maxlen=N_RECENT)
        self.clock = Clock()

    def add(self, infos: Iterable[dict[str, Any]]) -> None:
        """Take note of the episodes that end with these infos of a step."""
        self._episodes.extend(info for info in infos if "episode" in info)

    def is_due(self, state: RunState) -> bool:
        """Whether it is time for a line."""
        return state.step - self._last >= LOG_EVERY

    def write(self, state: RunState, lr: float, updates: dict[str, Any]) -> None:
        """Write a line; `updates` are what SB3 has recorded, and are forgotten."""
        self._last = state.step
        values = {name: float(v) for name, v in updates.items() if isinstance(v, int | float | np.number)}
        updates.clear()
        values = {name.removeprefix("train/"): value for name, value in values.items() if math.isfinite(value)}
        values |= {"lr": lr, "minutes": state.seconds / 60.0}
        values |= {name: value for name, value in self.clock.shares().items() if math.isfinite(value)}
        self._log.write(state.step, "train", values | self._means())
        self.clock.reset()

    def recent(self) -> str:
        """The last episodes in words."""
        means = self._means()
        return f"last episodes: r_all {means['final_r_all']:.2f}" if means else "no episode has ended yet"

    def _means(self) -> dict[str, float]:
        """Over the last episodes; empty where there were none."""
        if not self._episodes:
            return {}
        means = {name: float(np.mean([info[key] for info in self._episodes])) for name, key in _OF_EPISODES.items()}
        for name, key in (("return", "r"), ("length", "l")):
            means[name] = float(np.mean([info["episode"][key] for info in self._episodes]))
        return means

    def write_evaluation(self, state: RunState, values: dict[str, float]) -> None:
        """Write the line of an evaluation."""
        self._log.write(state.step, "eval", {"minutes": state.seconds / 60.0, **values})
