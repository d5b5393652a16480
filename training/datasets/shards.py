"""Data sets of targets on disk: the format of their shards, and how to read them.

    DIR/dataset.json         what is in it: settings, and for every shard its number of targets and SHA-256
    DIR/shard-00000.npz ...  the targets, `shard_size` in each, the last one maybe fewer

A shard is an .npz without pickles. Letters: N targets of a shard, R pixels a side.

    masks       (N, R, R/8) uint8   the silhouettes, 8 pixels a byte (`numpy.packbits` along the rows)
    indices     (N,) int64          which target of the data set each is
    seeds       (N,) int64          the seed of its source
    difficulty  (N,) int64          changes of the outline in its construction; -1 if it is not known how it was made
    names       (N,) str
    sequences   (B,) uint8          the JSON of all construction sequences, UTF-8, one after the other
    ends        (N+1,) int64        target k has the bytes from ends[k] to ends[k+1]: none if its sequence is not known
"""

import hashlib
import io
import json
import os
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, TypeAdapter, ValidationError

from autopoly_env.arguments import first_defect
from autopoly_env.arrays import BoolArray
from autopoly_env.errors import RunError
from autopoly_env.files import write_atomically
from autopoly_env.sequence import ConstructionSequence

FORMAT, VERSION = "autopoly-dataset", 1
MANIFEST = "dataset.json"
UNKNOWN = -1  # as a difficulty


@dataclass(frozen=True)
class Example:
    """One target."""

    index: int  # in its data set
    seed: int  # of its source
    name: str
    mask: BoolArray  # (R, R), True is object
    difficulty: int | None  # changes of the outline; None if it is not known how it was made
    sequence_json: str | None

    @property
    def sequence(self) -> ConstructionSequence | None:
        """How it was made, replayed as a check. Raises SequenceError for a damaged one."""
        return None if self.sequence_json is None else ConstructionSequence.from_json(self.sequence_json)


@dataclass(frozen=True)
class ShardInfo:
    """What the manifest says of a shard."""

    name: str
    n: int
    sha256: str


@dataclass(frozen=True)
class Manifest:
    """What dataset.json says; `settings` is what the targets were made with."""

    settings: dict[str, Any]
    n: Annotated[int, Field(ge=1)]
    shard_size: Annotated[int, Field(ge=1)]
    shards: tuple[ShardInfo, ...] = ()  # those that are done, by their names

    @property
    def names(self) -> list[str]:
        """The names of all shards, done or not."""
        return [f"shard-{k:05}.npz" for k in range(-(-self.n // self.shard_size))]

    def indices(self, name: str) -> range:
        """The targets of a shard."""
        first = self.shard_size * self.names.index(name)
        return range(first, min(first + self.shard_size, self.n))

    def write(self, folder: Path) -> None:
        """Write DIR/dataset.json, whole or not at all. Raises OutputError."""
        text = json.dumps({"format": FORMAT, "version": VERSION, **asdict(self)}, indent=1, allow_nan=False)
        write_atomically(folder / MANIFEST, text + "\n")


_MANIFEST = TypeAdapter(Manifest)


def read_manifest(folder: str | os.PathLike[str]) -> Manifest:
    """What a data set consists of. Raises RunError if there is none, or one of another version, or a damaged one."""
    path = Path(folder) / MANIFEST
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise RunError(f"cannot read {path} ({error.strerror}); give a folder of training.make_dataset") from None
    except (ValueError, RecursionError):
        raise RunError(f"{path} is damaged: expected JSON; make the data set anew") from None
    if not isinstance(values, dict) or values.pop("format", None) != FORMAT:
        raise RunError(f"{path}: expected the format {FORMAT!r}; give a folder of training.make_dataset")
    version = values.pop("version", None)
    if version != VERSION:
        raise RunError(f"{path} has version {version!r}, this program reads {VERSION}; make the data set anew")
    try:
        manifest = _MANIFEST.validate_python(values)
    except ValidationError as error:
        raise RunError(f"{path} is damaged: {first_defect(error)}") from None
    strange = sorted({shard.name for shard in manifest.shards}.difference(manifest.names))
    if strange:
        raise RunError(f"{path} is damaged: it names the shard {strange[0]!r}; make the data set anew")
    return manifest


def read_shards(folder: str | os.PathLike[str], *, partial: bool = False) -> Iterator[Example]:
    """The targets of a data set in their order, a shard at a time in memory; every checksum is checked.

    `partial`: take what is there of a data set that is not complete. Raises RunError for one that is not complete, for
    a shard that is missing or damaged.

    >>> for example in read_shards("data/train"):
    ...     print(example.name, example.mask.shape, len(example.sequence.steps))
    construction_0 (64, 64) 4
    construction_1 (64, 64) 2
    """
    manifest = read_manifest(folder)
    n_missing = len(manifest.names) - len(manifest.shards)
    if n_missing and not partial:
        raise RunError(f"{folder}: {n_missing} of {len(manifest.names)} shards are not made yet; go on with --resume")
    for shard in sorted(manifest.shards, key=lambda shard: shard.name):
        yield from read_shard(folder, manifest, shard)


def read_shard(folder: str | os.PathLike[str], manifest: Manifest, shard: ShardInfo) -> list[Example]:
    """The targets of a shard. Raises RunError if it is missing, is not what the manifest says, or is damaged."""
    path = Path(folder) / shard.name
    try:
        data = path.read_bytes()
    except OSError as error:
        raise RunError(f"cannot read {path} ({error.strerror}); make it again with --resume") from None
    if checksum(data) != shard.sha256:
        raise RunError(f"{path} is damaged: its SHA-256 is not that of the manifest; make it again with --resume")
    try:
        examples = unpack(data)
    except Exception as error:  # numpy and zipfile raise almost anything
        raise RunError(f"{path} is no shard ({' '.join(str(error).split())}); make the data set anew") from None
    if [example.index for example in examples] != list(manifest.indices(shard.name)):
        raise RunError(f"{path} holds other targets than the manifest says; make the data set anew")
    return examples


def checksum(data: bytes) -> str:
    """SHA-256, in hexadecimal."""
    return hashlib.sha256(data).hexdigest()


def pack(examples: Sequence[Example]) -> bytes:
    """The bytes of a shard; the same examples give the same bytes."""
    texts = [(example.sequence_json or "").encode() for example in examples]
    stream = io.BytesIO()
    np.savez_compressed(
        stream,
        masks=np.packbits([example.mask for example in examples], axis=2),
        indices=np.array([example.index for example in examples], np.int64),
        seeds=np.array([example.seed for example in examples], np.int64),
        difficulty=np.array([UNKNOWN if e.difficulty is None else e.difficulty for e in examples], np.int64),
        names=np.array([example.name for example in examples], np.str_),
        sequences=np.frombuffer(b"".join(texts), np.uint8),
        ends=np.cumsum([0, *map(len, texts)]),
    )
    return stream.getvalue()


def unpack(data: bytes) -> list[Example]:
    """The examples in the bytes of a shard. Raises almost anything for other bytes; never unpickles."""
    with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
        masks, ends = arrays["masks"], arrays["ends"].tolist()
        text = arrays["sequences"].tobytes()
        rows = zip(
            arrays["indices"].tolist(),
            arrays["seeds"].tolist(),
            arrays["names"].tolist(),
            np.unpackbits(masks, axis=2, count=masks.shape[1]).astype(np.bool_),
            arrays["difficulty"].tolist(),
            [text[begin:end].decode() for begin, end in pairwise(ends)],
            strict=True,
        )
        return [
            Example(index, seed, name, mask, None if difficulty == UNKNOWN else difficulty, sequence or None)
            for index, seed, name, mask, difficulty, sequence in rows
        ]
