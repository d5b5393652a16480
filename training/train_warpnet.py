"""Train WarpNet: the warp that takes the rendering of a mesh to the target, in place of a refit (docs/learning.md).

    python -m training.train_warpnet --config configs/train/warpnet.yaml                        # one CPU
    python -m training.train_warpnet --config configs/train/warpnet.yaml optim.batch_size=512   # one GPU
    torchrun --nproc-per-node 8 -m training.train_warpnet --config configs/train/warpnet.yaml   # one node, 8 processes
    torchrun --nnodes 2 --node-rank 0 --nproc-per-node 8 --rdzv-backend c10d --rdzv-endpoint HOST:29500 \\
        -m training.train_warpnet --config configs/train/warpnet.yaml           # two nodes; --node-rank 1 there

The same command goes on with a run that was stopped. Overrides: section.key=value. At the end the run's folder has
report.json and warpnet.safetensors; --export makes these the weights that come with the project.
"""

import sys
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from agents.guided.config import WarpConfig
from agents.guided.warp import Theta, Warp, WarpNet, loss_terms
from autopoly_env.errors import ConfigError
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
from training.networks.metrics import mean_rows, warp_metrics
from training.networks.pictures import draw_warp
from training.networks.streams import Batch, DataConfig, HeldOut, WarpStream
from training.networks.trainer import OptimConfig, RunConfig

N_DRAWN = 8  # samples in a picture of the log


@dataclass(frozen=True)
class WarpLossWeights:
    """Of the terms of WarpNet's loss. The paper has the image's term only."""

    image: float = 1.0
    mesh: float = 1.0
    bend: float = 0.1


@dataclass(frozen=True)
class TrainWarpnetConfig:
    """Everything that can be set."""

    net: WarpConfig = field(default_factory=WarpConfig)
    data: DataConfig = field(default_factory=DataConfig)
    placed_share: float = 1.0  # of samples whose new vertices begin at the disagreement; the others' do on the edge
    loss: WarpLossWeights = field(default_factory=WarpLossWeights)
    optim: OptimConfig = field(default_factory=OptimConfig)
    run: RunConfig = field(default_factory=RunConfig)

    def __post_init__(self) -> None:
        if not 0.0 <= self.placed_share <= 1.0:
            raise ConfigError(f"placed_share = {self.placed_share}: expected a share, 0 to 1")


class WarpLosses(nn.Module):
    """A batch to the terms of its loss."""

    def __init__(self, net: WarpNet, weights: WarpLossWeights, run: RunConfig) -> None:
        super().__init__()
        self.net, self.weights, self.run = net, weights, run

    def forward(self, batch: Batch) -> dict[str, Tensor]:
        """The terms; "loss" is their weighted sum."""
        return self.terms(self.warps(batch))

    def warps(self, batch: Batch) -> list[Warp]:
        """What becomes of the batch's meshes; the network itself computes in half precision where the run wants it."""
        return self.net.warps(batch["pictures"], batch["vertices"], batch["edges"], self._think)

    def _think(self, pictures: Tensor) -> Theta:
        with self.run.half_precision(pictures.device):
            theta: Theta = self.net(pictures)
        return theta

    def terms(self, warps: list[Warp]) -> dict[str, Tensor]:
        """The terms of what has become of them."""
        terms = loss_terms(self.net, warps, with_image=self.weights.image > 0.0)
        weighted = [getattr(self.weights, name) * term for name, term in terms.items()]
        return {"loss": torch.stack(weighted).sum(), **terms}


class WarpTask:
    """WarpNet for the trainer."""

    name = "warpnet"

    def __init__(self, config: TrainWarpnetConfig) -> None:
        torch.manual_seed(config.run.seed)
        self.config = config
        self.net = WarpNet(config.net)
        self.losses = WarpLosses(self.net, config.loss, config.run)
        learn, test = config.data.trajectories()
        self.stream = WarpStream(learn, config.net, config.run.seed, config.placed_share)
        unseen = WarpStream(test, config.net, config.run.seed, config.placed_share, turn=False)
        self._held_out = HeldOut(unseen, config.data.n_held_out)

    def measure(self, device: torch.device) -> dict[str, float]:
        """Loss, its terms and the share of a refit's gain, on the held-out samples."""
        rows = []
        for batch in self._held_out.batches(device):
            warps = self.losses.warps(batch)
            terms = {name: float(term) for name, term in self.losses.terms(warps).items()}
            rows.append({**terms, **warp_metrics(warps[-1].shown, batch)})
        return mean_rows(rows)

    def draw(self, device: torch.device) -> Any:
        """Current, target, as warped at first, the carried mesh in the end, the full refit."""
        batch = self._held_out.first(N_DRAWN, device)
        return draw_warp(self.net, self.losses.warps(batch), batch)


HELP = """Train WarpNet: the warp that takes the rendering of a mesh to the target.

\b
Examples:
  python -m training.train_warpnet --config configs/train/warpnet.yaml
  python -m training.train_warpnet optim.lr=3e-4 run.seed=1 --out runs/other
  torchrun --nproc-per-node 8 -m training.train_warpnet --out runs/eight

The same command goes on with a run that was stopped. At the end the folder has report.json and warpnet.safetensors.
See docs/learning.md, and the first lines of this script for more than one machine.
"""

app = new_app()


@app.command(help=HELP)
def main_command(
    overrides: Overrides = None,
    config: ConfigFile = None,
    out: Folder = Path("runs/warpnet"),
    export: Export = False,
    show_config: ShowConfig = False,
) -> int:
    finish = partial(finish_run, export=export)
    return train_network(TrainWarpnetConfig(), overrides, config, out, WarpTask, finish, show_config)


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns the exit code."""
    return run_training(app, arguments, "training.train_warpnet")


if __name__ == "__main__":
    sys.exit(main())
