"""Weights on disk: NAME.safetensors beside NAME.json, which says what they are; checked before anything is used.

Nothing is unpickled. A pair is written weights first: until its .json is there, there are no weights.
"""

import hashlib
import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TypeVar

import safetensors.torch
from pydantic import TypeAdapter, ValidationError
from safetensors import SafetensorError
from torch import nn

from agents.guided.config import NfapConfig, WarpConfig
from agents.guided.nfap import NfapNet
from agents.guided.warp import WarpNet
from autopoly_env.errors import ConfigError
from autopoly_env.files import write_atomically

VERSION = 1
SHIPPED = Path(__file__).parent / "weights"

_Net = TypeVar("_Net", NfapNet, WarpNet)
_KINDS: dict[type[nn.Module], tuple[str, Any]] = {NfapNet: ("nfap", NfapConfig), WarpNet: ("warpnet", WarpConfig)}


@dataclass(frozen=True)
class Meta:
    """What stands beside the weights."""

    kind: str  # "nfap" or "warpnet"
    config: dict[str, Any]  # of the network
    shapes: dict[str, list[int]]  # of every tensor
    sha256: str  # of the .safetensors file
    training: dict[str, Any]  # how they came about, and what the data was labelled with
    metrics: dict[str, Any]  # held out
    version: int = VERSION


def save_weights(path: Path, net: NfapNet | WarpNet, training: dict[str, Any], metrics: dict[str, Any]) -> Path:
    """Write `path` (.safetensors) and the .json beside it; returns `path`. Raises OutputError."""
    tensors = {name: tensor.detach().cpu().contiguous() for name, tensor in net.state_dict().items()}
    data = safetensors.torch.save(tensors)
    kind, _ = _KINDS[type(net)]
    shapes = {name: list(tensor.shape) for name, tensor in tensors.items()}
    meta = Meta(kind, asdict(net.config), shapes, hashlib.sha256(data).hexdigest(), training, metrics)
    path.with_suffix(".json").unlink(missing_ok=True)
    write_atomically(path, data)
    write_atomically(path.with_suffix(".json"), json.dumps(asdict(meta), indent=2) + "\n")
    return path


def load_nfap(path: str | os.PathLike[str] = "") -> tuple[NfapNet, Meta]:
    """nFAP-Net from a file, by default the one that comes with the project; in evaluation mode.

    Raises ConfigError, in one line, if the file or its .json is missing, truncated, of another version or of another
    network, or if what it holds is not what the .json says.
    """
    return _load(Path(path) if path else SHIPPED / "nfap.safetensors", NfapNet)


def load_warpnet(path: str | os.PathLike[str] = "") -> tuple[WarpNet, Meta]:
    """As `load_nfap`, of WarpNet."""
    return _load(Path(path) if path else SHIPPED / "warpnet.safetensors", WarpNet)


def _load(path: Path, make: type[_Net]) -> tuple[_Net, Meta]:
    meta = _read_meta(path.with_suffix(".json"))
    kind, config_class = _KINDS[make]
    if meta.kind != kind:
        raise ConfigError(f"{path}: weights of {meta.kind!r}; expected those of {kind!r}: give its file")
    data = _read(path)
    if hashlib.sha256(data).hexdigest() != meta.sha256:
        raise ConfigError(f"{path}: not the weights that its .json names (sha256 differs, {len(data)} bytes); get both")
    try:
        net = make(TypeAdapter(config_class).validate_python(meta.config))
        tensors = safetensors.torch.load(data)
    except ValidationError as error:
        raise ConfigError(f"{path.with_suffix('.json')}: its config does not fit ({_first(error)})") from None
    except SafetensorError as error:
        raise ConfigError(f"{path}: no safetensors file ({' '.join(str(error).split())}); get it again") from None
    wanted = {name: list(tensor.shape) for name, tensor in net.state_dict().items()}
    found = {name: list(tensor.shape) for name, tensor in tensors.items()}
    odd = sorted(name for name in wanted.keys() | found.keys() if wanted.get(name) != found.get(name))
    if odd:
        shapes = f"{odd[0]} has shape {found.get(odd[0], 'none')}, the config wants {wanted.get(odd[0], 'none')}"
        raise ConfigError(f"{path}: {shapes}; get weights and .json of the same network")
    net.load_state_dict(tensors)
    return net.eval(), meta


def _read_meta(path: Path) -> Meta:
    try:
        fields = json.loads(_read(path).decode("utf-8"))
    except (ValueError, RecursionError):
        raise ConfigError(f"{path}: not JSON; expected what the training wrote: get it again") from None
    version = fields.get("version") if isinstance(fields, dict) else None
    if version != VERSION:
        raise ConfigError(f"{path}: weights of format version {version}; this code reads version {VERSION}")
    try:
        return TypeAdapter(Meta).validate_python(fields)
    except ValidationError as error:
        raise ConfigError(f"{path}: {_first(error)}; expected what the training wrote: get it again") from None


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        hint = "train them (docs/learning.md) or give another path"
        raise ConfigError(f"no weights at {path} ({error.strerror}); {hint}") from None


def _first(error: ValidationError) -> str:
    details = error.errors()[0]
    return f"{'.'.join(map(str, details['loc']))}: {details['msg']}"
