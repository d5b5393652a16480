"""Vertices that stay where they are."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autopoly_env.errors import IllegalActionError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import Action
from autopoly_env.refit import FROM_AFAR, Bonds, RefitTarget, refit
from autopoly_env.simulator import Simulator
from tests.helpers.drawings import BOTTLE, HOUSE, noise, painted
from tests.helpers.guidance import play


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=8)
def test_locked_vertices__are_neither_moved_nor_removed(seed: int) -> None:
    grid = PolyMesh.grid(2, 0.2, 0.25, 0.8, 0.8)
    locked = {0, 4, 7}  # a corner, the inner vertex, the middle of a side
    game = Simulator(noise(seed, 32), resolution=32, start=grid, locked=locked)
    for _, _, after in play(game, seed, 10):
        for name in locked:
            at = after.mesh.vertices[after.mesh.vertex_index(name)]
            assert at.tobytes() == grid.vertices[name].tobytes()
    polished = game.polish(after.mesh)
    for name in locked:
        assert (polished.vertices[polished.vertex_index(name)] == grid.vertices[name]).all()


def test_locked_vertices__forbid_what_would_remove_them() -> None:
    strip = PolyMesh.from_faces(
        [(0.2, 0.3), (0.5, 0.3), (0.8, 0.3), (0.8, 0.7), (0.5, 0.7), (0.2, 0.7)], [(0, 1, 4, 5), (1, 2, 3, 4)]
    )
    game = Simulator(painted(HOUSE), resolution=32, start=strip, locked=(2,))
    state = game.initial()
    assert Action("face_delete", 1) not in game.legal_actions(state)
    assert Action("face_delete", 0) in game.legal_actions(state)
    assert {a.element for a in game.legal_actions(state) if a.operator == "vertex_dissolve"} == {0, 3, 5}
    for action in (Action("face_delete", 1), Action("vertex_dissolve", 2)):
        with pytest.raises(IllegalActionError, match="would remove vertex 2, which is locked"):
            game.transition(state, action)
        assert game.transition_all(state, [action]) == []
    assert len(game.transition_all(state)) == len(game.legal_actions(state)) - 1


def test_locked_vertices__let_the_others_find_their_place() -> None:
    """A bottle of which the foot is held: the neck is found all the same."""
    start = PolyMesh.from_faces([(0.3, 0.8), (0.2, 0.5), (0.35, 0.2), (0.65, 0.2), (0.8, 0.5), (0.7, 0.8)], [range(6)])
    bonds = Bonds(np.isin(np.arange(6), (0, 5)), np.full(6, -1))
    fitted = refit(start, RefitTarget.of(painted(BOTTLE), 64), FROM_AFAR, bonds).mesh
    assert fitted.vertices[[0, 5]].tobytes() == start.vertices[[0, 5]].tobytes()
    np.testing.assert_allclose(fitted.vertices[2:4], [(0.4, 0.125), (0.6, 0.125)], atol=0.02)
