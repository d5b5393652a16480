"""The command `python -m training.measure_nfap`: how well nFAP-Nets foresee, on held-out shards, at several prices.

Weights that are told no price are corrected for it as in the search. See `training.networks.metrics`.
"""

import sys
from pathlib import Path
from typing import Annotated

import torch
import typer
from rich.console import Console
from rich.table import Table

from agents.commands.running import run_command
from agents.guided.nfap import NfapNet
from agents.guided.weights import load_nfap
from training.networks.metrics import mean_rows, nfap_metrics
from training.networks.samples import LabelConfig
from training.networks.streams import HeldOut, NfapStream, stored

SHOWN = ("operator_accuracy", "action_top3", "action_top3_residual", "gain_top3", "gain_top3_residual", "choice_excess")

HELP = """Measure nFAP-Nets on held-out shards, at several prices of complexity.

\b
Examples:
  python -m training.measure_nfap runs/held_out
  python -m training.measure_nfap runs/held_out_quads --weights runs/nfap/nfap.safetensors --w-sc 0.3 --w-sc 1
"""

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command(help=HELP)
def measure(
    shards: Annotated[str, typer.Argument(help="A folder of training.make_expert --held-out.")],
    weights: Annotated[list[str] | None, typer.Option(help="A .safetensors file; by default the project's.")] = None,
    w_sc: Annotated[list[float] | None, typer.Option(help="Prices; by default 0.1, 0.3, 1, 1.5.")] = None,
    n: Annotated[int, typer.Option("--n", min=1, help="States, rounded up to whole batches of 64.")] = 512,
    temperature: Annotated[float, typer.Option(help="Of the labels, in points of r_all.")] = 0.25,
) -> int:
    trajectories = stored(shards, held_out=True)
    table = Table("weights", "w_sc", *SHOWN)
    for path in weights or [""]:
        net, meta = load_nfap(path)
        trained = meta.training.get("labels", {})
        for price in w_sc or [0.1, 0.3, 1.0, 1.5]:
            stream = NfapStream(trajectories, net.config, LabelConfig(temperature, w_sc=price), seed=0, turn=False)
            dearer = 0.0 if net.config.w_sc else (price - trained.get("w_sc", 0.3)) / trained.get("temperature", 1.0)
            found = _metrics(net, HeldOut(stream, n), dearer)
            table.add_row(Path(path).stem or "shipped", f"{price:g}", *(f"{found[name]:.3f}" for name in SHOWN))
    Console(width=160).print(table)
    return 0


def _metrics(net: NfapNet, held_out: HeldOut, dearer: float) -> dict[str, float]:
    rows = []
    with torch.inference_mode():
        for batch in held_out.batches(torch.device("cpu")):
            said = net(batch["pictures"], batch["told"], n_stages=1, with_images=False)
            rows.append(nfap_metrics(net, said, batch, dearer))
    return mean_rows(rows)


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns the exit code."""
    return run_command(app, arguments, "python -m training.measure_nfap")


if __name__ == "__main__":
    sys.exit(main())
