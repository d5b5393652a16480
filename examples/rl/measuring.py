"""What the recipes share: the environment that they learn in, and how good the shapes are that a policy ends with."""

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np

NAME = "autopoly_env:AutoPoly-v0"
SETTINGS: dict[str, Any] = {
    "resolution": 64,
    "obs_resolution": 36,
    "max_vertices": 16,
    "max_steps": 12,
    "reward_mode": "improvement",
}
SEED, N_STEPS = 0, 2048


def make(**settings: Any) -> gymnasium.Env[Any, Any]:
    """A small environment, quick to learn in."""
    return gymnasium.make(NAME, **{**SETTINGS, **settings})


def r_all_of(act: Callable[[Any, Any], Any], wrap: Callable[[Any], Any] = lambda env: env, n: int = 20) -> str:
    """Mean r_all that `act(observation, mask) -> action` ends with on `n` targets that nobody learns from."""
    env, ends = wrap(make(split="test")), []
    for seed in range(n):
        observation, info = env.reset(seed=seed)
        over = False
        while not over:
            action = int(np.asarray(act(observation, info["action_mask"])).item())
            observation, _, terminated, truncated, info = env.step(action)
            over = terminated or truncated
        ends.append(info["r_all"])
    return f"{np.mean(ends):.1f}"
