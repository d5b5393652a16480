"""Meshes that keep the rule of faces: extrusions of a rectangle, some deleted again, shaken as far as they keep it."""

import random

import numpy as np
from hypothesis import strategies as st

from autopoly_env.mesh import PolyMesh, is_sane
from autopoly_env.operators import OPERATORS, legal_actions


def ruled_walk(seed: int, n_steps: int, shake: float = 0.01) -> list[PolyMesh]:
    """The meshes of a random walk of `edge_extrude` and `face_delete` from a grid, all of convex quads."""
    rng = random.Random(seed)
    mesh = PolyMesh.grid(rng.choice((1, 1, 2)), 0.3, 0.3, 0.7, 0.7)
    walk = [mesh]
    while len(walk) < n_steps:
        name = rng.choice(("edge_extrude", "edge_extrude", "face_delete"))
        actions = legal_actions(mesh, [name]) or legal_actions(mesh, ["edge_extrude"])
        action = rng.choice(actions)
        made = OPERATORS[action.operator].apply(mesh, action.element)
        moves = np.array([(rng.gauss(0.0, shake), rng.gauss(0.0, shake)) for _ in made.vertex_ids])
        shaken = made.with_vertices(np.clip(made.vertices + moves, 0.0, 1.0))
        placed = made.with_vertices(np.clip(made.vertices, 0.0, 1.0))
        mesh = shaken if is_sane(shaken, "quads") else placed if is_sane(placed, "quads") else mesh
        walk.append(mesh)
    return walk


def ruled_meshes(max_steps: int = 12) -> st.SearchStrategy[PolyMesh]:
    """The last meshes of such walks."""
    return st.builds(lambda seed, n: ruled_walk(seed, n)[-1], st.integers(0, 2**32 - 1), st.integers(1, max_steps))
