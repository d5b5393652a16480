"""What a training begins with: the weights of another one, made to fit."""

from pathlib import Path

from agents.rl.config import NetConfig, SpaceSpec
from agents.rl.growing import grown
from agents.rl.network import MeshNet
from agents.rl.weights import load_policy
from autopoly_env.errors import ConfigError


def begun_with(path: Path, config: NetConfig, spec: SpaceSpec) -> MeshNet:
    """The policy in a file for a run of these settings. Raises ConfigError, which names both, for another game."""
    net, _ = load_policy(path)
    spec.check_same(net.spec, "this run", str(path))
    if net.config != config:
        raise ConfigError(f"{path}: a network {net.config}; this run: {config}: make them agree")
    return grown(net, spec)
