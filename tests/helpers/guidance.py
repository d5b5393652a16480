"""Guided games: a start mesh, random play, agents with little time, and what symmetry means."""

import random
from collections.abc import Iterator
from typing import Any

import numpy as np

from agents.budget import Budget
from agents.registry import make_agent
from agents.solution import Solution
from autopoly_env.errors import IllegalActionError
from autopoly_env.mesh import PolyMesh, images_of, mirrored
from autopoly_env.operators import Action, legal_actions
from autopoly_env.simulator import Simulator, State

PLAYERS = ("greedy", "beam", "random", "mcts")
RULES: dict[str, dict[str, Any]] = {"quads": {"operators": "modeller", "faces": "quads"}}  # that an agent needs
WHOLE = ("trace", "climb", "decimate", "quads", "dr-simple", "dr-complex")
OPTIONS: dict[str, dict[str, Any]] = {
    "beam": {"width": 2, "patience": 2},
    "random": {"n_steps": 8},
    "mcts": {"seeds": ()},
    "climb": {"n_rounds": 1},
}
START = PolyMesh.rectangle(0.25, 0.3, 0.75, 0.85)
LEFT = np.repeat(np.arange(32) < 16, 32).reshape(32, 32).T  # of a picture: True on its left half


def play(game: Simulator, seed: int, n_steps: int) -> Iterator[tuple[State, Action, State]]:
    """Random play: an operator, then an element; what turns out to be illegal is drawn again."""
    rng, state = random.Random(seed), game.initial()
    for _ in range(n_steps):
        possible = legal_actions(state.mesh, game.operators)
        while not state.done:
            operator = rng.choice(sorted({action.operator for action in possible}))
            action = rng.choice([action for action in possible if action.operator == operator])
            try:
                after = game.transition(state, action)
            except IllegalActionError:
                continue
            yield state, action, after
            state = after
            break


def solve(name: str, game: Simulator, refits: int = 60) -> Solution:
    return make_agent(name, **OPTIONS.get(name, {})).solve(game, Budget(refits=refits))


def assert_symmetric(mesh: PolyMesh, axis: float) -> None:
    images = images_of(mesh, axis)
    assert images is not None
    paired = images >= 0
    opposite = mirrored(mesh.vertices[images[paired]], axis)
    np.testing.assert_allclose(mesh.vertices[paired], opposite, rtol=0, atol=1e-12)
    assert (paired == mesh.topology.is_boundary_vertex).all()
