"""From the plays of a search to what a policy that is cloned reads, and what it is to answer.

The plays are those of `training.improve`: of each state they keep the best r_all that was found behind every action, so
that an action which pays after several steps only is a good one. Letters: A actions, G actions of the codec.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from torch.utils.data import Dataset

from agents.rl.config import SpaceSpec
from agents.rl.network import observer_of
from agents.rl.player import allowed
from autopoly_env.arrays import Float32Array, IntArray
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import FaceRule, PolyMesh
from autopoly_env.operators import Action, ActionCodec, preset
from training.improvement.plays import RULES, Play, SearchedState
from training.networks.samples import Sample
from training.policies.clone_samples import HOPELESS, CloneConfig, Turning, numbers_of

_EVERY = 10  # of so many plays one is kept to measure with


@dataclass(frozen=True)
class Searched:
    """A state of a play as the policy sees it."""

    seen: Turning
    w_sc: float
    faces: FaceRule
    index: IntArray  # (A,) number of each action that was tried
    gains: Float32Array  # (A,) points of r_all that were found behind each
    best: float  # of all


@dataclass
class PlayStream(Dataset[Sample]):
    """Endless samples by number; number i depends on (seed, i) alone. A play is as likely as any other."""

    plays: Sequence[list[Searched]]
    config: CloneConfig
    seed: int
    turn: bool = True
    _rows: list[int] = field(init=False)

    def __post_init__(self) -> None:
        self._rows = [k for k, states in enumerate(self.plays) if states]
        if not self._rows:
            raise ConfigError(f"{self.config.data.plays}: no play has a state to learn from; play more")

    def __getitem__(self, i: int) -> Sample:
        rng = np.random.default_rng((self.seed, i))
        states = self.plays[self._rows[int(rng.integers(len(self._rows)))]]
        one = states[int(rng.integers(len(states)))]
        return play_sample(one, int(rng.integers(8)) if self.turn else 0, self.config)


def read_plays(folder: str, spec: SpaceSpec, least_gain: float) -> tuple[list[list[Searched]], list[list[Searched]]]:
    """The states of the plays below a folder: to learn from, and to measure with.

    Raises ConfigError if there are none, RunError as `Play.load`.
    """
    paths = sorted(Path(folder).rglob("*.json"))
    if not paths:
        raise ConfigError(f"no plays (*.json) in {folder}; make some with python -m training.improve")
    made = [searched(Play.load(path), spec, least_gain) for path in paths]
    return [one for k, one in enumerate(made) if k % _EVERY], made[::_EVERY]


def searched(play: Play, spec: SpaceSpec, least_gain: float) -> list[Searched]:
    """The states of a play that the padding has room for and in which something was found."""
    observer, codec = observer_of(spec), ActionCodec(spec.operators, spec.max_vertices)
    picture = observer.picture_of(play.silhouette())
    names, faces = RULES[play.style]
    operators = [operator.name for operator in preset(names)]
    found = []
    for state in play.states:
        mesh = state.mesh()
        try:
            observer.check_fits(mesh)
        except ConfigError:
            continue
        if state.best - state.total < least_gain:
            continue
        index, gains = _tried(codec, state)
        mask = allowed(codec, mesh, operators)
        seen = Turning(observer.observe(mesh, picture, _steps_left(mesh, spec)), mask, codec)
        found.append(Searched(seen, play.w_sc, faces, index, gains, state.best - state.total))
    return found


def _tried(codec: ActionCodec, state: SearchedState) -> tuple[IntArray, Float32Array]:
    pairs = zip(state.actions, state.found, strict=True)
    known = [(Action(*action), value - state.total) for action, value in pairs if value is not None]
    index = numbers_of(codec, [action for action, _ in known])
    return index[index >= 0], np.array([gain for _, gain in known], np.float32)[index >= 0]


def _steps_left(mesh: PolyMesh, spec: SpaceSpec) -> int:
    """About so many, for plays do not say: most steps add a face."""
    return max(1, spec.max_steps - (len(mesh.faces) - 1))


def play_sample(one: Searched, way: int, config: CloneConfig) -> Sample:
    """What the policy sees, turned as `clone_sample` does, and what it is to answer."""
    policy, gains = np.zeros(len(one.seen.mask)), np.full(len(one.seen.mask), HOPELESS)
    gains[one.index], gains[0] = one.gains, 0.0
    gains[one.seen.mask == 0] = HOPELESS
    policy = np.exp((gains - gains.max()) / config.data.temperature)
    arrays = {"policy": (policy / policy.sum()).astype(np.float32), "gains": gains.astype(np.float32)}
    value = np.array((config.env.reward_scale * one.best,), np.float32)
    return one.seen.sample(way, one.w_sc, one.faces, arrays, value)
