"""Left and right alike: axes, images, ties, and play that keeps to them."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from autopoly_env.errors import ConfigError
from autopoly_env.guidance import asymmetry, best_axis
from autopoly_env.mesh import PolyMesh, defects_of, images_of, is_valid
from autopoly_env.operators import STOP, Action, legal_actions
from autopoly_env.refit import shape_kernels
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator
from tests.helpers.drawings import BOTTLE, HOUSE, noise, painted
from tests.helpers.guidance import START, assert_symmetric, play
from tests.helpers.shapes import hourglass, polygon


def test_best_axis__is_that_of_the_shape() -> None:
    assert best_axis(painted(HOUSE)) == 0.5
    assert best_axis(painted(shapely.affinity.translate(HOUSE, 0.125))) == 0.625
    assert best_axis(Silhouette(np.eye(4, dtype=bool))) == 0.375  # each row alone is symmetric, the first axis of two
    lopsided = painted(HOUSE.union(shapely.box(0.75, 0.6, 0.8, 0.65)))  # a small thing on one side moves it not
    assert best_axis(lopsided) == 0.5


@pytest.mark.parametrize("seed", range(4))
def test_best_axis__has_the_largest_overlap_of_all(seed: int) -> None:
    mask = noise(seed, 20).mask
    overlaps = {}
    for s in range(39):  # columns whose numbers add up to s are each other's images
        pairs = [(k, s - k) for k in range(20) if 0 <= s - k < 20]
        overlaps[(s + 1) / 40] = sum(int((mask[:, a] & mask[:, b]).sum()) for a, b in pairs)
    assert overlaps[best_axis(Silhouette(mask))] == max(overlaps.values())


def test_images__of_outlines_by_hand() -> None:
    assert images_of(START, 0.5).tolist() == [1, 0, 3, 2]  # type: ignore[union-attr]
    assert images_of(START, 0.45) is None
    house = polygon([(0.2, 0.9), (0.2, 0.5), (0.5, 0.2), (0.8, 0.5), (0.8, 0.9)])
    assert images_of(house, 0.5).tolist() == [4, 3, 2, 1, 0]  # type: ignore[union-attr]
    grid = PolyMesh.grid(2, 0.1, 0.1, 0.9, 0.9)
    assert images_of(grid, 0.5).tolist() == [2, 1, 0, 5, -1, 3, 8, 7, 6]  # type: ignore[union-attr]
    assert images_of(hourglass(), 0.5) is None
    bow = PolyMesh.from_faces([(0.1, 0.2), (0.5, 0.5), (0.1, 0.8), (0.9, 0.2), (0.9, 0.8)], [(0, 1, 2), (1, 3, 4)])
    assert images_of(bow, 0.5).tolist() == [3, 1, 4, 0, 2]  # type: ignore[union-attr]


def test_ties__are_the_linear_reduction_of_gradient_and_normal_matrix() -> None:
    """Unknowns 0 and 3 are images, 1 is on the axis, 2 is locked, 4 is free: x = R z, with z of 5 numbers."""
    leader, on_axis = np.array([0, 1, -1, 0, 4]), np.array([False, True, False, False, False])
    ties = shape_kernels.Ties(leader, on_axis, 0.5)
    reduction = np.zeros((10, 5))
    for row, column, sign in ((0, 0, 1), (1, 1, 1), (6, 0, -1), (7, 1, 1), (3, 2, 1), (8, 3, 1), (9, 4, 1)):
        reduction[row, column] = sign
    leading = [0, 1, 3, 8, 9]
    rng = np.random.default_rng(0)
    square = rng.random((10, 10))
    full, gradient = square @ square.T, rng.random((5, 2))
    normal, tied = np.tril(full), gradient.copy()
    shape_kernels.tie_gradient(ties, tied)
    shape_kernels.tie_normal(ties, normal)
    np.testing.assert_allclose(tied.ravel()[leading], reduction.T @ gradient.ravel(), rtol=1e-13)
    np.testing.assert_allclose(
        np.tril(normal[np.ix_(leading, leading)]), np.tril(reduction.T @ full @ reduction), rtol=1e-12
    )
    others = [k for k in range(10) if k not in leading]
    assert not tied.ravel()[others].any() and (np.tril(normal)[others] == np.eye(10)[others]).all()


@pytest.mark.slow
@pytest.mark.parametrize(("operators", "n_steps"), [("full", 20), ("modeller", 10)])
@given(st.integers(0, 2**32 - 1), st.sampled_from([True, 0.37]))
@settings(max_examples=6)
def test_symmetry__holds_after_any_play(operators: str, n_steps: int, seed: int, symmetry: bool | float) -> None:
    game = Simulator(noise(seed, 32), resolution=32, symmetry=symmetry, operators=operators)
    axis = game.guidance.axis
    assert axis is not None
    states = [game.initial()]
    for before, action, after in play(game, seed, n_steps):
        assert_symmetric(after.mesh, axis)
        assert defects_of(after.mesh) == (0, 0) and is_valid(after.mesh)
        (again,) = game.transition_all(before, [action])
        assert again == after
        states.append(after)
    made = [state for state in states if state.halfway]
    assert all(is_valid(state.halfway.mesh) for state in made if state.halfway)


def test_symmetry__calls_legal_what_works() -> None:
    game = Simulator(noise(1, 32), resolution=32, symmetry=True)
    *_, (_, _, state) = play(game, 1, 6)
    possible = legal_actions(state.mesh, game.operators)
    works = [child.action for child in game.transition_all(state, possible)]
    assert [STOP, *works] == game.legal_actions(state) and 1 < len(works) < len(possible)


def test_symmetry__doubles_actions_that_are_not_their_own_image() -> None:
    game = Simulator(painted(BOTTLE), resolution=64, symmetry=0.5)
    state = game.initial()
    mesh = state.mesh
    side = game.transition(state, Action("edge_subdivide", mesh.edge_index(0, 3)))
    top = game.transition(state, Action("edge_subdivide", mesh.edge_index(0, 1)))
    assert side.mesh.counts == (6, 6, 1) and side.halfway is not None and side.step == 1
    assert side.halfway.mesh.counts == (5, 5, 1)
    assert top.mesh.counts == (5, 5, 1) and top.halfway is None and top.mesh.vertices[4, 0] == 0.5
    bottle = max(game.transition_all(state), key=lambda child: child.score.total)
    assert bottle.mesh.counts == (6, 6, 1) and bottle.score.iou > 0.99


@pytest.mark.parametrize(("n_more", "axis"), [(0, 0.5), (12, 0.5), (20, None)])
def test_auto__is_symmetry_where_all_but_a_hundredth_of_the_area_is(n_more: int, axis: float | None) -> None:
    mask = np.zeros((64, 64), np.bool_)
    mask[8:56, 4:60] = True  # 2688 pixels, about x = 0.5
    mask[8 : 8 + n_more // 4, 60:64] = True  # to one side only
    silhouette = Silhouette(mask)
    assert asymmetry(silhouette, 0.5) == pytest.approx(2 * n_more / (2688 + n_more))  # there, and missing in the image
    assert Simulator(silhouette, resolution=32, symmetry="auto").guidance.axis == axis


@pytest.mark.parametrize(("shift", "wish", "axis"), [(0.01, "auto", None), (0.01, True, 0.51), (0.001, "auto", 0.501)])
def test_symmetry__is_about_the_axis_that_the_start_has(shift: float, wish: bool | str, axis: float | None) -> None:
    """`auto` only where the picture nearly has it, too: that of a bottle of 64 pixels has it about the nearest half."""
    start = START.with_vertices(START.vertices + (shift, 0.0))
    found = Simulator(painted(BOTTLE), resolution=64, start=start, symmetry=wish).guidance.axis
    assert found == pytest.approx(axis) if axis else found is None


def test_auto__gives_way_to_a_start_that_is_not_symmetric() -> None:
    start = PolyMesh.from_faces([(0.2, 0.2), (0.9, 0.3), (0.7, 0.8), (0.2, 0.8)], [(0, 1, 2, 3)])
    assert Simulator(painted(BOTTLE), start=start, symmetry="auto").guidance.axis is None
    with pytest.raises(ConfigError, match="symmetry 'left': expected 'auto', True or the x of the axis"):
        Simulator(painted(BOTTLE), symmetry="left")
