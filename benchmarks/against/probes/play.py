"""Random legal play in one environment: steps a CPU-second, and the share of a step that is no kernel."""

import sys
import time
from types import ModuleType
from typing import Any

import gymnasium
import numpy as np
from numba.core.dispatcher import Dispatcher

_N_STEPS = 400


class Probe:
    def __init__(self, settings: dict[str, Any]) -> None:
        self._env = gymnasium.make("autopoly_env:AutoPoly-v0", resolution=64)
        _play(self._env, 200, 10**6)

    def measure(self, turn: int) -> dict[str, float]:
        began = time.process_time()
        _play(self._env, _N_STEPS, turn)
        spent = time.process_time() - began
        return {"steps": _N_STEPS / spent, "outside": _share_outside_kernels(self._env, turn)}


def _play(env: Any, n_steps: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    _, info = env.reset(seed=seed)
    for _ in range(n_steps):
        _, _, terminated, truncated, info = env.step(int(rng.choice(np.flatnonzero(info["action_mask"]))))
        if terminated or truncated:
            _, info = env.reset()


def _share_outside_kernels(env: Any, seed: int) -> float:
    """Of the seconds of `step` alone, drawing actions and resets left out."""
    clock = _Clock()
    rng = np.random.default_rng(seed)
    _, info = env.reset(seed=seed)
    whole = inside = 0.0
    restore = clock.put_in()
    try:
        for _ in range(_N_STEPS):
            action = int(rng.choice(np.flatnonzero(info["action_mask"])))
            before, began = clock.seconds, time.perf_counter()
            _, _, terminated, truncated, info = env.step(action)
            whole += time.perf_counter() - began
            inside += clock.seconds - before
            if terminated or truncated:
                _, info = env.reset()
    finally:
        for module, name, kernel in restore:
            setattr(module, name, kernel)
    return 1.0 - inside / whole


class _Clock:
    """The seconds that Python has waited for kernels."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def put_in(self) -> list[tuple[ModuleType, str, Any]]:
        """Time every compiled function that a module of the project has; returns what to put back."""
        found = [
            (module, name, value)
            for module in list(sys.modules.values())
            if module is not None and module.__name__.startswith("autopoly_env")
            for name, value in vars(module).items()
            if isinstance(value, Dispatcher)
        ]
        for module, name, kernel in found:
            setattr(module, name, self._timed(kernel))
        return found

    def _timed(self, kernel: Any) -> Any:
        def timed(*arguments: Any) -> Any:
            began = time.perf_counter()
            try:
                return kernel(*arguments)
            finally:
                self.seconds += time.perf_counter() - began

        return timed
