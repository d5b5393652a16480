"""Clone a teacher: teach the policy what `training.make_expert` has labelled, so that training begins with a good one.

    python -m training.make_expert runs/expert --n 4096                 # what every action leads to, in many states
    python -m training.make_expert runs/held_out --n 256 --held-out     # other targets, to measure with
    python -m training.rl_clone --config configs/train/clone.yaml       # runs/clone/policy.safetensors
    torchrun --nproc-per-node 8 -m training.rl_clone --config configs/train/clone.yaml   # one node, 8 processes

The likeliest actions are to be those that gain most: the target distribution is the softmax of what each action gains
in r_all, 0 for stopping, at the price of an element that is drawn for the sample. Where a shard has no outcomes (those
of `source=search`), all is on the action that was taken. The value is to be what the construction gained from there on.

The same command goes on with a run that was stopped.
"""

import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional
from torch.utils.data import Dataset

from agents.rl.network import NEVER, MeshNet
from agents.rl.weights import save_policy
from autopoly_env.files import write_atomically
from training.networks.command import ConfigFile, Folder, Overrides, ShowConfig, new_app, run_training, train_network
from training.networks.metrics import mean_rows
from training.networks.samples import Sample
from training.networks.streams import Batch, HeldOut, InTurn, Made, stored
from training.policies.clone_samples import PICTURES, CloneConfig, CloneStream
from training.policies.evaluation import evaluate, evaluations_of, flat, mean_final, mean_start, summary
from training.policies.play_samples import PlayStream, read_plays
from training.policies.starting import begun_with
from training.run_log import known
from training.telling import table_of


class CloneLosses(nn.Module):
    """A batch to the terms of its loss."""

    def __init__(self, net: MeshNet, value_weight: float) -> None:
        super().__init__()
        self.net, self.value_weight = net, value_weight

    def forward(self, batch: Batch) -> dict[str, Tensor]:
        """The terms; "loss" is their weighted sum. "choice" is the divergence of the policy from its target."""
        logits, value = self.net(batch)
        return self.terms(logits, value, batch)

    def terms(self, logits: Tensor, value: Tensor, batch: Batch) -> dict[str, Tensor]:
        """The terms of the network's outputs."""
        target = batch["policy"]
        log_choice = logits.log_softmax(-1).masked_fill(logits <= 0.5 * NEVER, 0.0)
        choice = (torch.xlogy(target, target) - target * log_choice).sum(-1).mean()
        worth = functional.mse_loss(value, batch["value"][:, 0])
        return {"loss": choice + self.value_weight * worth, "choice": choice, "value": worth}


def _streams(config: CloneConfig) -> tuple[InTurn, InTurn]:
    """Samples to learn from, and to measure with."""
    data, seed = config.data, config.run.seed
    learn: list[Dataset[Sample]] = []
    unseen: list[Dataset[Sample]] = []
    for folder in filter(None, data.shards.split(",")):
        learn.append(CloneStream(stored(folder), config, seed, made=Made.of(folder)))
    for folder in filter(None, data.held_out.split(",")) if data.shards else ():
        held_out = stored(folder, held_out=True)
        unseen.append(CloneStream(held_out, config, seed, turn=False, made=Made.of(folder)))
    if data.plays:
        plays, others = read_plays(data.plays, config.env.spec(), data.least_gain)
        n_equal = max(1, len(learn))  # as many samples of plays as of shards
        learn += [PlayStream(plays, config, seed + k) for k in range(n_equal)]
        unseen += [PlayStream(others, config, seed + k, turn=False) for k in range(n_equal)]
    return InTurn(learn), InTurn(unseen)


class CloneTask:
    """The policy for the trainer."""

    name = "clone"

    def __init__(self, config: CloneConfig) -> None:
        torch.manual_seed(config.run.seed)
        self.config = config
        spec = config.env.spec()
        self.net = begun_with(Path(config.init), config.net, spec) if config.init else MeshNet(config.net, spec)
        self.net.train()
        self.losses = CloneLosses(self.net, config.value_weight)
        self.stream, unseen = _streams(config)
        self._held_out = HeldOut(unseen, config.data.n_held_out)

    def measure(self, device: torch.device) -> dict[str, float]:
        """Loss, its terms, and what share of the best gain the likeliest action holds, on the held-out samples."""
        rows = []
        for batch in self._held_out.batches(device):
            logits, value = self.net(batch)
            terms = {name: float(term) for name, term in self.losses.terms(logits, value, batch).items()}
            best = batch["gains"].amax(-1)
            won = batch["gains"].gather(1, logits.argmax(-1, keepdim=True))[:, 0].clamp(min=-10.0)
            has_gains = float(best.sum()) > 0.0  # which shards of the random constructions have not
            rows.append({**terms, "gain_share": float(won.sum() / best.sum()) if has_gains else math.nan})
        return mean_rows(rows)

    def draw(self, _device: torch.device) -> Any:
        """Renderings above their targets."""
        batch = self._held_out.first(8, torch.device("cpu"))
        return np.concatenate([np.concatenate(list(batch[name][:, 0].numpy()), axis=1) for name in PICTURES], axis=0)


def finish_clone(task: CloneTask, settings: dict[str, Any], folder: Path, _device: torch.device) -> Path:
    """Measure and evaluate the network that `train` left; write report.json and policy.safetensors."""
    config, net = task.config, task.net.cpu().eval()
    with torch.no_grad():
        held_out = known(task.measure(torch.device("cpu")))
    built = evaluate(evaluations_of(config.env, config.n_exam, 128), net)
    metrics = {**held_out, **flat(built), "final": mean_final(built)}
    write_atomically(folder / "report.json", json.dumps({"metrics": metrics, "settings": settings}, indent=2) + "\n")
    path = save_policy(folder / "policy.safetensors", net, "clone", settings, metrics)
    print(f"{path}: {summary(built)}")
    print(table_of(held_out))
    if metrics["final"] <= mean_start(built):
        print("what it builds is no better than the untouched rectangle: it needs more steps, or more shards")
    return path


HELP = """Teach the policy what training.make_expert has labelled.

\b
Examples:
  python -m training.rl_clone --config configs/train/clone.yaml
  python -m training.rl_clone --config configs/train/clone.yaml optim.n_steps=1000 --out runs/short

The same command goes on with a run that was stopped. At the end the folder has policy.safetensors, to begin
training.train_rl with. See docs/rl.md.
"""

app = new_app()


@app.command(help=HELP)
def main_command(
    overrides: Overrides = None,
    config: ConfigFile = None,
    out: Folder = Path("runs/clone"),
    show_config: ShowConfig = False,
) -> int:
    return train_network(CloneConfig(), overrides, config, out, CloneTask, finish_clone, show_config)


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns the exit code."""
    return run_training(app, arguments, "training.rl_clone")


if __name__ == "__main__":
    sys.exit(main())
