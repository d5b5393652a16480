"""A network of torch's on disk: NAME.safetensors beside NAME.json, which says what it is; checked before it is used.

Nothing is unpickled. A pair is written weights first: until its .json is there, there are no weights.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import safetensors.torch
import torch
from safetensors import SafetensorError
from torch import Tensor, nn

from agents.weights_meta import WeightsMeta, check_shapes, not_a_number, read_bytes, write_pair
from autopoly_env.errors import ConfigError


def write_weights(path: Path, net: nn.Module, meta_class: type[WeightsMeta], /, **facts: Any) -> Path:
    """Write `path` (.safetensors) and the .json beside it; returns `path`. Raises OutputError.

    `facts` are the fields of `meta_class` but for shapes, hash and version.
    """
    tensors = {name: tensor.detach().cpu().contiguous() for name, tensor in net.state_dict().items()}
    return write_pair(path, safetensors.torch.save(tensors), meta_class, shapes=_shapes(tensors), **facts)


def read_tensors(path: Path, meta: WeightsMeta) -> dict[str, Tensor]:
    """The tensors in `path`. Raises ConfigError unless they are the ones that `meta` was written with."""
    try:
        return safetensors.torch.load(read_bytes(path, meta))
    except SafetensorError as error:
        raise ConfigError(f"{path}: no safetensors file ({' '.join(str(error).split())}); get it again") from None


def fill(net: nn.Module, tensors: dict[str, Tensor], where: str) -> None:
    """Put tensors into a network. Raises ConfigError unless they have its names and shapes and are numbers."""
    check_shapes(_shapes(net.state_dict()), _shapes(tensors), where)
    if not all(bool(torch.isfinite(tensor).all()) for tensor in tensors.values()):
        raise not_a_number(where)
    net.load_state_dict(tensors)


def _shapes(tensors: Mapping[str, Tensor]) -> dict[str, list[int]]:
    return {name: list(tensor.shape) for name, tensor in tensors.items()}
