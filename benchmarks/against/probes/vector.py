"""Steps a second of 16 environments, on two threads and in two worker processes, and against one environment."""

import inspect
import time
from typing import Any

import gymnasium
import numpy as np

from autopoly_env.compute import set_threads
from autopoly_env.vector_env import AutoPolyVectorEnv

_NAME = "autopoly_env:AutoPoly-v0"
_N_ENVS, _N_STEPS = 16, 800


class Probe:
    def __init__(self, settings: dict[str, Any]) -> None:
        set_threads(2)
        has_workers = "workers" in inspect.signature(AutoPolyVectorEnv.__init__).parameters
        self._native = _many()
        self._workers = _many(workers=2) if has_workers else self._native
        self._single = gymnasium.make(_NAME, resolution=64)
        self.measure(10**6)

    def measure(self, turn: int) -> dict[str, float]:
        many, workers = _rate_of_many(self._native, turn), _rate_of_many(self._workers, turn)
        one = _rate_of_one(self._single, turn)
        return {"native": many, "gain": many / one, "workers": workers, "workers gain": workers / one}


def _many(**settings: Any) -> Any:
    way = "vector_entry_point"
    return gymnasium.make_vec(_NAME, num_envs=_N_ENVS, vectorization_mode=way, resolution=64, **settings)


def _rate_of_many(native: Any, seed: int) -> float:
    rng = np.random.default_rng(seed)
    mask = native.reset(seed=seed)[1]["action_mask"]
    seconds = 0.0
    for _ in range(_N_STEPS // _N_ENVS):
        actions = np.array([rng.choice(np.flatnonzero(row)) for row in mask])
        began = time.perf_counter()
        mask = native.step(actions)[4]["action_mask"]
        seconds += time.perf_counter() - began
    return _N_STEPS / seconds


def _rate_of_one(single: Any, seed: int) -> float:
    rng = np.random.default_rng(seed)
    mask = single.reset(seed=seed)[1]["action_mask"]
    seconds = 0.0
    for _ in range(_N_STEPS):
        action = int(rng.choice(np.flatnonzero(mask)))
        began = time.perf_counter()
        _, _, terminated, truncated, info = single.step(action)
        if terminated or truncated:
            _, info = single.reset()
        seconds += time.perf_counter() - began
        mask = info["action_mask"]
    return _N_STEPS / seconds
