"""Data sets of play in the format of Minari: what an agent did in an environment, with the masks of what it might do.

Minari alone reads them: `minari.load_dataset(NAME)` gives the episodes, `recover_environment()` the environment.
"""

import os
import re
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium

from agents.base import Agent, WholeAgent
from autopoly_env import __version__
from autopoly_env.arguments import one_of
from autopoly_env.env import AutoPolyEnv
from autopoly_env.errors import ConfigError, OutputError
from autopoly_env.shown import short
from autopoly_env.wrappers import MaskInObservation

VERSION, OPERATORS = "autopoly_version", "autopoly_operators"  # of the data set's metadata
_NAME = re.compile(r"([\w-]+/)*[\w-]+-v\d+")  # what Minari takes
FOLDER = "MINARI_DATASETS_PATH"  # the variable that tells Minari where its data sets are


@dataclass(frozen=True)
class PlaySettings:
    """Whose play is recorded, and in what."""

    name: str  # of the data set: NAMESPACE/NAME-vN
    n: int  # episodes
    env: str = "AutoPoly-v0"
    settings: tuple[tuple[str, Any], ...] = ()  # arguments of the environment
    seed: int = 0  # episode k begins with seed + k


def record_plays(
    folder: Path, settings: PlaySettings, agent: Agent, on_episode: Callable[[], None] = lambda: None
) -> None:
    """Let the agent play `n` episodes and write them below `folder` as a Minari data set; all or nothing.

    An action that the environment's arrays have no room for is STOP. Raises ConfigError for settings out of range,
    where Minari is not installed and where there is such a data set, OutputError where nothing can be written.
    """
    minari = _minari(folder)
    if settings.n < 1:
        raise ConfigError(f"n={settings.n}: expected at least 1 episode")
    if not _NAME.fullmatch(settings.name):
        raise ConfigError(f"data set {short(settings.name)}: expected NAMESPACE/NAME-vN, such as autopoly/greedy-v0")
    if isinstance(agent, WholeAgent):
        raise ConfigError(
            f"{agent.name} finds outlines as a whole, of which there is no play: choose mcts, greedy or ppo"
        )
    if settings.name in minari.list_local_datasets():
        raise ConfigError(f"{folder} has a data set {settings.name} already; give another name or another folder")
    env = MaskInObservation(_made(settings))
    agent.check(_simulator_of(env, settings.seed))
    try:
        recorder = minari.DataCollector(env, record_infos=True, jpeg_encoding=False)  # JPEG is not what was seen
        for k in range(settings.n):
            recorder.reset(seed=settings.seed + k)
            for action in _played(env.unwrapped, agent):
                recorder.step(action)
            on_episode()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of what a data set may have and this one has not
            dataset = recorder.create_dataset(settings.name, algorithm_name=agent.name)
        dataset.storage.update_metadata({VERSION: __version__, OPERATORS: _operators(env.unwrapped)})
    except OSError as error:
        raise OutputError(f"cannot write below {folder} ({error.strerror}); give another folder") from None


def load_plays(folder: Path, name: str, env: gymnasium.Env[Any, Any] | None = None) -> Any:
    """The `minari.MinariDataset` of this name below `folder`, to learn from for an environment, if one is given.

    Raises ConfigError where there is none, where it is of no AutoPoly or another version, and where its operators, and
    with them the numbers of its actions, are not those of the environment.
    """
    minari = _minari(folder)
    if name not in minari.list_local_datasets():
        raise ConfigError(f"there is no data set {name!r} in {folder}; make one with training.make_dataset minari")
    dataset = minari.load_dataset(name)
    known = dataset.storage.metadata
    if VERSION not in known:
        raise ConfigError(f"data set {name} is not of AutoPoly; make one with training.make_dataset minari")
    if known[VERSION] != __version__:
        raise ConfigError(f"data set {name} is of AutoPoly {known[VERSION]}, this is {__version__}; make it anew")
    if env is not None and known[OPERATORS] != _operators(env.unwrapped):
        raise ConfigError(
            f"data set {name} has the operators {known[OPERATORS]}, the environment {_operators(env.unwrapped)}: "
            "give both the same"
        )
    return dataset


def _made(settings: PlaySettings) -> gymnasium.Env[Any, Any]:
    """The environment of the settings. Raises ConfigError for one that is unknown, or has no such arguments."""
    known = tuple(name for name in gymnasium.registry if name.startswith("AutoPoly"))
    name = one_of("env", settings.env, known)
    try:
        return gymnasium.make(f"autopoly_env:{name}", **dict(settings.settings))
    except TypeError as error:  # Gymnasium's, around Python's
        raise ConfigError(f"{name}: {short(str(error), 160)}") from None


def _played(env: Any, agent: Agent) -> Iterator[int]:
    """The numbers of an agent's actions until the episode has ended."""
    while not env.state.done:
        index = env.codec.encode(agent.act(env.simulator, env.state).action)
        yield index if env.action_masks()[index] else 0


def _simulator_of(env: gymnasium.Env[Any, Any], seed: int) -> Any:
    env.reset(seed=seed)
    return env.unwrapped.simulator  # type: ignore[attr-defined]


def _operators(env: Any) -> str:
    assert isinstance(env, AutoPolyEnv)
    return ",".join(env.codec.operators)


def _minari(folder: Path) -> Any:
    """Minari, which finds its data sets below `folder`."""
    os.environ[FOLDER] = str(folder)
    try:
        import jax  # noqa: F401 (what Minari writes with)
        import minari
    except ImportError:
        raise ConfigError("data sets of play need Minari; pip install 'minari[create,hdf5]'") from None
    return minari
