"""Endless streams of samples: where their constructions come from, drawing, turning, batching.

Sample i of a stream depends on (seed, i) alone, however many processes make it. Letters: B batch, W processes.
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import torch
from torch import Tensor
from torch.utils.data import DataLoader, Dataset, Sampler

from agents.guided.config import NfapConfig, WarpConfig
from autopoly_env.arrays import AnyArray
from autopoly_env.compute import set_threads
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import FaceRule, face_rule
from autopoly_env.operators import operator_named, preset
from autopoly_env.workers import no_interrupts
from training.networks.labelling import SourceConfig, build_trajectory
from training.networks.prices import drawn_price
from training.networks.samples import LabelConfig, Sample, nfap_sample, turned, warp_sample
from training.networks.trajectories import Shard, Trajectory

Batch = dict[str, Tensor]
_HELD_OUT_BATCH = 64
_PADDING = {"classes": -1, "edges": -1}  # of rows that a sample does not have; 0 otherwise


# --- where trajectories come from ---


class Trajectories(Protocol):
    """Some constructions to draw samples from."""

    @property
    def rules(self) -> set[FaceRule]:
        """The rules of faces that they keep."""
        ...

    @property
    def operators(self) -> set[str]:
        """Names of the operators of their actions."""
        ...

    def draw(self, rng: np.random.Generator) -> Trajectory: ...


@dataclass(frozen=True)
class Live:
    """Endless: every construction is made when it is drawn."""

    config: SourceConfig
    held_out: bool = False

    @property
    def rules(self) -> set[FaceRule]:
        return {self.config.faces}

    @property
    def operators(self) -> set[str]:
        return {operator.name for operator in preset(self.config.operators)}

    def draw(self, rng: np.random.Generator) -> Trajectory:
        return build_trajectory(self.config, int(rng.integers(2**31)), self.held_out)


class Stored:
    """The constructions of shards on disk."""

    def __init__(self, paths: Sequence[Path]) -> None:
        self._shards = [Shard.load(path) for path in paths]
        self._ends = np.cumsum([len(shard) for shard in self._shards])

    def __len__(self) -> int:
        return int(self._ends[-1])

    @property
    def rules(self) -> set[FaceRule]:
        return {rule for shard in self._shards for rule in shard.rules}

    @property
    def operators(self) -> set[str]:
        return {name for shard in self._shards for name in shard.operators}

    def __getitem__(self, number: int) -> Trajectory:
        shard = int(np.searchsorted(self._ends, number, "right"))
        return self._shards[shard][number - int(self._ends[shard - 1]) if shard else number]

    def draw(self, rng: np.random.Generator) -> Trajectory:
        return self[int(rng.integers(len(self)))]


@dataclass(frozen=True)
class Made:
    """Under which rules the constructions of shards were made."""

    operators: str = "full"
    faces: FaceRule = "any"

    @classmethod
    def of(cls, folder: str) -> "Made":
        """As the folder's meta.json says; where nothing legible says so, as they were made before it did."""
        try:
            source = json.loads((Path(folder) / "meta.json").read_text(encoding="utf-8"))["source"]
            return cls(source["operators"], face_rule(source.get("faces", "any")))
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            return cls()


def stored(folders: str | Sequence[str], held_out: bool = False) -> Stored:
    """The shards of a folder or of several: to learn from, or of held-out targets, to measure with.

    Raises ConfigError if one has none, if one is damaged, or if a folder says that they are for the other use.
    """
    names = [folders] if isinstance(folders, str) else folders
    return Stored([path for folder in names for path in _shards_in(folder, held_out)])


def _shards_in(folder: str, held_out: bool) -> list[Path]:
    paths = sorted(Path(folder).glob("*.npz"))
    if not paths:
        raise ConfigError(f"no shards (*.npz) in {folder}; make some with python -m training.make_expert {folder}")
    if _are_held_out(Path(folder)) is (not held_out):
        kind, option = ("targets to learn from", "with") if held_out else ("held-out targets", "without")
        raise ConfigError(f"{folder} has shards of {kind} (meta.json); give some that were made {option} --held-out")
    return paths


def _are_held_out(folder: Path) -> bool | None:
    """Whether a folder's shards are of held-out targets; None where nothing legible says so."""
    try:
        said = json.loads((folder / "meta.json").read_text(encoding="utf-8"))["held_out"]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return said if isinstance(said, bool) else None


@dataclass(frozen=True)
class DataConfig:
    """Where samples come from."""

    shards: str | tuple[str, ...] = ""  # a folder of make_expert, or several; empty: samples are made when needed
    held_out: str | tuple[str, ...] = ""  # the same of held-out targets
    n_held_out: int = 512  # samples to measure with, rounded up to whole batches of 64
    source: SourceConfig = field(default_factory=SourceConfig)  # of samples that are not in shards

    def __post_init__(self) -> None:
        if self.n_held_out < 1:
            raise ConfigError(f"n_held_out {self.n_held_out}: expected at least 1 sample")

    def trajectories(self) -> tuple[Trajectories, Trajectories]:
        """To train with, and to measure with. Raises ConfigError if a folder has no shards."""
        learn: Trajectories = stored(self.shards) if self.shards else Live(self.source)
        test: Trajectories = stored(self.held_out, held_out=True) if self.held_out else Live(self.source, held_out=True)
        return learn, test


# --- streams ---


@dataclass(frozen=True)
class NfapStream(Dataset[Sample]):
    """Samples of nFAP-Net by number."""

    trajectories: Trajectories
    network: NfapConfig
    labels: LabelConfig
    seed: int
    turn: bool = True  # one of the eight symmetries for each sample

    def __post_init__(self) -> None:
        """Raise ConfigError where the network does not know the data's operators, rule of faces or prices."""
        check_known(self.network, self.labels, self.trajectories)

    def __getitem__(self, i: int) -> Sample:
        rng = np.random.default_rng((self.seed, i))
        trajectory, k = _window(self.trajectories, rng, self.network.n)
        w_sc = drawn_price(rng, *self.labels.prices)
        sample = nfap_sample(trajectory, k, self.network, self.labels, w_sc)
        return turned(sample, int(rng.integers(8)) if self.turn else 0)


@dataclass(frozen=True)
class WarpStream(Dataset[Sample]):
    """Samples of WarpNet by number."""

    trajectories: Trajectories
    network: WarpConfig
    seed: int
    placed_share: float = 1.0  # of the samples whose new vertices begin where rendering and target disagree
    turn: bool = True

    def __getitem__(self, i: int) -> Sample:
        rng = np.random.default_rng((self.seed, i))
        trajectory, k = _window(self.trajectories, rng, 1, moving=True)
        sample = warp_sample(trajectory, k, self.network, bool(rng.random() < self.placed_share))
        return turned(sample, int(rng.integers(8)) if self.turn else 0)


def check_known(network: NfapConfig, labels: LabelConfig, trajectories: Trajectories) -> None:
    """Raise ConfigError unless the network knows the labels' prices and the rules and operators of what is labelled."""
    rules, odd = network.rules or ("any",), sorted(trajectories.rules - {*(network.rules or ("any",))})
    if odd:
        raise ConfigError(
            f"the data keeps faces={odd[0]}, the network knows faces={', '.join(rules)}: add it with net.rules, or "
            "give other shards"
        )
    classes = [name for operator in sorted(trajectories.operators) for name in operator_named(operator).classes]
    unknown = [name for name in classes if name not in network.classes]
    if unknown:
        raise ConfigError(
            f"the data has actions of {unknown[0]}, the network's classes are {', '.join(network.classes)}: "
            "add it to them with net.classes"
        )
    low, high = labels.prices
    known = network.w_sc or (low, low)
    if not known[0] <= low <= high <= known[1]:
        said = "is told no price" if network.w_sc is None else f"knows w_sc {known[0]:g} to {known[1]:g}"
        raise ConfigError(f"the labels are for w_sc {low:g} to {high:g}, the network {said}: give another net.w_sc")


@dataclass(frozen=True)
class InTurn(Dataset[Sample]):
    """Samples of several streams in turn."""

    streams: Sequence[Dataset[Sample]]

    def __getitem__(self, i: int) -> Sample:
        return self.streams[i % len(self.streams)][i // len(self.streams)]


def _window(
    trajectories: Trajectories, rng: np.random.Generator, n: int, moving: bool = False
) -> tuple[Trajectory, int]:
    """A random construction and a random window of it; `moving`: an action is taken in its first state."""
    while True:
        trajectory = trajectories.draw(rng)
        windows = [k for k in trajectory.windows(n) if not moving or k < trajectory.n_actions]
        if windows:
            return trajectory, windows[int(rng.integers(len(windows)))]


def collate(samples: Sequence[Sample]) -> Batch:
    """A batch; arrays whose first axis counts actions, vertices or edges are padded to the longest."""
    return {name: torch.from_numpy(_stacked(name, [sample[name] for sample in samples])) for name in samples[0]}


def _stacked(name: str, arrays: Sequence[AnyArray]) -> AnyArray:
    longest = max(len(array) for array in arrays)
    batch = np.full((len(arrays), longest, *arrays[0].shape[1:]), _PADDING.get(name, 0), arrays[0].dtype)
    for row, array in zip(batch, arrays, strict=True):
        row[: len(array)] = array
    return batch


class _Numbers(Sampler[list[int]]):
    """The numbers of every batch from step `first` on: each of W processes takes its own part of a step's B W."""

    def __init__(self, batch_size: int, first: int, rank: int, n_ranks: int) -> None:
        self._batch_size, self._first, self._rank, self._n_ranks = batch_size, first, rank, n_ranks

    def __iter__(self) -> Iterator[list[int]]:
        step = self._first
        while True:
            begin = (step * self._n_ranks + self._rank) * self._batch_size
            yield list(range(begin, begin + self._batch_size))
            step += 1


def batches(
    stream: Dataset[Any], batch_size: int, n_workers: int, first_step: int = 0, rank: int = 0, n_ranks: int = 1
) -> Iterator[Batch]:
    """Endless batches of a stream from a step on; with workers, made ahead in processes of one thread each."""
    loader: DataLoader[Sample] = DataLoader(
        stream,
        batch_sampler=_Numbers(batch_size, first_step, rank, n_ranks),
        num_workers=n_workers,
        collate_fn=collate,
        multiprocessing_context="spawn" if n_workers else None,
        worker_init_fn=_one_thread,
        prefetch_factor=4 if n_workers else None,
    )
    with no_interrupts():  # workers, which import for seconds before they do anything, leave Ctrl-C to this process
        return iter(loader)


class HeldOut:
    """The samples to measure with: n of a stream, rounded up to whole batches; made once, when they are asked for."""

    def __init__(self, stream: Dataset[Any], n: int) -> None:
        self._stream, self._n, self._made = stream, n, list[Batch]()

    def batches(self, device: torch.device) -> Iterator[Batch]:
        """The batches, on a device."""
        if not self._made:
            source = batches(self._stream, min(_HELD_OUT_BATCH, self._n), 0)
            self._made = [next(source) for _ in range(-(-self._n // _HELD_OUT_BATCH))]
        for batch in self._made:
            yield {name: tensor.to(device) for name, tensor in batch.items()}

    def first(self, n: int, device: torch.device) -> Batch:
        """The first n samples, at most a batch, on a device."""
        return {name: tensor[:n] for name, tensor in next(self.batches(device)).items()}


def _one_thread(_worker: int) -> None:
    torch.set_num_threads(1)
    set_threads(1)
