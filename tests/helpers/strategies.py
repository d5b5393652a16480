"""Random walks over the operators, and hypothesis strategies of them, for every test that wants arbitrary meshes."""

import random
from collections import defaultdict
from typing import NamedTuple

import numpy as np
from hypothesis import strategies as st

from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import OPERATORS, Action, Choice, legal_actions, preset

_GROWING = ("loop_cut", "face_inset")  # what would make meshes ever larger on a long walk


class Transition(NamedTuple):
    """One step of a walk."""

    before: PolyMesh
    action: Action
    choice: Choice | None
    made: PolyMesh  # what the operator made
    after: PolyMesh  # the same, shaken


def random_walk(seed: int, operators: str = "full", n_steps: int = 40, shake: float = 0.0) -> list[Transition]:
    """A walk from a rectangle: an operator at random, an element at random, then every vertex shaken (unit square)."""
    rng = random.Random(seed)
    mesh, walk = PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75), []
    names = [operator.name for operator in preset(operators)]
    for _ in range(n_steps):
        by_operator = defaultdict(list)
        for action in legal_actions(mesh, [name for name in names if name not in _GROWING or len(mesh.faces) < 25]):
            by_operator[action.operator].append(action)
        action = rng.choice(by_operator[rng.choice(sorted(by_operator))])
        operator = OPERATORS[action.operator]
        choice = operator.choose(mesh, action.element)
        made = operator.apply(mesh, action.element, choice)
        moves = [(rng.gauss(0.0, shake), rng.gauss(0.0, shake)) for _ in made.vertex_ids]
        after = made.with_vertices(made.vertices + np.array(moves)) if shake else made
        walk.append(Transition(mesh, action, choice, made, after))
        mesh = after
    return walk


def walks(min_steps: int = 40, max_steps: int = 60) -> st.SearchStrategy[list[Transition]]:
    """Walks over the presets, still or shaken."""
    return st.builds(
        random_walk,
        seed=st.integers(0, 2**32 - 1),
        operators=st.sampled_from(("paper", "full", "modeller")),
        n_steps=st.integers(min_steps, max_steps),
        shake=st.sampled_from((0.0, 0.002, 0.02)),
    )


def meshes(max_steps: int = 20) -> st.SearchStrategy[PolyMesh]:
    """Meshes at the end of a walk: concave faces, holes, several parts, pinch vertices and, shaken, crossings."""
    return walks(1, max_steps).map(lambda walk: walk[-1].after)
