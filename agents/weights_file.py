"""A network on disk: NAME.safetensors beside NAME.json, which says what it is; checked before anything is used.

Nothing is unpickled. A pair is written weights first: until its .json is there, there are no weights.
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar, TypeVar

import safetensors.torch
import torch
from pydantic import TypeAdapter, ValidationError
from safetensors import SafetensorError
from torch import Tensor, nn

from autopoly_env.arguments import first_defect
from autopoly_env.errors import ConfigError
from autopoly_env.files import write_atomically

VERSION = 1


@dataclass(frozen=True, kw_only=True)
class WeightsMeta:
    """What stands beside any weights; each kind of network adds what it is built from."""

    hint: ClassVar[str] = "give another path"  # for whoever has no weights

    shapes: dict[str, list[int]]  # of every tensor
    sha256: str  # of the .safetensors file
    training: dict[str, Any]  # how they came about
    metrics: dict[str, Any]  # on what training has not seen
    version: int = VERSION


_Meta = TypeVar("_Meta", bound=WeightsMeta)
_Settings = TypeVar("_Settings")


def write_weights(path: Path, net: nn.Module, meta_class: type[WeightsMeta], /, **facts: Any) -> Path:
    """Write `path` (.safetensors) and the .json beside it; returns `path`. Raises OutputError.

    `facts` are the fields of `meta_class` but for shapes, hash and version.
    """
    tensors = {name: tensor.detach().cpu().contiguous() for name, tensor in net.state_dict().items()}
    data = safetensors.torch.save(tensors)
    meta = meta_class(shapes=_shapes(tensors), sha256=hashlib.sha256(data).hexdigest(), **facts)
    path.with_suffix(".json").unlink(missing_ok=True)
    write_atomically(path, data)
    write_atomically(path.with_suffix(".json"), json.dumps(asdict(meta), indent=2) + "\n")
    return path


def read_meta(path: Path, meta_class: type[_Meta]) -> _Meta:
    """What stands beside the weights at `path`. Raises ConfigError if it is missing, broken or of another version."""
    place = path.with_suffix(".json")
    try:
        fields = json.loads(_read(place, meta_class.hint).decode("utf-8"))
    except (ValueError, RecursionError):
        raise ConfigError(f"{place}: not JSON; expected what the training wrote: get it again") from None
    version = fields.get("version") if isinstance(fields, dict) else None
    if version != VERSION:
        raise ConfigError(f"{place}: weights of format version {version}; this code reads version {VERSION}")
    try:
        return TypeAdapter(meta_class).validate_python(fields)
    except ValidationError as error:
        raise ConfigError(f"{place}: {first_defect(error)}; expected what the training wrote: get it again") from None


def read_tensors(path: Path, meta: WeightsMeta) -> dict[str, Tensor]:
    """The tensors in `path`. Raises ConfigError unless they are the ones that `meta` was written with."""
    data = _read(path, meta.hint)
    if hashlib.sha256(data).hexdigest() != meta.sha256:
        raise ConfigError(f"{path}: not the weights that its .json names (sha256 differs, {len(data)} bytes); get both")
    try:
        return safetensors.torch.load(data)
    except SafetensorError as error:
        raise ConfigError(f"{path}: no safetensors file ({' '.join(str(error).split())}); get it again") from None


def settings_of(path: Path, settings_class: type[_Settings], values: Mapping[str, Any]) -> _Settings:
    """`values` of the .json as a dataclass. Raises ConfigError, which names the first one that does not fit."""
    try:
        return TypeAdapter(settings_class).validate_python(values)
    except ValidationError as error:
        raise ConfigError(f"{path.with_suffix('.json')}: its settings do not fit ({first_defect(error)})") from None


def fill(net: nn.Module, tensors: dict[str, Tensor], where: str) -> None:
    """Put tensors into a network. Raises ConfigError unless they have its names and shapes and are numbers."""
    wanted, found = _shapes(net.state_dict()), _shapes(tensors)
    odd = sorted(name for name in wanted.keys() | found.keys() if wanted.get(name) != found.get(name))
    if odd:
        shapes = f"{odd[0]} has shape {found.get(odd[0], 'none')}, the settings want {wanted.get(odd[0], 'none')}"
        raise ConfigError(f"{where}: {shapes}; give weights of the same network")
    if not all(bool(torch.isfinite(tensor).all()) for tensor in tensors.values()):
        raise ConfigError(f"{where}: a weight is not a number; get it again, or train again with a lower lr")
    net.load_state_dict(tensors)


def _shapes(tensors: Mapping[str, Tensor]) -> dict[str, list[int]]:
    return {name: list(tensor.shape) for name, tensor in tensors.items()}


def _read(path: Path, hint: str) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise ConfigError(f"no weights at {path} ({error.strerror}); {hint}") from None
