"""Weights of ChoiceNet as the project's own, and their model card."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from agents.choice.weights import SHIPPED, load_choice, save_choice
from autopoly_env.files import write_atomically


def export_choice(path: Path, command: str) -> Path:
    """Put weights and card where the agent `choice-prior` looks for them; returns the folder."""
    weights = load_choice(path)
    meta = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
    save_choice(SHIPPED / "choice.safetensors", weights.config, weights.tensors, meta["training"], meta["metrics"])
    n_numbers = sum(int(np.size(tensor)) for tensor in weights.tensors.values())
    write_atomically(SHIPPED / "choice.md", _card(n_numbers, meta, command))
    return SHIPPED


def _card(n_numbers: int, meta: Mapping[str, Any], command: str) -> str:
    training = meta["training"]
    played, compared, config = training["play"], training["compare"], meta["config"]
    rows = "\n".join(f"| {name} | {value:.4g} |" for name, value in meta["metrics"].items())
    rounds = "\n".join(_row(name, reached) for name, reached in training.get("rounds", {}).items())
    return f"""# choice

ChoiceNet: from a state's legal actions and the picture around each to how promising each is, and to what search will
add to the state. {n_numbers} parameters, NumPy alone.

**Knows.** Rules of faces {", ".join(config["rules"])}; prices w_sc {config["w_sc"][0]:g} to {config["w_sc"][1]:g};
what {", ".join(config["classes"])} do.

**Data.** Round {training["round"]} of those below; the first has {played["n_first"]} plays, each other
{played["n_plays"]}. A play is the best of {played["n_runs"]} tree searches of {played["refits"]} refits,
{played["modeller"]:.0%} in the modeller's style, the others in the paper's. Targets are made by `autopoly_env.targets`,
held-out ones from seeds that training never draws. No picture from outside was used.

**Command.** `{command}`, seed {training["run"]["seed"]}. A play takes about two seconds of one core, learning of a
round a minute and a half, a comparison a quarter of a minute.

**Rounds**, on {compared["n_targets"]} held-out targets, the tree alone with {compared["refits"]} refits

| round | mean r_all | on the round before, 95 % |
|---|---|---|
{rounds}

**Held-out metrics** of the last round (what they mean: `training/improvement/learning.py`)

| metric | value |
|---|---|
{rows}

**Limits.** The picture is read at 64 x 64. Made targets are simpler than most drawings. What a state is worth after
search is that of a search of some hundred refits.

**Settings.** In the `.json` beside the weights, under `training`.
"""


def _row(name: str, reached: Mapping[str, Any]) -> str:
    lead = reached["lead"]
    said = "" if lead is None else f"{lead[0]:+.2f} ({lead[1]:+.2f} to {lead[2]:+.2f})"
    return f"| {name.removeprefix('round ')} | {reached['mean']:.2f} | {said} |"
