"""Making a data set: its shards in parallel, each whole or not at all; a run that was killed goes on where it was.

Target number i depends on the settings and i alone, not on shards, workers or what was made before.
"""

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Literal

from autopoly_env.arguments import one_of, whole
from autopoly_env.errors import AutoPolyError, ConfigError, OutputError, RunError
from autopoly_env.files import write_atomically
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.targets import HELD_OUT, LEARNING, SPLITS, ConstructionTargets, ObjectTargets
from training.datasets.shards import MANIFEST, Example, Manifest, ShardInfo, checksum, pack, read_manifest, read_shard
from training.parallel import map_tasks

MAX_N = 2**22  # targets of a data set: as many seeds does it have to itself
MAX_SEED = 2**8 - 1
SEEDS = {"train": LEARNING, "validation": HELD_OUT, "test": SPLITS["test"]}  # of each split of a data set


@dataclass(frozen=True)
class DatasetSettings:
    """What the targets of a data set are. No two seeds or splits share a target."""

    kind: Literal["constructions", "objects"]
    split: str = "train"
    seed: int = 0
    resolution: int = 128
    difficulty: tuple[int, int] = (1, 5)  # of constructions
    operators: str = "paper"  # of constructions
    families: str | None = None  # of objects

    def __post_init__(self) -> None:
        one_of("split", self.split, tuple(SEEDS))
        if not 0 <= self.seed <= MAX_SEED:
            raise ConfigError(f"seed {self.seed}: expected 0 to {MAX_SEED}")
        self.source()

    def source(self) -> ConstructionTargets | ObjectTargets:
        """Where the targets come from. Raises ConfigError for settings that it does not take."""
        if self.kind == "objects":
            return ObjectTargets(self.families, self.resolution)
        return ConstructionTargets(self.difficulty, self.operators, self.resolution)

    def source_seed(self, index: int) -> int:
        """The source's seed of target number `index`, 0 <= index < MAX_N."""
        return SEEDS[self.split][self.seed * MAX_N + index]

    def example(self, index: int) -> Example:
        """Target number `index`."""
        source, seed = self.source(), self.source_seed(index)
        silhouette = source.sample(seed)
        if isinstance(source, ObjectTargets):
            return Example(index, seed, silhouette.name, silhouette.mask, None, None)
        sequence = source.sample_sequence(seed)
        changes = _n_changes(sequence)
        return Example(index, seed, silhouette.name, silhouette.mask, changes, sequence.to_json())


@dataclass(frozen=True)
class ShardTask:
    """One shard to be made."""

    settings: DatasetSettings
    name: str
    indices: range


def make_shard(task: ShardTask) -> bytes:
    """The bytes of a shard."""
    return pack([task.settings.example(index) for index in task.indices])


def begin_dataset(
    folder: Path, settings: DatasetSettings, n: int, shard_size: int, *, resume: bool, fresh: bool
) -> Manifest:
    """The manifest to go on from, written; `resume` keeps the shards that are whole, `fresh` removes them all.

    Raises ConfigError if the folder has a data set and neither is asked for, or one of other settings; RunError if its
    manifest cannot be read.
    """
    whole("n", n, 1)
    whole("shard_size", shard_size, 1)
    if n > MAX_N:
        raise ConfigError(f"n={n}: expected at most {MAX_N} targets; make another data set with another seed")
    manifest = Manifest(_plain(settings), n, shard_size)
    if (folder / MANIFEST).exists() and not fresh:
        manifest = _resumed(folder, manifest, resume)
    elif fresh:
        _remove(folder)
    manifest.write(folder)
    return manifest


def build_dataset(
    folder: Path,
    settings: DatasetSettings,
    manifest: Manifest,
    *,
    engine: str = "process",
    n_workers: int | None = None,
    address: str | None = None,
    on_shard: Callable[[ShardInfo | None, str | None], None],
) -> Manifest:
    """Make the shards that are missing; `on_shard` is told of each that is done, or why it is not.

    Raises OutputError for a full disk; what is written by then stays.
    """
    done = {shard.name: shard for shard in manifest.shards}
    tasks = [ShardTask(settings, name, manifest.indices(name)) for name in manifest.names if name not in done]
    for result in map_tasks(make_shard, tasks, engine=engine, n_workers=n_workers, address=address):
        name = result.task.name
        if result.value is None:
            on_shard(None, f"{name}: {result.error}")
            continue
        write_atomically(folder / name, result.value)
        done[name] = ShardInfo(name, len(result.task.indices), checksum(result.value))
        manifest = replace(manifest, shards=tuple(done[key] for key in sorted(done)))
        manifest.write(folder)
        on_shard(done[name], None)
    return manifest


def check_dataset(folder: Path) -> Iterator[tuple[str, str | None]]:
    """(shard, what is wrong with it or None) of every shard that there should be.

    Raises RunError if the manifest cannot be read.
    """
    manifest = read_manifest(folder)
    listed = {shard.name: shard for shard in manifest.shards}
    for name in manifest.names:
        if name not in listed:
            yield name, f"{folder / name} is not made yet; go on with --resume"
            continue
        try:
            for example in read_shard(folder, manifest, listed[name]):
                _ = example.sequence
        except AutoPolyError as error:
            yield name, str(error)
        else:
            yield name, None


def _resumed(folder: Path, wanted: Manifest, resume: bool) -> Manifest:
    there = read_manifest(folder)
    if not resume:
        raise ConfigError(f"{folder} holds a data set; go on with --resume, begin anew with --fresh, or give another")
    for what, old, new in (
        ("settings", there.settings, wanted.settings),
        ("n", there.n, wanted.n),
        ("shard_size", there.shard_size, wanted.shard_size),
    ):
        if old != new:
            raise ConfigError(
                f"{folder} was begun with {what} {old}, not {new}; give those, or begin anew with --fresh"
            )
    return replace(there, shards=tuple(shard for shard in there.shards if _is_whole(folder, there, shard)))


def _is_whole(folder: Path, manifest: Manifest, shard: ShardInfo) -> bool:
    try:
        read_shard(folder, manifest, shard)
    except RunError:
        return False
    return True


def _remove(folder: Path) -> None:
    """Remove a data set, and nothing else that may be in its folder."""
    try:
        (folder / MANIFEST).unlink(missing_ok=True)
        for path in folder.glob("shard-*.npz"):
            path.unlink()
    except OSError as error:
        raise OutputError(f"cannot remove the data set in {folder} ({error.strerror}); give another folder") from None


def _plain(settings: DatasetSettings) -> dict[str, object]:
    """The settings that matter for their kind, as JSON gives them back."""
    values = {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(settings).items()}
    other = ("families",) if settings.kind == "constructions" else ("difficulty", "operators")
    return {name: value for name, value in values.items() if name not in other}


def _n_changes(sequence: ConstructionSequence) -> int:
    """Steps that change the outline: a split shows nothing, it goes with the deletion of one of its parts."""
    return sum(step.operator != "face_split" for step in sequence.steps)
