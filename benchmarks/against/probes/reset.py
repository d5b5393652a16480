"""Resets a CPU-second, to targets that were not seen before and to those that were."""

import time
from typing import Any

import gymnasium

_N_RESETS = 60


class Probe:
    def __init__(self, settings: dict[str, Any]) -> None:
        self._env = gymnasium.make("autopoly_env:AutoPoly-v0", resolution=64)
        _rate(self._env, range(10**6, 10**6 + _N_RESETS))

    def measure(self, turn: int) -> dict[str, float]:
        seeds = range(turn * _N_RESETS, (turn + 1) * _N_RESETS)
        return {"new": _rate(self._env, seeds), "known": _rate(self._env, seeds)}


def _rate(env: Any, seeds: range) -> float:
    began = time.process_time()
    for seed in seeds:
        env.reset(seed=seed)
    return len(seeds) / (time.process_time() - began)
