"""Small vector environments: random play in every autoreset mode, and a comparison bit for bit."""

from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

NAME = "autopoly_env:AutoPoly-v0"
SMALL: dict[str, Any] = {"resolution": 16, "obs_resolution": 16, "max_steps": 6, "max_vertices": 16}
MODES = list(AutoresetMode)


def same(a: Any, b: Any) -> bool:
    """Whether nested dicts, arrays and values are equal bit for bit."""
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, np.ndarray) and a.dtype == object:
        return all(same(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and np.array_equal(a, b)
    return type(a) is type(b) and a == b


def rollout(envs: Any, n_steps: int, mode: AutoresetMode) -> list[Any]:
    """All that comes out of random legal actions; ended environments are reset by hand where nobody else does it."""
    rng = np.random.default_rng(0)
    seen: list[Any] = [envs.reset(seed=5)]
    masks = seen[0][1]["action_mask"]
    for _ in range(n_steps):
        actions = np.array([rng.choice(np.flatnonzero(mask)) for mask in masks])
        seen.append(envs.step(actions))
        masks, over = seen[-1][4]["action_mask"].copy(), seen[-1][2] | seen[-1][3]
        if mode == AutoresetMode.DISABLED and over.any():
            seen.append(envs.reset(options={"reset_mask": over}))
            masks[over] = seen[-1][1]["action_mask"][over]
    return seen
