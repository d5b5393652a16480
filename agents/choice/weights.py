"""Weights of ChoiceNet: read and written with NumPy alone."""

import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from agents.choice.config import ChoiceConfig
from agents.choice.network import shapes_of
from agents.weights_meta import (
    WeightsMeta,
    check_shapes,
    not_a_number,
    packed,
    read_bytes,
    read_meta,
    settings_of,
    unpacked,
    write_pair,
)
from autopoly_env.arrays import AnyArray
from autopoly_env.errors import ConfigError

SHIPPED = Path(__file__).parent / "weights"
KIND = "choice"


@dataclass(frozen=True, kw_only=True)
class ChoiceMeta(WeightsMeta):
    """What stands beside the weights: what they may be asked about is in `config`."""

    hint: ClassVar[str] = "train them with python -m training.improve (docs/learning.md) or give another path"

    kind: str
    config: dict[str, Any]  # ChoiceConfig


@dataclass(frozen=True)
class ChoiceWeights:
    """ChoiceNet, ready to be asked."""

    config: ChoiceConfig
    tensors: dict[str, AnyArray]


def save_choice(
    path: Path, config: ChoiceConfig, tensors: Mapping[str, AnyArray], training: dict[str, Any], metrics: dict[str, Any]
) -> Path:
    """Write `path` (.safetensors) and the .json beside it; returns `path`. Raises OutputError."""
    shapes = {name: list(tensor.shape) for name, tensor in tensors.items()}
    facts = {"shapes": shapes, "training": training, "metrics": metrics, "kind": KIND, "config": asdict(config)}
    return write_pair(path, packed(tensors), ChoiceMeta, **facts)


@lru_cache(maxsize=4)
def load_choice(path: str | os.PathLike[str] = "") -> ChoiceWeights:
    """ChoiceNet from a file, by default the one that comes with the project.

    Raises ConfigError, in one line, if the file or its .json is missing, truncated, of another version or of another
    network, or if what it holds is not what the .json says, or not numbers.
    """
    place = Path(path) if path else SHIPPED / "choice.safetensors"
    meta = read_meta(place, ChoiceMeta)
    if meta.kind != KIND:
        raise ConfigError(f"{place}: weights of {meta.kind!r}; expected those of {KIND!r}: give its file")
    config = settings_of(place, ChoiceConfig, meta.config)
    tensors = unpacked(read_bytes(place, meta), str(place))
    found = {name: list(tensor.shape) for name, tensor in tensors.items()}
    check_shapes({name: list(shape) for name, shape in shapes_of(config).items()}, found, str(place))
    if not all(np.isfinite(tensor).all() for tensor in tensors.values()):
        raise not_a_number(str(place))
    return ChoiceWeights(config, tensors)
