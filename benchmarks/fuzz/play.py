"""Random play: no legal action ends with a crossing, or with a flipped or empty face, that was not there before."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from autopoly_env.errors import IllegalActionError
from autopoly_env.mesh import FaceRule, defects_of
from autopoly_env.operators import Action
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator
from autopoly_env.targets import ConstructionTargets, ObjectTargets, TargetSource

TARGET_RESOLUTION = 64  # pixels a side
RESOLUTION = 16  # of refits: small, for there are to be many episodes
N_TARGETS = 64  # that the episodes take in turn
N_STEPS = 16  # of an episode
N_VERTICES = 24  # of a mesh, from which on an episode ends, for time's sake


@dataclass
class Played:
    """What so many episodes came to."""

    n_episodes: int = 0
    n_steps: int = 0
    n_without_room: int = 0  # actions that were tried and refused
    n_crossed: int = 0  # states with a crossing
    n_flipped: int = 0  # states with a flipped or empty face, or one against the rule

    def __add__(self, other: "Played") -> "Played":
        return Played(*(a + b for a, b in zip(vars(self).values(), vars(other).values(), strict=True)))


@cache
def _target(number: int) -> Silhouette:
    """Constructions and drawn objects, in turn."""
    source: TargetSource = (ConstructionTargets, ObjectTargets)[number % 2](resolution=TARGET_RESOLUTION)
    return source.sample(number)


def play(operators: str, seed: int, faces: FaceRule = "any") -> Played:
    """One episode of random actions, with a preset and under a rule of faces.

    Each operator is as likely, whatever the number of its elements.
    """
    rng = np.random.default_rng(seed)
    target = _target(seed % N_TARGETS)
    simulator = Simulator(target, operators=operators, resolution=RESOLUTION, max_steps=N_STEPS, faces=faces)
    state, played = simulator.initial(), Played(n_episodes=1)
    while not state.done and len(state.mesh.vertices) < N_VERTICES:
        by_operator: dict[str, list[Action]] = {}
        for action in simulator.legal_actions(state)[1:]:
            by_operator.setdefault(action.operator, []).append(action)
        if not by_operator:
            break
        actions = by_operator[sorted(by_operator)[rng.integers(len(by_operator))]]
        try:
            state = simulator.transition(state, actions[rng.integers(len(actions))])
        except IllegalActionError:
            played.n_without_room += 1
            state = simulator.idle(state)
            continue
        crossings, flipped = defects_of(state.mesh, faces)
        played += Played(0, 1, 0, crossings > 0, flipped > 0)
    return played


def play_many(operators: str, n: int, seed: int, faces: FaceRule = "any") -> Played:
    """Episodes number `seed` to `seed` + n - 1."""
    return sum((play(operators, seed + k, faces) for k in range(n)), Played())
