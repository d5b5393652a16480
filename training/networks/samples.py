"""From a labelled construction to what the networks read: pictures and numbers, batches of them, endless streams.

Sample i of a stream depends on (seed, i) alone, however many processes make it. Letters: B batch, n stages, S pixels a
side, K operator classes, A actions, P points of each, Q vertices, E edges.
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import torch
from torch import Tensor
from torch.utils.data import DataLoader, Dataset, Sampler

from agents.guided.config import CLASSES, STOP_CLASS, NfapConfig, WarpConfig, class_of
from agents.guided.measures import candidate_arrays
from agents.guided.pictures import draw_inputs, rendering
from agents.guided.regions import region_image
from autopoly_env.compute import set_threads
from autopoly_env.errors import ConfigError, IllegalActionError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import OPERATORS, STOP, Action
from autopoly_env.placement import Disagreement, starts
from training.networks.labelling import SourceConfig, build_trajectory
from training.networks.trajectories import Labelled, Shard, Trajectory

Sample = dict[str, np.ndarray]
Batch = dict[str, Tensor]
_HELD_OUT_BATCH = 64
_UNLIKELY = 0.1  # of the odds of the likeliest action: what is below has no part in the expected region
_PADDING = {"classes": -1, "edges": -1}  # of rows that a sample does not have; 0 otherwise


@dataclass(frozen=True)
class LabelConfig:
    """How outcomes become probabilities."""

    temperature: float = 0.5  # r_all points: of the softmax over what the actions gain, 0 for stopping
    w_sm: float = 100.0
    w_sc: float = 0.3
    w_si: float = 5.0

    def __post_init__(self) -> None:
        if not self.temperature > 0.0 or min(self.w_sm, self.w_sc, self.w_si) < 0.0:
            raise ConfigError(f"{self}: expected a temperature above 0 and weights of at least 0")

    def gains(self, state: Labelled) -> np.ndarray:
        """(A,) what each action adds to r_all; -infinity where it is not known."""
        weights = np.array((self.w_sm, -self.w_sc, -self.w_si))
        gains = (state.outcomes - state.score) @ weights
        return np.where(np.isnan(gains), -np.inf, gains)

    def policy(self, state: Labelled) -> np.ndarray:
        """(1+A,) probabilities of stopping and of each action: of the outcomes, or all on the one that was taken."""
        gains = np.concatenate(([0.0], self.gains(state)))
        if not np.isfinite(gains[1:]).any():
            odds = np.zeros(len(gains))
            odds[state.chosen + 1] = 1.0
            return odds
        odds = np.exp((gains - gains.max()) / self.temperature)
        return odds / odds.sum()


# --- one sample ---


def nfap_sample(trajectory: Trajectory, k: int, config: NfapConfig, labels: LabelConfig) -> Sample:
    """What nFAP-Net reads in state k, and the truth of its n stages; see `agents.guided.nfap.NfapLabels`."""
    size, state = config.image_size, trajectory.states[k]
    classes = np.array([class_of(action) for action in state.actions])
    policy = labels.policy(state)
    first = np.bincount(classes, policy[1:], len(CLASSES))
    first[STOP_CLASS] = policy[0]
    images, regions, operators = zip(*_stages(trajectory, k, config), strict=True)
    expected = _expected_region(state, policy[1:] * (classes == operators[0]), config.image_size)
    moving = policy[1:].sum()
    gains = labels.gains(state)
    return {
        "pictures": draw_inputs(state.mesh, trajectory.silhouette.target(size).coverage, config.inputs),
        "images": np.stack(images),
        "regions": np.stack((expected, *regions[1:])),
        "operators": np.array(operators),
        "first": first.astype(np.float32),
        **candidate_arrays(Disagreement(state.mesh, trajectory.silhouette), state.actions),
        "log_residual": state.log_residual,
        "policy": (policy[1:] / moving if moving > 1e-6 else 0.0 * policy[1:]).astype(np.float32),
        "gains": np.where(np.isfinite(gains), gains, -1e3).astype(np.float32),
    }


def _expected_region(state: Labelled, odds: np.ndarray, size: int) -> np.ndarray:
    """(S, S) the mean region of the actions, by their odds (A,); unlikely ones left out. All 0 if all odds are."""
    likely = odds > _UNLIKELY * odds.max(initial=0.0)
    shares = np.where(likely, odds, 0.0) / max(odds[likely].sum(), 1e-12)
    region = np.zeros((size, size), np.float32)
    for row in np.flatnonzero(likely):
        region += np.float32(shares[row]) * region_image(state.mesh, state.actions[row], size)
    return region


def _stages(trajectory: Trajectory, k: int, config: NfapConfig) -> Iterator[tuple[np.ndarray, np.ndarray, int]]:
    """Image after the action, region, class of each stage."""
    for stage in range(k, k + config.n):
        state = trajectory.states[min(stage, trajectory.n_actions)]
        action = state.actions[state.chosen] if stage < trajectory.n_actions else STOP
        after = trajectory.states[min(stage + 1, trajectory.n_actions)].mesh
        yield (
            rendering(after, config.image_size),
            region_image(state.mesh, action, config.image_size),
            class_of(action),
        )


def warp_sample(trajectory: Trajectory, k: int, config: WarpConfig, placed: bool) -> Sample:
    """What WarpNet reads after the action that was taken in state k; see `agents.guided.warp.WarpLabels`.

    `placed`: new vertices begin where rendering and target disagree, otherwise where the operator puts them. "full" is
    the rendering after the full refit.
    """
    state, size = trajectory.states[k], config.image_size
    mesh = start_mesh(trajectory, state, placed)
    target = trajectory.silhouette.target(size).coverage.astype(np.float32)
    return {
        "pictures": np.stack((rendering(mesh, size), target)),
        "vertices": mesh.vertices.astype(np.float32),
        "edges": mesh.topology.boundary_half_edges,
        "full": rendering(trajectory.states[k + 1].mesh, size),
    }


def start_mesh(trajectory: Trajectory, state: Labelled, placed: bool) -> PolyMesh:
    """The mesh after the action that was taken, before any refit."""
    action: Action = state.actions[state.chosen]
    try:
        if placed:
            return starts(Disagreement(state.mesh, trajectory.silhouette), action)[0][1]
        return OPERATORS[action.operator].apply(state.mesh, action.element)
    except IllegalActionError:  # a hole that fits nowhere but where the sequence has it
        return state.mesh


# --- symmetry: eight ways to look at the same construction ---


def turned(sample: Sample, way: int) -> Sample:
    """The sample mirrored (bit 0: x, bit 1: y) and transposed (bit 2)."""
    return {name: _turned(name, array, way) for name, array in sample.items()}


def _turned(name: str, array: np.ndarray, way: int) -> np.ndarray:
    mirror_x, mirror_y, transpose = way & 1, way & 2, way & 4
    if name in ("pictures", "images", "regions", "full"):
        array = array[..., ::-1] if mirror_x else array
        array = array[..., ::-1, :] if mirror_y else array
        return np.ascontiguousarray(np.swapaxes(array, -1, -2) if transpose else array)
    if name in ("points", "spots", "vertices"):
        at = array.copy()
        at[..., 0] = 1.0 - at[..., 0] if mirror_x else at[..., 0]
        at[..., 1] = 1.0 - at[..., 1] if mirror_y else at[..., 1]
        return np.ascontiguousarray(at[..., ::-1] if transpose else at)
    if name == "edges" and way.bit_count() % 2:  # so that areas stay positive
        return np.ascontiguousarray(array[:, ::-1])
    return array


# --- where trajectories come from ---


class Trajectories(Protocol):
    """Some constructions to draw samples from."""

    def draw(self, rng: np.random.Generator) -> Trajectory: ...


@dataclass(frozen=True)
class Live:
    """Endless: every construction is made when it is drawn."""

    config: SourceConfig
    held_out: bool = False

    def draw(self, rng: np.random.Generator) -> Trajectory:
        return build_trajectory(self.config, int(rng.integers(2**31)), self.held_out)


class Stored:
    """The constructions of shards on disk."""

    def __init__(self, paths: Sequence[Path]) -> None:
        self._shards = [Shard.load(path) for path in paths]
        self._ends = np.cumsum([len(shard) for shard in self._shards])

    def __len__(self) -> int:
        return int(self._ends[-1])

    def __getitem__(self, number: int) -> Trajectory:
        shard = int(np.searchsorted(self._ends, number, "right"))
        return self._shards[shard][number - int(self._ends[shard - 1]) if shard else number]

    def draw(self, rng: np.random.Generator) -> Trajectory:
        return self[int(rng.integers(len(self)))]


def stored(folder: str, held_out: bool = False) -> Stored:
    """The shards of a folder: to learn from, or of held-out targets, to measure with.

    Raises ConfigError if there are none, if one is damaged, or if the folder says that they are for the other use.
    """
    paths = sorted(Path(folder).glob("*.npz"))
    if not paths:
        raise ConfigError(f"no shards (*.npz) in {folder}; make some with python -m training.make_expert {folder}")
    if _are_held_out(Path(folder)) is (not held_out):
        kind, option = ("targets to learn from", "with") if held_out else ("held-out targets", "without")
        raise ConfigError(f"{folder} has shards of {kind} (meta.json); give some that were made {option} --held-out")
    return Stored(paths)


def _are_held_out(folder: Path) -> bool | None:
    """Whether a folder's shards are of held-out targets; None where nothing legible says so."""
    try:
        said = json.loads((folder / "meta.json").read_text(encoding="utf-8"))["held_out"]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return said if isinstance(said, bool) else None


# --- streams ---


@dataclass(frozen=True)
class NfapStream(Dataset[Sample]):
    """Samples of nFAP-Net by number."""

    trajectories: Trajectories
    network: NfapConfig
    labels: LabelConfig
    seed: int
    turn: bool = True  # one of the eight symmetries for each sample

    def __getitem__(self, i: int) -> Sample:
        rng = np.random.default_rng((self.seed, i))
        trajectory, k = _window(self.trajectories, rng, self.network.n)
        sample = nfap_sample(trajectory, k, self.network, self.labels)
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


def _stacked(name: str, arrays: Sequence[np.ndarray]) -> np.ndarray:
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
