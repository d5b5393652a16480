"""The end of a training run: a report, weights, and, if wanted, the weights and model card of the project."""

import json
import shlex
import sys
from pathlib import Path
from typing import Any

import torch

from agents.guided.config import NfapConfig
from agents.guided.layers import n_parameters
from agents.guided.weights import SHIPPED, save_weights
from autopoly_env.files import write_atomically
from training.networks.cost import cost
from training.networks.trainer import TrainingTask
from training.run_log import known
from training.telling import table_of

_ABOUT = {
    "nfap": "nFAP-Net: from the rendering of a mesh and a target silhouette to the next actions and where they work.",
    "warpnet": "WarpNet: from the rendering of a mesh and a target silhouette to a warp of the mesh's vertices.",
}
_LIMITS = {
    "nfap": "Pictures of 64 x 64 do not show details below two pixels. Trained on random constructions and drawings of "
    "made-up things only; labels look one refit ahead, so actions that pay off later only (face_split) are underrated. "
    "Where it is told no price, priors are for that of its labels; the evaluator corrects them for another one.",
    "warpnet": "A grid of M x M control points cannot move two near vertices apart. It is no refit: it gives a search "
    "a rough idea of what one would do.",
}


def finish_run(task: TrainingTask, settings: dict[str, Any], folder: Path, device: torch.device, export: bool) -> None:
    """Measure the network that `train` left, write report.json and NAME.safetensors; with `export` to the project."""
    task.net.eval()
    with torch.no_grad():
        metrics = known(task.measure(device))
    work = cost(task.net)
    report = {"metrics": metrics, "cost": work, "settings": settings}
    write_atomically(folder / "report.json", json.dumps(report, indent=2) + "\n")
    path = save_weights(folder / f"{task.name}.safetensors", task.net, settings, metrics)  # type: ignore[arg-type]
    print(f"{path}, on the held-out samples:\n{table_of(metrics)}")
    if export:
        save_weights(SHIPPED / f"{task.name}.safetensors", task.net, settings, metrics)  # type: ignore[arg-type]
        card = write_atomically(SHIPPED / f"{task.name}.md", _card(task, settings, metrics, work))
        print(f"exported to {card.parent}")


def _origin(folders: str | list[str], data: dict[str, Any]) -> str:
    """Where samples came from, in words."""
    if not folders:
        return f"constructions made live: `{json.dumps(data['source'])}`"
    return ", ".join(_shards_of(folder) for folder in ([folders] if isinstance(folders, str) else folders))


def _shards_of(folder: str) -> str:
    n_shards = len(list(Path(folder).glob("*.npz")))
    try:
        source = json.dumps(json.loads((Path(folder) / "meta.json").read_text(encoding="utf-8"))["source"])
    except (OSError, ValueError, KeyError, TypeError):
        source = "settings not noted"
    return f"{n_shards} shards of `training.make_expert`: `{source}`"


def _begun(settings: dict[str, Any]) -> str:
    """What it went on from, if from anything."""
    begin = settings.get("begin")
    return f"\n\n**Begun** with the weights that were at `{begin}` until then." if begin else ""


def _knows(net: Any) -> str:
    """What nFAP-Net may be asked about, where it is told rule and price."""
    config = net.config
    if not isinstance(config, NfapConfig) or config.w_sc is None:
        return ""
    return f"""
**Knows.** Rules of faces {", ".join(config.rules)}; prices w_sc {config.w_sc[0]:g} to {config.w_sc[1]:g}; what
{", ".join(config.classes[1:])} do.
"""


def _card(task: TrainingTask, settings: dict[str, Any], metrics: dict[str, float], work: dict[str, float]) -> str:
    """The model card."""
    rows = "\n".join(f"| {name} | {value:.4g} |" for name, value in metrics.items())
    costs = "\n".join(f"| {name} | {value:.4g} |" for name, value in work.items())
    data = settings["data"]
    return f"""# {task.name}

{_ABOUT[task.name]} {n_parameters(task.net)} parameters.
{_knows(task.net)}
**Data.** Learnt from {_origin(data["shards"], data)}; measured on {data["n_held_out"]} samples from
{_origin(data["held_out"], data)}. Targets are made by `autopoly_env.targets`, held-out ones from seeds that training
never draws. No picture from outside was used.{_begun(settings)}

**Command.** `python -m training.train_{task.name} {shlex.join(sys.argv[1:])}`, seed {settings["run"]["seed"]}.

**Held-out metrics** (what they mean: `training/networks/metrics.py`)

| metric | value |
|---|---|
{rows}

**Cost**

| | |
|---|---|
{costs}

**Limits.** {_LIMITS[task.name]}

**Settings.** In the `.json` beside the weights, under `training`.
"""
