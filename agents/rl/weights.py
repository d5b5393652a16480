"""Weights of policies, and which file an agent reads."""

import os
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import AliasChoices, Field

from agents.rl.config import ALGORITHMS, NetConfig, SpaceSpec
from agents.rl.network import MeshNet
from agents.weights_file import fill, read_tensors, write_weights
from agents.weights_meta import WeightsMeta, read_meta, settings_of
from autopoly_env.errors import ConfigError

SHIPPED = Path(__file__).parent / "weights"


@dataclass(frozen=True, kw_only=True)
class PolicyMeta(WeightsMeta):
    """What stands beside a policy."""

    hint: ClassVar[str] = "train them (docs/rl.md) and give weights=PATH"

    algorithm: str  # one of ALGORITHMS, or "clone"
    net: dict[str, Any]  # NetConfig
    spec: Annotated[dict[str, Any], Field(validation_alias=AliasChoices("spec", "rules"))]  # SpaceSpec; "rules" before


def file_of(agent: str, path: str | os.PathLike[str] = "") -> Path:
    """The file that an agent reads: `path`, or the one that comes with the project.

    Raises ConfigError if none is given and none comes with the project.
    """
    if path:
        return Path(path)
    shipped = SHIPPED / f"{agent.replace('-', '_')}.safetensors"
    if not shipped.with_suffix(".json").exists():
        raise ConfigError(f"agent {agent!r} comes without weights: {PolicyMeta.hint}")
    return shipped


def save_policy(path: Path, net: MeshNet, algorithm: str, training: dict[str, Any], metrics: dict[str, Any]) -> Path:
    """Write `path` (.safetensors) and the .json beside it; returns `path`. Raises OutputError."""
    facts = {"algorithm": algorithm, "net": asdict(net.config), "spec": asdict(net.spec)}
    return write_weights(path, net, PolicyMeta, training=training, metrics=metrics, **facts)


def load_policy(path: Path) -> tuple[MeshNet, PolicyMeta]:
    """The network in a file, in evaluation mode, and what stands beside it.

    Raises ConfigError, in one line, if the file or its .json is missing, truncated or of another version, or if what it
    holds is not what the .json says.
    """
    meta = read_policy_meta(path)
    tensors = read_tensors(path, meta)
    net = MeshNet(settings_of(path, NetConfig, meta.net), settings_of(path, SpaceSpec, meta.spec))
    fill(net, tensors, str(path))
    return net.eval(), meta


def read_policy_meta(path: Path) -> PolicyMeta:
    """What stands beside the policy at `path`. Raises ConfigError."""
    meta = read_meta(path, PolicyMeta)
    if meta.algorithm not in (*ALGORITHMS, "clone"):
        place = path.with_suffix(".json")
        raise ConfigError(f"{place}: weights of algorithm {meta.algorithm!r}; expected one of {', '.join(ALGORITHMS)}")
    return meta
