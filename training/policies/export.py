"""The policy that comes with the project: weights and model card, from a run's folder to where the agents look."""

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from agents.guided.layers import n_parameters
from agents.rl.weights import SHIPPED, PolicyMeta, load_policy
from autopoly_env.files import write_atomically


def export_policy(path: Path, algorithm: str, arguments: Sequence[str]) -> Path:
    """Copy a policy with its .json, and write its card; returns the folder. Raises ConfigError for a damaged one."""
    net, meta = load_policy(path)
    goal = SHIPPED / f"{algorithm}.safetensors"
    goal.with_suffix(".json").unlink(missing_ok=True)
    write_atomically(goal, path.read_bytes())
    write_atomically(goal.with_suffix(".json"), path.with_suffix(".json").read_bytes())
    write_atomically(goal.with_suffix(".md"), card(meta, n_parameters(net), arguments))
    return goal.parent


def card(meta: PolicyMeta, n: int, arguments: Sequence[str]) -> str:
    """The model card."""
    rows = "\n".join(
        f"| {name} | {value:.4g} |" for name, value in meta.metrics.items() if isinstance(value, int | float)
    )
    env = meta.training.get("env", {})
    init = meta.training.get("run", {}).get("init", "")
    begin = f"It went on from `{init}`." if init else "It began with random weights."
    tasks = "; ".join(_told(task) for task in env.get("courses", []))
    spec = ", ".join(f"{k} {v if not isinstance(v, list) else ' '.join(map(str, v))}" for k, v in meta.spec.items())
    return f"""# {meta.algorithm}

A policy that reads a mesh, its rendering and a target silhouette, and points at the next modelling action. {n}
parameters. {begin}

**Data.** Targets are made by `autopoly_env.targets`: {tasks}. Seeds from 2^30 on were held out and are what the
metrics are of. No picture from outside was used.

**Command.** `python -m training.train_rl {shlex.join(arguments)}`, seed {meta.training.get("run", {}).get("seed", 0)}.

**Made for.** {spec}.

**Held-out metrics**, one greedy episode on each target (`training/policies/evaluation.py` says what they are)

| metric | value |
|---|---|
{rows}

**Limits.** Pictures of {meta.spec.get("obs_resolution")} pixels a side do not show details below two pixels. Rules of
faces and prices that are not among those above are refused. After {meta.spec.get("max_steps")} steps it stops.

**Settings.** In the `.json` beside the weights, under `training`.
"""


def _told(task: Mapping[str, Any]) -> str:
    """A course in words."""
    low, *high = w_sc if isinstance(w_sc := task["w_sc"], list) else [w_sc]
    price = f"{low:g} to {high[0]:g}" if high else f"{low:g}"
    faces = task.get("faces", "any")
    return f"{task['targets']} at w_sc {price}" + (f", faces={faces}" if faces != "any" else "")
