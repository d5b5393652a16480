"""What stands beside the weights of a network, and weights as NumPy's arrays; no torch, no safetensors needed.

The format is that of safetensors: a header's length (8 bytes), the header (JSON), the numbers. Nothing is unpickled.
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar, TypeVar

import numpy as np
from pydantic import TypeAdapter, ValidationError

from autopoly_env.arguments import first_defect
from autopoly_env.arrays import AnyArray
from autopoly_env.errors import ConfigError
from autopoly_env.files import write_atomically

VERSION = 1
_LENGTH = 8  # bytes of the header's length


@dataclass(frozen=True, kw_only=True)
class WeightsMeta:
    """What stands beside any weights; each kind of network adds what it is built from."""

    hint: ClassVar[str] = "give another path"  # for whoever has no weights

    shapes: dict[str, list[int]]  # of every tensor
    sha256: str  # of the .safetensors file
    training: dict[str, Any]  # how they came about
    metrics: dict[str, Any]  # on what training has not seen
    version: int = VERSION


Meta = TypeVar("Meta", bound=WeightsMeta)
_Settings = TypeVar("_Settings")


def write_pair(path: Path, data: bytes, meta_class: type[WeightsMeta], /, **facts: Any) -> Path:
    """Write `data` to `path` (.safetensors) and the .json beside it, weights first; returns `path`. Raises OutputError.

    `facts` are the fields of `meta_class` but for hash and version.
    """
    meta = meta_class(sha256=hashlib.sha256(data).hexdigest(), **facts)
    path.with_suffix(".json").unlink(missing_ok=True)
    write_atomically(path, data)
    write_atomically(path.with_suffix(".json"), json.dumps(asdict(meta), indent=2) + "\n")
    return path


def read_meta(path: Path, meta_class: type[Meta]) -> Meta:
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


def read_bytes(path: Path, meta: WeightsMeta) -> bytes:
    """The bytes of the weights. Raises ConfigError unless they are those that `meta` was written with."""
    data = _read(path, meta.hint)
    if hashlib.sha256(data).hexdigest() != meta.sha256:
        raise ConfigError(f"{path}: not the weights that its .json names (sha256 differs, {len(data)} bytes); get both")
    return data


def settings_of(path: Path, settings_class: type[_Settings], values: Mapping[str, Any]) -> _Settings:
    """`values` of the .json as a dataclass. Raises ConfigError, which names the first one that does not fit."""
    try:
        return TypeAdapter(settings_class).validate_python(values)
    except ValidationError as error:
        raise ConfigError(f"{path.with_suffix('.json')}: its settings do not fit ({first_defect(error)})") from None


def check_shapes(wanted: Mapping[str, Any], found: Mapping[str, Any], where: str) -> None:
    """Raise ConfigError, which names the first tensor whose shape differs, unless all shapes are those wanted."""
    odd = sorted(name for name in wanted.keys() | found.keys() if _shape(wanted, name) != _shape(found, name))
    if odd:
        shapes = f"{odd[0]} has shape {found.get(odd[0], 'none')}, the settings want {wanted.get(odd[0], 'none')}"
        raise ConfigError(f"{where}: {shapes}; give weights of the same network")


def not_a_number(where: str) -> ConfigError:
    """The error for weights that are not finite."""
    return ConfigError(f"{where}: a weight is not a number; get it again, or train again with a lower lr")


def _shape(shapes: Mapping[str, Any], name: str) -> list[int] | None:
    return list(shapes[name]) if name in shapes else None


def packed(arrays: Mapping[str, AnyArray]) -> bytes:
    """Arrays, as float32, as the bytes of a safetensors file."""
    header: dict[str, Any] = {}
    parts: list[bytes] = []
    end = 0
    for name, array in arrays.items():
        parts.append(np.asarray(array, "<f4").tobytes())
        begin, end = end, end + len(parts[-1])
        header[name] = {"dtype": "F32", "shape": list(array.shape), "data_offsets": [begin, end]}
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % _LENGTH)
    return len(text).to_bytes(_LENGTH, "little") + text + b"".join(parts)


def unpacked(data: bytes, where: str) -> dict[str, AnyArray]:
    """The float32 arrays of a safetensors file. Raises ConfigError for anything else."""
    try:
        begin = _LENGTH + int.from_bytes(data[:_LENGTH], "little")
        header = json.loads(data[_LENGTH:begin])
        arrays = {}
        for name, entry in header.items():
            if name == "__metadata__":
                continue
            first, last = entry["data_offsets"]
            if entry["dtype"] != "F32":
                raise ValueError(f"{name} is {entry['dtype']}")
            numbers = np.frombuffer(data[begin + first : begin + last], "<f4")
            arrays[name] = numbers.reshape(entry["shape"]).astype(np.float32)
        return arrays
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise ConfigError(f"{where}: no safetensors file of float32 numbers ({error}); get it again") from None


def _read(path: Path, hint: str) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise ConfigError(f"no weights at {path} ({error.strerror}); {hint}") from None
