"""Weights of nFAP-Net and WarpNet."""

import os
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar, TypeVar

from torch import nn

from agents.guided.config import NfapConfig, WarpConfig
from agents.guided.nfap import NfapNet
from agents.guided.warp import WarpNet
from agents.weights_file import fill, read_tensors, write_weights
from agents.weights_meta import WeightsMeta, read_meta, settings_of
from autopoly_env.errors import ConfigError

SHIPPED = Path(__file__).parent / "weights"

_Net = TypeVar("_Net", NfapNet, WarpNet)
_KINDS: dict[type[nn.Module], tuple[str, Any]] = {NfapNet: ("nfap", NfapConfig), WarpNet: ("warpnet", WarpConfig)}


@dataclass(frozen=True, kw_only=True)
class NetworkMeta(WeightsMeta):
    """What stands beside the weights; `training` says what the data was labelled with, too."""

    hint: ClassVar[str] = "train them (docs/learning.md) or give another path"

    kind: str  # "nfap" or "warpnet"
    config: dict[str, Any]  # of the network


def save_weights(path: Path, net: NfapNet | WarpNet, training: dict[str, Any], metrics: dict[str, Any]) -> Path:
    """Write `path` (.safetensors) and the .json beside it; returns `path`. Raises OutputError."""
    facts = {"kind": _KINDS[type(net)][0], "config": asdict(net.config)}
    return write_weights(path, net, NetworkMeta, training=training, metrics=metrics, **facts)


def load_nfap(path: str | os.PathLike[str] = "") -> tuple[NfapNet, NetworkMeta]:
    """nFAP-Net from a file, by default the one that comes with the project; in evaluation mode.

    Raises ConfigError, in one line, if the file or its .json is missing, truncated, of another version or of another
    network, or if what it holds is not what the .json says.
    """
    return _load(Path(path) if path else SHIPPED / "nfap.safetensors", NfapNet)


def load_warpnet(path: str | os.PathLike[str] = "") -> tuple[WarpNet, NetworkMeta]:
    """As `load_nfap`, of WarpNet."""
    return _load(Path(path) if path else SHIPPED / "warpnet.safetensors", WarpNet)


def _load(path: Path, make: type[_Net]) -> tuple[_Net, NetworkMeta]:
    meta = read_meta(path, NetworkMeta)
    kind, config_class = _KINDS[make]
    if meta.kind != kind:
        raise ConfigError(f"{path}: weights of {meta.kind!r}; expected those of {kind!r}: give its file")
    tensors = read_tensors(path, meta)
    net = make(settings_of(path, config_class, meta.config))
    fill(net, tensors, str(path))
    return net.eval(), meta
