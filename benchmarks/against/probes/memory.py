"""The most memory, in MB, that this process has held: of one solve by `mcts`, or of 16 environments that step."""

import resource
import sys
from pathlib import Path
from typing import Any

import numpy as np


class Probe:
    def __init__(self, settings: dict[str, Any]) -> None:
        self._settings = settings

    def measure(self, turn: int) -> dict[str, float]:
        images = self._settings["images"]
        _solve(images[turn % len(images)]) if self._settings["what"] == "solve" else _step()
        return {"peak": _peak()}


def _solve(image: str) -> None:
    from agents.budget import Budget
    from agents.registry import make_agent
    from autopoly_env.silhouette import load_silhouette
    from autopoly_env.simulator import Simulator

    make_agent("mcts").solve(Simulator(load_silhouette(image)), Budget(refits=1500))


def _step() -> None:
    import gymnasium

    name = "autopoly_env:AutoPoly-v0"
    envs = gymnasium.make_vec(name, num_envs=16, vectorization_mode="vector_entry_point", resolution=64)
    rng, mask = np.random.default_rng(0), envs.reset(seed=0)[1]["action_mask"]
    for _ in range(400):
        mask = envs.step(np.array([rng.choice(np.flatnonzero(row)) for row in mask]))[4]["action_mask"]


def _peak() -> float:
    """Of this program alone, where the system tells: `ru_maxrss` may be that of whoever started it."""
    status = Path("/proc/self/status")
    if status.exists():
        line = next(line for line in status.read_text().splitlines() if line.startswith("VmHWM"))
        return int(line.split()[1]) / 1024.0
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most / (2**20 if sys.platform == "darwin" else 1024.0)
