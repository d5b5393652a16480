"""Weights of policies: NAME.safetensors beside NAME.json, which says what they are; checked before anything is used.

Nothing is unpickled. A pair is written weights first: until its .json is there, there are no weights.
"""

import hashlib
import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import safetensors.torch
import torch
from pydantic import TypeAdapter, ValidationError
from safetensors import SafetensorError
from torch import Tensor

from agents.rl.config import ALGORITHMS, NetConfig, Rules
from agents.rl.network import MeshNet
from autopoly_env.errors import ConfigError
from autopoly_env.files import write_atomically

VERSION = 1
SHIPPED = Path(__file__).parent / "weights"
_HINT = "train them (docs/rl.md) and give weights=PATH"


@dataclass(frozen=True)
class Meta:
    """What stands beside the weights."""

    algorithm: str  # one of ALGORITHMS, or "clone"
    net: dict[str, Any]  # NetConfig
    rules: dict[str, Any]  # Rules
    shapes: dict[str, list[int]]  # of every tensor
    sha256: str  # of the .safetensors file
    training: dict[str, Any]  # how they came about
    metrics: dict[str, Any]  # on targets that training has not seen
    version: int = VERSION


def file_of(agent: str, path: str | os.PathLike[str] = "") -> Path:
    """The file that an agent reads: `path`, or the one that comes with the project.

    Raises ConfigError if none is given and none comes with the project.
    """
    if path:
        return Path(path)
    shipped = SHIPPED / f"{agent.replace('-', '_')}.safetensors"
    if not shipped.with_suffix(".json").exists():
        raise ConfigError(f"agent {agent!r} comes without weights: {_HINT}")
    return shipped


def save_policy(path: Path, net: MeshNet, algorithm: str, training: dict[str, Any], metrics: dict[str, Any]) -> Path:
    """Write `path` (.safetensors) and the .json beside it; returns `path`. Raises OutputError."""
    tensors = {name: tensor.detach().cpu().contiguous() for name, tensor in net.state_dict().items()}
    data = safetensors.torch.save(tensors)
    shapes = {name: list(tensor.shape) for name, tensor in tensors.items()}
    digest = hashlib.sha256(data).hexdigest()
    meta = Meta(algorithm, asdict(net.config), asdict(net.rules), shapes, digest, training, metrics)
    path.with_suffix(".json").unlink(missing_ok=True)
    write_atomically(path, data)
    write_atomically(path.with_suffix(".json"), json.dumps(asdict(meta), indent=2) + "\n")
    return path


def load_policy(path: Path) -> tuple[MeshNet, Meta]:
    """The network in a file, in evaluation mode, and what stands beside it.

    Raises ConfigError, in one line, if the file or its .json is missing, truncated or of another version, or if what it
    holds is not what the .json says.
    """
    meta = read_meta(path)
    data = _read(path)
    if hashlib.sha256(data).hexdigest() != meta.sha256:
        raise ConfigError(f"{path}: not the weights that its .json names (sha256 differs, {len(data)} bytes); get both")
    try:
        tensors = safetensors.torch.load(data)
    except SafetensorError as error:
        raise ConfigError(f"{path}: no safetensors file ({' '.join(str(error).split())}); get it again") from None
    try:
        config = TypeAdapter(NetConfig).validate_python(meta.net)
        rules = TypeAdapter(Rules).validate_python(meta.rules)
    except ValidationError as error:
        raise ConfigError(f"{path.with_suffix('.json')}: its settings do not fit ({_first(error)})") from None
    net = MeshNet(config, rules)
    fill(net, tensors, str(path))
    return net.eval(), meta


def fill(net: MeshNet, tensors: dict[str, Tensor], where: str) -> None:
    """Put tensors into a network. Raises ConfigError unless they have its names and shapes and are numbers."""
    wanted = {name: list(tensor.shape) for name, tensor in net.state_dict().items()}
    found = {name: list(tensor.shape) for name, tensor in tensors.items()}
    odd = sorted(name for name in wanted.keys() | found.keys() if wanted.get(name) != found.get(name))
    if odd:
        shapes = f"{odd[0]} has shape {found.get(odd[0], 'none')}, the settings want {wanted.get(odd[0], 'none')}"
        raise ConfigError(f"{where}: {shapes}; give weights of the same network")
    if not all(bool(torch.isfinite(tensor).all()) for tensor in tensors.values()):
        raise ConfigError(f"{where}: a weight is not a number; get it again, or train again with a lower lr")
    net.load_state_dict(tensors)


def read_meta(path: Path) -> Meta:
    """What stands beside the weights at `path`. Raises ConfigError."""
    place = path.with_suffix(".json")
    try:
        fields = json.loads(_read(place).decode("utf-8"))
    except (ValueError, RecursionError):
        raise ConfigError(f"{place}: not JSON; expected what the training wrote: get it again") from None
    version = fields.get("version") if isinstance(fields, dict) else None
    if version != VERSION:
        raise ConfigError(f"{place}: weights of format version {version}; this code reads version {VERSION}")
    try:
        meta = TypeAdapter(Meta).validate_python(fields)
    except ValidationError as error:
        raise ConfigError(f"{place}: {_first(error)}; expected what the training wrote: get it again") from None
    if meta.algorithm not in (*ALGORITHMS, "clone"):
        raise ConfigError(f"{place}: weights of algorithm {meta.algorithm!r}; expected one of {', '.join(ALGORITHMS)}")
    return meta


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise ConfigError(f"no weights at {path} ({error.strerror}); {_HINT}") from None


def _first(error: ValidationError) -> str:
    details = error.errors()[0]
    return f"{'.'.join(map(str, details['loc']))}: {details['msg']}"
