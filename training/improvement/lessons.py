"""What a play teaches: for each of its states what the network sees, which actions led where, what there was to gain.

Letters: A actions.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from agents.choice.config import ChoiceConfig
from agents.choice.features import Look, look
from autopoly_env.arguments import above, at_least
from autopoly_env.arrays import Float32Array, FloatArray
from autopoly_env.operators import Action
from autopoly_env.simulator import State
from training.improvement.plays import Play, SearchedState

_LOW, _HIGH = slice(9, 13, 2), slice(10, 13, 2)  # of an action's numbers: where along its edge the blame begins, ends


@dataclass(frozen=True)
class LabelConfig:
    """How what was found becomes labels."""

    temperature: float = 0.25  # points of r_all: of the softmax over what was found behind each action
    least_gain: float = 0.05  # points of r_all below which a state teaches no choice
    n_least: int = 12  # visits of a state that says what there is to gain

    def __post_init__(self) -> None:
        above(0, temperature=self.temperature)
        at_least(0, least_gain=self.least_gain)
        at_least(1, n_least=self.n_least)


@dataclass(frozen=True)
class Lesson:
    """One state."""

    seen: Look
    policy: Float32Array  # (A,) probabilities; all 0 where there is nothing to choose
    found: FloatArray  # (A,) r_all behind each action; that of the state where it was not tried
    total: float
    gain: float  # NaN where too little was searched
    group: str  # style and target: lessons of one target stay together


def lessons_of(play: Play, network: ChoiceConfig, labels: LabelConfig) -> list[Lesson]:
    """The lessons of a play."""
    simulator = play.simulator()
    found = []
    for searched in play.states:
        mesh = searched.mesh()
        state = State(mesh, simulator.score(mesh))
        actions = [Action(*action) for action in searched.actions]
        seen, _ = look(simulator, state, actions, network.classes, network.side)
        found.append(_lesson(seen, searched, labels, f"{play.style} {play.target}"))
    return found


def _lesson(seen: Look, searched: SearchedState, labels: LabelConfig, group: str) -> Lesson:
    found = np.array([searched.total if value is None else value for value in searched.found], float)
    known = seen.classes >= 0
    odds = np.where(known, np.exp((found - found.max(initial=searched.total)) / labels.temperature), 0.0)
    teaches = bool(known.any()) and found[known].max() - searched.total > labels.least_gain
    policy = odds / odds.sum() if teaches else np.zeros(len(found))
    gain = searched.best - searched.total if sum(searched.visits) >= labels.n_least else float("nan")
    return Lesson(seen, policy.astype(np.float32), found, searched.total, gain, group)


def mirrored(seen: Look) -> Look:
    """The same in a mirror: patches turned along the action, and where along an edge the blame lies."""
    numbers = seen.numbers.copy()
    on_edge = (seen.numbers[:, _LOW] != 0.0) | (seen.numbers[:, _HIGH] != 0.0)
    numbers[:, _LOW] = np.where(on_edge, 1.0 - seen.numbers[:, _HIGH], 0.0)
    numbers[:, _HIGH] = np.where(on_edge, 1.0 - seen.numbers[:, _LOW], 0.0)
    return replace(seen, numbers=numbers, patches=np.ascontiguousarray(seen.patches[..., ::-1]))


def drawn(lessons: Sequence[Lesson], rng: np.random.Generator, n: int) -> list[Lesson]:
    """So many lessons at random, each in the mirror or not."""
    chosen = [lessons[k] for k in rng.integers(len(lessons), size=n)]
    return [replace(one, seen=mirrored(one.seen)) if rng.random() < 0.5 else one for one in chosen]
