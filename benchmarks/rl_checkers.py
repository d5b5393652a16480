"""Runs the checkers of Gymnasium, Stable-Baselines3 and TorchRL on the environment, where they are installed.

    pip install -e . -r examples/rl/requirements/checkers.txt
    python -m benchmarks.rl_checkers

A line for each; warnings are errors. Exit codes: 0 all pass, 1 one does not.
"""

import logging
import sys
import warnings
from collections.abc import Callable
from typing import Any

import gymnasium

NAME = "autopoly_env:AutoPoly-v0"
SETTINGS: dict[str, Any] = {"resolution": 32, "obs_resolution": 36, "max_vertices": 16, "max_steps": 6}


def main() -> int:
    """Run them all; returns the exit code."""
    logging.disable(logging.INFO)
    n_failed = 0
    for name, check in CHECKS.items():
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                check()
                outcome = "ok"
            except Exception as error:  # whatever a checker raises
                outcome, n_failed = f"{type(error).__name__}: {' '.join(str(error).split())[:200]}", n_failed + 1
        print(f"{name}: {outcome}", flush=True)
    return 1 if n_failed else 0


def _gymnasium() -> None:
    from gymnasium.utils.env_checker import check_env

    check_env(gymnasium.make(NAME, **SETTINGS).unwrapped)


def _sb3() -> None:
    from stable_baselines3.common.env_checker import check_env

    check_env(gymnasium.make(NAME, **SETTINGS).unwrapped, warn=True)


def _torchrl(kind: str) -> None:
    from torchrl.envs import GymWrapper, check_env_specs

    env: Any
    if kind == "single":
        env = gymnasium.make(NAME, **SETTINGS)
    elif kind == "native":
        env = gymnasium.make_vec(NAME, num_envs=2, autoreset_mode="Disabled", **SETTINGS)
    else:
        mode = {"autoreset_mode": "Disabled"}
        env = gymnasium.make_vec(NAME, num_envs=2, vectorization_mode=kind, vector_kwargs=mode, **SETTINGS)
    wrapped = GymWrapper(env, categorical_action_encoding=True).auto_register_info_dict()
    check_env_specs(wrapped)
    wrapped.rollout(10, break_when_any_done=False)
    wrapped.close()


CHECKS: dict[str, Callable[[], None]] = {
    "Gymnasium check_env": _gymnasium,
    "SB3 check_env": _sb3,
    "TorchRL check_env_specs, single": lambda: _torchrl("single"),
    "TorchRL check_env_specs, sync": lambda: _torchrl("sync"),
    "TorchRL check_env_specs, native": lambda: _torchrl("native"),
}

if __name__ == "__main__":
    sys.exit(main())
