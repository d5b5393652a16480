"""The loop that trains a network: batches, loss, step, log, measure, save; on one CPU, one GPU or many of either.

A run is a folder. It may be stopped at any moment and goes on from its last checkpoint along the same curve; on CPUs
bit for bit. Letters: B batch, W processes (under torchrun), each with its own B samples of a step.
"""

import math
import os
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any, Literal, Protocol

import torch
import torch.distributed as dist
from torch import Tensor, nn
from torch.nn.parallel import DistributedDataParallel

from agents.commands.pulse import Pulse
from autopoly_env.arguments import above, at_least
from autopoly_env.arrays import ByteArray
from autopoly_env.errors import ConfigError, RunError
from autopoly_env.files import write_atomically
from autopoly_env.shown import counted
from training.networks.streams import Batch, batches
from training.options import check_same_run, claim_run
from training.run_log import RunLog
from training.telling import duration

_HARMLESS = ("n_workers", "n_threads", "device", "log_every", "save_every")  # a run may go on with other ones


@dataclass(frozen=True)
class OptimConfig:
    """AdamW with a linear warm-up and a cosine to 0."""

    lr: float = 1e-3
    weight_decay: float = 1e-3
    warmup: int = 100  # steps
    n_steps: int = 6000
    batch_size: int = 64  # of each process
    clip: float = 1.0  # largest norm of the gradient

    def __post_init__(self) -> None:
        above(0, lr=self.lr, clip=self.clip)
        at_least(0, weight_decay=self.weight_decay, warmup=self.warmup)
        at_least(1, n_steps=self.n_steps, batch_size=self.batch_size)

    def lr_at(self, step: int) -> float:
        """The learning rate of a step, 0 <= step < n_steps."""
        if step < self.warmup:
            return self.lr * (step + 1) / self.warmup
        done = (step - self.warmup) / max(1, self.n_steps - self.warmup)
        return 0.5 * self.lr * (1.0 + math.cos(math.pi * done))


@dataclass(frozen=True)
class RunConfig:
    """How a run is carried out."""

    seed: int = 0
    device: Literal["auto", "cpu", "cuda"] = "auto"
    amp: Literal["gpu", "always", "never"] = "gpu"  # bfloat16 in the networks; on CPUs it pays with AVX512-BF16 or AMX
    n_workers: int = 1  # processes that make samples; 0: this one does
    n_threads: int = 0  # of torch; 0: as it likes
    log_every: int = 20  # steps
    eval_every: int = 250
    save_every: int = 100
    patience: int = 12  # measurements in a row that may fail to lower the held-out loss

    def __post_init__(self) -> None:
        at_least(1, log_every=self.log_every, eval_every=self.eval_every)
        at_least(1, save_every=self.save_every, patience=self.patience)
        at_least(0, seed=self.seed, n_workers=self.n_workers, n_threads=self.n_threads)

    def half_precision(self, device: torch.device) -> torch.autocast:
        """The context in which networks compute, in bfloat16 where it is wanted."""
        wanted = self.amp == "always" or (self.amp == "gpu" and device.type == "cuda")
        return torch.autocast(device.type, torch.bfloat16, enabled=wanted)


class TrainingTask(Protocol):
    """What is trained, on what, and how it is measured."""

    name: str
    stream: Any  # torch Dataset: samples by number

    @property
    def net(self) -> nn.Module:
        """The network."""

    @property
    def losses(self) -> nn.Module:
        """A batch to the terms of its loss by name, "loss" being their weighted sum; has `net` in it."""

    def measure(self, device: torch.device) -> dict[str, float]:
        """Held-out metrics of `net`, "loss" among them."""

    def draw(self, device: torch.device) -> ByteArray:
        """(H, W) or (H, W, 3): predictions beside the truth."""


@dataclass(frozen=True)
class Process:
    """Which of W processes this is, and where it computes."""

    rank: int = 0
    n_ranks: int = 1
    device: torch.device = field(default_factory=lambda: torch.device("cpu"))

    @property
    def leads(self) -> bool:
        """Whether it is the one that measures, writes and prints."""
        return self.rank == 0


@contextmanager
def process_of(config: RunConfig) -> Iterator[Process]:
    """This process: as torchrun says, else alone. Raises ConfigError if there is no GPU for device "cuda"."""
    has_gpu = torch.cuda.is_available()
    if config.device == "cuda" and not has_gpu:
        raise ConfigError("device cuda: torch finds no GPU here; give run.device=cpu")
    if config.n_threads:
        torch.set_num_threads(config.n_threads)
    on_gpu = has_gpu and config.device != "cpu"
    local = int(os.environ.get("LOCAL_RANK", "0"))
    device = torch.device("cuda", local) if on_gpu else torch.device("cpu")
    if int(os.environ.get("WORLD_SIZE", "1")) == 1:
        yield Process(device=device)
        return
    if on_gpu:
        torch.cuda.set_device(device)
    dist.init_process_group("nccl" if on_gpu else "gloo")
    try:
        yield Process(dist.get_rank(), dist.get_world_size(), device)
    finally:
        dist.destroy_process_group()


@dataclass
class _Progress:
    """Where a run stands; a checkpoint has all of it."""

    step: int = 0
    best_loss: float = math.inf
    best_step: int = 0
    best: dict[str, Tensor] = field(default_factory=dict)  # the network's tensors then
    n_worse: int = 0  # measurements since


def train(
    task: TrainingTask, optim: OptimConfig, run: RunConfig, settings: dict[str, Any], folder: Path, process: Process
) -> None:
    """Train `task.net` to the end, or go on with what `folder` holds; leaves the best network in `task.net`.

    Raises RunError if the folder belongs to a run with other settings, or the loss is not a number.
    """
    progress = _Progress()
    task.losses.to(process.device)
    optimizer = torch.optim.AdamW(task.net.parameters(), lr=optim.lr, weight_decay=optim.weight_decay)
    _resume(task, optimizer, progress, settings, folder, process)
    losses: nn.Module = DistributedDataParallel(task.losses) if process.n_ranks > 1 else task.losses
    log = RunLog(folder, progress.step) if process.leads else None
    if log is not None and progress.step:
        print(f"{folder}: goes on at step {progress.step}", flush=True)
    if log is not None:
        print(_banner(task, optim, run, folder, process, progress), flush=True)
    stream = batches(task.stream, optim.batch_size, run.n_workers, progress.step, process.rank, process.n_ranks)
    began, first = time.monotonic(), progress.step
    with ExitStack() as stack:
        if log is not None:
            stack.enter_context(Pulse(lambda: f"step {progress.step} of {optim.n_steps}"))
        while progress.step < optim.n_steps and progress.n_worse < run.patience:
            step = progress.step
            batch = {name: tensor.to(process.device, non_blocking=True) for name, tensor in next(stream).items()}
            terms = _update(losses, optimizer, batch, optim, step)
            if not math.isfinite(terms["loss"]):
                raise RunError(_broken(terms, run.seed, step, optim.batch_size, process))
            progress.step = step + 1
            if log is not None and progress.step % run.log_every == 0:
                log.write(progress.step, "train", {**terms, "lr": optim.lr_at(step)})
                pace = (time.monotonic() - began) / (progress.step - first)
                left = duration(pace * (optim.n_steps - progress.step))
                print(
                    f"step {progress.step}: loss {terms['loss']:.4g}, {optim.batch_size / pace:.0f} samples a second, "
                    f"{left} left at most",
                    flush=True,
                )
            if progress.step % run.eval_every == 0 or progress.step == optim.n_steps:
                _measure(task, progress, log, process)
            if process.leads and (progress.step % run.save_every == 0 or progress.step == optim.n_steps):
                _save(task, optimizer, progress, settings, folder)
    if process.leads:
        _save(task, optimizer, progress, settings, folder)
    task.net.load_state_dict(progress.best)


def _banner(
    task: TrainingTask, optim: OptimConfig, run: RunConfig, folder: Path, process: Process, progress: _Progress
) -> str:
    """What is about to happen."""
    n_weights = sum(p.numel() for p in task.net.parameters())
    due = run.eval_every - progress.step % run.eval_every
    return (
        f"{task.name} in {folder}: {n_weights:,} parameters on {process.device}, {optim.n_steps - progress.step} steps "
        f"of {optim.batch_size * process.n_ranks} samples made by {counted(max(1, run.n_workers), 'process')}\n"
        f"measured on held-out samples every {run.eval_every} steps, first in {min(due, optim.n_steps)}; it ends after "
        f"{run.patience} measurements in a row that are no better"
    )


def _update(
    losses: nn.Module, optimizer: torch.optim.Optimizer, batch: Batch, optim: OptimConfig, step: int
) -> dict[str, float]:
    """One step; the loss and its terms before it. A loss that is not a number changes nothing."""
    for group in optimizer.param_groups:
        group["lr"] = optim.lr_at(step)
    optimizer.zero_grad(set_to_none=True)
    terms: dict[str, Tensor] = losses(batch)
    if bool(torch.isfinite(terms["loss"])):
        terms["loss"].backward()
        nn.utils.clip_grad_norm_([p for group in optimizer.param_groups for p in group["params"]], optim.clip)
        optimizer.step()
    return {name: float(term.detach()) for name, term in terms.items()}


def _broken(terms: dict[str, float], seed: int, step: int, batch_size: int, process: Process) -> str:
    begin = (step * process.n_ranks + process.rank) * batch_size
    odd = [name for name, term in terms.items() if not math.isfinite(term)]
    return (
        f"the loss is {terms['loss']} at step {step} ({', '.join(odd)}): samples {begin}..{begin + batch_size - 1} of "
        f"seed {seed}; go on from the last checkpoint with a lower optim.lr, or look at these samples"
    )


def _measure(task: TrainingTask, progress: _Progress, log: RunLog | None, process: Process) -> None:
    """Measure on the held-out samples, in the leading process; all learn whether it was better."""
    loss = torch.zeros((), dtype=torch.float64, device=process.device)
    if log is not None:
        task.net.eval()
        with torch.no_grad():
            metrics = task.measure(process.device)
            log.write(progress.step, "held_out", metrics)
            log.picture(progress.step, task.draw(process.device))
        task.net.train()
        loss.fill_(metrics["loss"])
        best = f"the best was {progress.best_loss:.4g}" if math.isfinite(progress.best_loss) else "the first"
        print(
            f"step {progress.step}: held-out loss {metrics['loss']:.4g} ({best}); all metrics in log.jsonl", flush=True
        )
    if process.n_ranks > 1:
        dist.broadcast(loss, 0)
    if not math.isfinite(float(loss)):
        raise RunError(f"the held-out loss is {float(loss)} at step {progress.step}; begin anew with a lower optim.lr")
    progress.n_worse += 1
    if float(loss) < progress.best_loss:
        progress.best_loss, progress.best_step, progress.n_worse = float(loss), progress.step, 0
        progress.best = {name: tensor.detach().cpu().clone() for name, tensor in task.net.state_dict().items()}


# --- checkpoints ---


def _checkpoint(folder: Path) -> Path:
    return folder / "checkpoint.pt"


def _save(
    task: TrainingTask, optimizer: torch.optim.Optimizer, progress: _Progress, settings: dict[str, Any], folder: Path
) -> None:
    buffer = BytesIO()
    state = {
        "settings": settings,
        "net": task.net.state_dict(),
        "optimizer": optimizer.state_dict(),
        "progress": vars(progress),
    }
    torch.save(state, buffer)
    write_atomically(_checkpoint(folder), buffer.getvalue())


def _resume(
    task: TrainingTask,
    optimizer: torch.optim.Optimizer,
    progress: _Progress,
    settings: dict[str, Any],
    folder: Path,
    process: Process,
) -> None:
    """Put everything as the folder's checkpoint has it, if there is one."""
    path = _checkpoint(folder)
    if not path.exists():
        if process.leads:
            claim_run(folder, settings, _HARMLESS)
        return
    try:
        state = torch.load(path, map_location=process.device, weights_only=True)
        known, saved = state["settings"], state["progress"]
    except Exception as error:  # torch raises whatever the damage leads it to
        raise RunError(f"cannot read {path} ({type(error).__name__}); delete it to begin anew") from None
    check_same_run(folder, known, settings, _HARMLESS)
    task.net.load_state_dict(state["net"])
    optimizer.load_state_dict(state["optimizer"])
    vars(progress).update(saved)
