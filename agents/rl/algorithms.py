"""The algorithms by name, models of them, and their checkpoints: SB3's zip with a note of our own in it.

From a zip that our training wrote, tensors are read and nothing else: the pickled part of it is never opened.
"""

import json
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from sb3_contrib import MaskablePPO
from stable_baselines3 import A2C, DQN, PPO
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.save_util import load_from_zip_file
from stable_baselines3.common.vec_env import VecEnv
from torch import Tensor

from agents.options import validated
from agents.rl.config import NetConfig, SpaceSpec
from agents.rl.network import MeshNet
from agents.rl.policies import PARTS, MaskablePointerPolicy, PointerDqnPolicy, PointerPolicy
from agents.weights_file import fill
from autopoly_env.arrays import AnyArray
from autopoly_env.errors import ConfigError, RunError
from autopoly_env.files import write_atomically

_NOTE = "autopoly.json"
_MARK = "_stable_baselines3_version"  # in every zip of SB3
_VERSION = 1


class MaskedDqn(DQN):
    """DQN that explores legal actions only, as the observation's key `action_mask` has them."""

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None, deterministic: bool = False
    ) -> Any:
        if not deterministic and np.random.rand() < self.exploration_rate:
            return self._random(observation["action_mask"]), state
        return self.policy.predict(observation, state, episode_start, deterministic)

    def _sample_action(self, learning_starts: int, action_noise: Any = None, n_envs: int = 1) -> Any:
        if self.num_timesteps < learning_starts:
            actions = self._random(self._last_obs["action_mask"])  # type: ignore[index]
            return actions, actions
        return super()._sample_action(learning_starts, action_noise, n_envs)

    def _random(self, masks: AnyArray) -> AnyArray:
        """(B,) a legal action for each row of masks (B, n_actions)."""
        return np.argmax(np.random.rand(*masks.shape) * (masks > 0), axis=-1)


@dataclass(frozen=True)
class Algorithm:
    """A class of SB3 and the policy that goes with it."""

    make: type[BaseAlgorithm]
    policy: Any


BY_NAME = {
    "maskable_ppo": Algorithm(MaskablePPO, MaskablePointerPolicy),
    "ppo": Algorithm(PPO, PointerPolicy),
    "a2c": Algorithm(A2C, PointerPolicy),
    "dqn": Algorithm(MaskedDqn, PointerDqnPolicy),
}


def make_model(
    name: str,
    envs: VecEnv,
    net: NetConfig,
    spec: SpaceSpec,
    lr: Callable[[float], float],
    options: dict[str, Any],
    seed: int,
    device: str,
) -> BaseAlgorithm:
    """A model of the algorithm; `options` are its own arguments in SB3. Raises ConfigError where SB3 refuses them."""
    algorithm = BY_NAME[name]
    try:
        return algorithm.make(
            algorithm.policy,
            envs,
            learning_rate=lr,
            policy_kwargs={"net": net, "spec": spec},
            seed=seed,
            device=device,
            **options,
        )
    except (AssertionError, ValueError, TypeError) as error:
        raise ConfigError(f"{name} refuses its settings ({' '.join(str(error).split())}); correct them") from None


def save_checkpoint(path: Path, model: BaseAlgorithm, note: dict[str, Any]) -> None:
    """Write the model as a zip that SB3 can load, with `note` in it; whole or not at all. Raises OutputError."""
    buffer = BytesIO()
    model.save(buffer, exclude=["_last_obs", "_last_original_obs"])
    with zipfile.ZipFile(buffer, "a") as archive:
        archive.writestr(_NOTE, json.dumps({"version": _VERSION, **note}))
    write_atomically(path, buffer.getvalue())


def read_note(path: Path) -> dict[str, Any] | None:
    """The note in a checkpoint; None in a zip that our training did not write. Raises RunError for no zip at all."""
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
            if _NOTE not in names and _MARK in names:
                return None
            note: dict[str, Any] = json.loads(archive.read(_NOTE))
    except (OSError, KeyError, ValueError, zipfile.BadZipFile, zlib.error) as error:
        raise RunError(f"cannot read {path} ({type(error).__name__}); delete it to begin anew") from None
    if note.get("version") != _VERSION:
        raise RunError(f"{path}: a checkpoint of version {note.get('version')}; this code reads version {_VERSION}")
    return note


def load_checkpoint(path: Path, model: BaseAlgorithm, note: dict[str, Any]) -> None:
    """Put networks, optimiser and counters of a checkpoint into a model of the same settings. Raises RunError."""
    try:
        model.set_parameters(str(path), device=model.device)
    except Exception as error:  # torch and SB3 raise whatever the damage leads them to
        raise RunError(f"cannot read {path} ({type(error).__name__}); delete it to begin anew") from None
    model.num_timesteps = int(note["step"])
    model._n_updates = int(note["n_updates"])


def net_of_zip(path: Path, config: NetConfig, spec: SpaceSpec, trust: bool) -> MeshNet:
    """The network that a zip of SB3 holds, which must be of these settings, and of spaces that `spec` can grow from.

    A zip without our note is refused unless `trust`: what it is for stands in its pickled part alone, and unpickling
    can run any code. Raises ConfigError.
    """
    note = read_note(path)
    if note is None and not trust:
        raise ConfigError(
            f"{path} was not written by this project's training, and to load it can run code that is in it; "
            "if you know where it comes from, give --trust"
        )
    try:
        data, params, _ = load_from_zip_file(str(path), load_data=note is None, device="cpu")
        kwargs = data["policy_kwargs"] if note is None else note  # type: ignore[index]
        theirs, net_config = kwargs["spec" if "spec" in kwargs else "rules"], kwargs["net"]  # "rules" in older zips
        if note is not None:
            theirs = validated(SpaceSpec, theirs)
            net_config = validated(NetConfig, net_config)
        policy: Any = params["policy"]
        tensors = _network_of(policy)
    except Exception as error:  # whatever the damage, or the other project, leads SB3 and torch to
        raise ConfigError(
            f"{path}: no policy of this project ({type(error).__name__}: {error}); give another"
        ) from None
    spec.check_same(theirs, "this run", str(path))
    if net_config != config:
        raise ConfigError(f"{path}: a network {net_config}; this run: {config}: make them agree")
    net = MeshNet(config, theirs)
    fill(net, tensors, str(path))
    return net


def _network_of(tensors: dict[str, Tensor]) -> dict[str, Tensor]:
    """The tensors of a policy by the names that they have in `MeshNet`."""
    found = {}
    for name, tensor in tensors.items():
        name = name.removeprefix("q_net.").replace("features_extractor.encoder.", "features_extractor.", 1)
        if name.split(".")[0] in PARTS:
            found[name] = tensor
    return found
