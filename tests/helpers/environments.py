"""Small environments, one that has begun, random play, and a comparison bit for bit."""

from typing import Any

import numpy as np

from autopoly_env.env import AutoPolyEnv
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import Action
from tests.helpers.paths import ROOT

IDS = {"AutoPoly-v0": {}, "AutoPolyObjects-v0": {}, "AutoPolyFolder-v0": {"targets": str(ROOT / "examples")}}
SMALL: dict[str, Any] = {"resolution": 16, "obs_resolution": 16}
BOX = PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75)


def l_shape(size: int = 32) -> np.ndarray:
    """An L whose upper right quarter is missing: its bounding box has an IoU of 3/4."""
    mask = np.zeros((size, size), bool)
    mask[size // 8 : -size // 8, size // 8 : -size // 8] = True
    mask[: size // 2, size // 2 :] = False
    return mask


def make(**settings: Any) -> AutoPolyEnv:
    """One whose infos also speak in words, unless the settings say otherwise."""
    return AutoPolyEnv(**{**SMALL, "info_texts": True, **settings})


def begun(**settings: Any) -> AutoPolyEnv:
    env = make(**settings)
    env.reset(seed=1, options={"target": l_shape()})
    return env


def index_of(env: AutoPolyEnv, operator: str, element: int) -> int:
    return env.codec.encode(Action(operator, element))


def play(env: Any, n_steps: int, seed: int = 0, with_stop: bool = True) -> list[tuple[Any, ...]]:
    """Random legal actions; what each step returned, with the action first."""
    rng, steps = np.random.default_rng(seed), []
    for _ in range(n_steps):
        legal = np.flatnonzero(env.unwrapped.action_masks())
        action = int(rng.choice(legal if with_stop or len(legal) == 1 else legal[1:]))
        steps.append((action, *env.step(action)))
        if steps[-1][3] or steps[-1][4]:
            break
    return steps


def same(a: Any, b: Any) -> bool:
    """Whether two observations, infos or numbers are equal bit for bit."""
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and np.array_equal(a, b)
    return type(a) is type(b) and a == b
