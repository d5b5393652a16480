"""Training of policies, as small as it can be."""

import json
from pathlib import Path
from typing import Any

import yaml

from agents.rl.envs import EnvFactory
from training.options import read_config
from training.policies.config import TrainRlConfig

NET = {"width": 8, "widths": [4, 4, 4], "n_rounds": 1}
ENV = {"obs_resolution": 32, "resolution": 32, "max_vertices": 16, "max_steps": 5}
ALGORITHMS = ("maskable_ppo", "ppo", "a2c", "dqn")
SMALL: dict[str, Any] = {
    "net": NET,
    "env": ENV,
    "ppo": {"n_steps": 32, "batch_size": 32, "n_epochs": 1},
    "a2c": {"n_steps": 8},
    "dqn": {"buffer_size": 300, "learning_starts": 40, "batch_size": 16, "gradient_steps": 1},
    "run": {"total_steps": 256, "n_envs": 4, "n_eval": 1, "eval_resolution": 32, "eval_every": 128, "save_every": 128},
}


def config(*overrides: str, **more: Any) -> TrainRlConfig:
    values = {**SMALL, **more}
    flat = [f"{section}.{key}={json.dumps(value)}" for section, keys in values.items() for key, value in keys.items()]
    return read_config(None, [*flat, *overrides], TrainRlConfig())


def written(folder: Path, *overrides: str) -> Path:
    """The small config as a file."""
    path = folder / "small.yaml"
    path.write_text(yaml.safe_dump(SMALL))
    return path


def rows(folder: Path, group: str) -> list[dict[str, float]]:
    lines = [json.loads(line) for line in (folder / "log.jsonl").read_text().splitlines()]
    return [line for line in lines if any(key.startswith(f"{group}/") for key in line)]


def factory() -> EnvFactory:
    return EnvFactory(config().env.spec(), resolution=32)
