"""Train nFAP-Net: the next n actions, where they work, and how the shape then looks (docs/learning.md).

    python -m training.train_nfap --config configs/train/nfap.yaml                          # one CPU
    python -m training.train_nfap --config configs/train/nfap.yaml optim.batch_size=512     # one GPU
    torchrun --nproc-per-node 8 -m training.train_nfap --config configs/train/nfap.yaml     # one node, 8 processes
    torchrun --nnodes 2 --node-rank 0 --nproc-per-node 8 --rdzv-backend c10d --rdzv-endpoint HOST:29500 \\
        -m training.train_nfap --config configs/train/nfap.yaml             # two nodes; --node-rank 1 on the other

The same command goes on with a run that was stopped. Overrides: section.key=value. At the end the run's folder has
report.json and nfap.safetensors; --export makes these the weights that come with the project.
"""

import sys
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from agents.guided.config import NfapConfig
from agents.guided.nfap import Foresight, NfapLabels, NfapNet, loss_terms
from training.networks.command import (
    ConfigFile,
    Export,
    Folder,
    Overrides,
    ShowConfig,
    new_app,
    run_training,
    train_network,
)
from training.networks.finish import finish_run
from training.networks.inherit import inherit
from training.networks.metrics import mean_rows, nfap_metrics
from training.networks.pictures import draw_nfap
from training.networks.samples import LabelConfig
from training.networks.streams import Batch, DataConfig, HeldOut, NfapStream
from training.networks.trainer import OptimConfig, RunConfig

N_DRAWN = 6  # samples in a picture of the log


@dataclass(frozen=True)
class NfapLossWeights:
    """Of the terms of nFAP-Net's loss. The paper has no choice and all others at 1, its pictures summed over pixels."""

    image: float = 10.0
    operator: float = 1.0
    region: float = 10.0
    choice: float = 1.0


@dataclass(frozen=True)
class TrainNfapConfig:
    """Everything that can be set."""

    net: NfapConfig = field(default_factory=NfapConfig)
    begin: str = ""  # weights of an earlier nFAP-Net (.safetensors) to begin with; empty: begin anew
    data: DataConfig = field(default_factory=DataConfig)
    labels: LabelConfig = field(default_factory=LabelConfig)
    loss: NfapLossWeights = field(default_factory=NfapLossWeights)
    optim: OptimConfig = field(default_factory=OptimConfig)
    run: RunConfig = field(default_factory=RunConfig)


class NfapLosses(nn.Module):
    """A batch to the terms of its loss."""

    def __init__(self, net: NfapNet, weights: NfapLossWeights, run: RunConfig) -> None:
        super().__init__()
        self.net, self.weights, self.run = net, weights, run

    def forward(self, batch: Batch) -> dict[str, Tensor]:
        """The terms; "loss" is their weighted sum."""
        return self.terms(self.foresee(batch), batch)

    def foresee(self, batch: Batch) -> Foresight:
        """What the network foresees, in half precision where the run wants it."""
        with self.run.half_precision(batch["pictures"].device):
            foresight: Foresight = self.net(batch["pictures"], batch["told"])
        return foresight

    def terms(self, foresight: Foresight, batch: Batch) -> dict[str, Tensor]:
        """The terms of the network's outputs."""
        terms = loss_terms(self.net, foresight, NfapLabels.of(batch))
        weighted = [getattr(self.weights, name) * term for name, term in terms.items()]
        return {"loss": torch.stack(weighted).sum(), **terms}


class NfapTask:
    """nFAP-Net for the trainer."""

    name = "nfap"

    def __init__(self, config: TrainNfapConfig) -> None:
        torch.manual_seed(config.run.seed)
        self.config = config
        self.net = NfapNet(config.net)
        if config.begin:
            inherit(self.net, config.begin)
        self.losses = NfapLosses(self.net, config.loss, config.run)
        learn, test = config.data.trajectories()
        self.stream = NfapStream(learn, config.net, config.labels, config.run.seed)
        unseen = NfapStream(test, config.net, config.labels, config.run.seed, turn=False)
        self._held_out = HeldOut(unseen, config.data.n_held_out)

    def measure(self, device: torch.device) -> dict[str, float]:
        """Loss, its terms and how good the priors are, on the held-out samples."""
        rows = []
        for batch in self._held_out.batches(device):
            foresight = self.losses.foresee(batch)
            terms = {name: float(term) for name, term in self.losses.terms(foresight, batch).items()}
            rows.append({**terms, **nfap_metrics(self.net, foresight, batch)})
        return mean_rows(rows)

    def draw(self, device: torch.device) -> Any:
        """Current, target, and for every stage the true and the foreseen image and region."""
        batch = self._held_out.first(N_DRAWN, device)
        return draw_nfap(self.losses.foresee(batch), batch)


HELP = """Train nFAP-Net: the next n actions, where they work, and how the shape then looks.

\b
Examples:
  python -m training.train_nfap --config configs/train/nfap.yaml
  python -m training.train_nfap optim.lr=3e-4 run.seed=1 --out runs/other
  torchrun --nproc-per-node 8 -m training.train_nfap --out runs/eight

The same command goes on with a run that was stopped. At the end the folder has report.json and nfap.safetensors.
See docs/learning.md, and the first lines of this script for more than one machine.
"""

app = new_app()


@app.command(help=HELP)
def main_command(
    overrides: Overrides = None,
    config: ConfigFile = None,
    out: Folder = Path("runs/nfap"),
    export: Export = False,
    show_config: ShowConfig = False,
) -> int:
    finish = partial(finish_run, export=export)
    return train_network(TrainNfapConfig(), overrides, config, out, NfapTask, finish, show_config)


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns the exit code."""
    return run_training(app, arguments, "training.train_nfap")


if __name__ == "__main__":
    sys.exit(main())
