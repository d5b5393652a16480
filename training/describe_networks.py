"""The command `python -m training.describe_networks`: parameters, work and time of the two networks.

Prints a table for the weights that come with the project, or for the default settings where there are none.
"""

import sys
from typing import Any

import typer
from rich.console import Console
from rich.table import Table
from torch import nn

from agents.commands.pulse import Pulse
from agents.commands.running import run_command
from agents.guided.config import NfapConfig, WarpConfig
from agents.guided.nfap import NfapNet
from agents.guided.warp import WarpNet
from agents.guided.weights import load_nfap, load_warpnet
from autopoly_env.errors import ConfigError
from training.networks.cost import cost

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command(help=__doc__)
def describe() -> int:
    nets = _or_new(load_nfap, NfapNet(NfapConfig())), _or_new(load_warpnet, WarpNet(WarpConfig()))
    with Pulse(lambda: "measuring the networks"):
        columns = [cost(net) for net in nets]
    table = Table("", "nFAP-Net", "WarpNet")
    for what in columns[0]:
        table.add_row(what, *(f"{column[what]:,.2f}" for column in columns))
    Console().print(table)
    return 0


def _or_new(load: Any, new: nn.Module) -> nn.Module:
    try:
        net: nn.Module = load()[0]
    except ConfigError:
        return new
    return net


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns the exit code."""
    return run_command(app, arguments, "python -m training.describe_networks")


if __name__ == "__main__":
    sys.exit(main())
