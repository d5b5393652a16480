"""Guidance: where matching matters, vertices that stay, a mesh or sequence to go on from, and left-right symmetry."""

import pickle
import random
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from agents.budget import Budget, Meter
from agents.finish import finish
from agents.registry import AGENTS, make_agent
from agents.solution import Solution
from agents.solve import main
from autopoly_env.arrays import FloatArray
from autopoly_env.errors import ConfigError, IllegalActionError, MeshError
from autopoly_env.export import from_obj, load_obj, to_obj
from autopoly_env.guidance import best_axis, weighted
from autopoly_env.guidance.symmetry import images_of, mirrored
from autopoly_env.mesh import PolyMesh, defects_of, is_valid
from autopoly_env.operators import STOP, Action, legal_actions
from autopoly_env.placement import Disagreement
from autopoly_env.placement.blame_kernels import MASS, MEAN_X
from autopoly_env.raster import coverage, derivative_kernels, loss_and_gradient, loss_and_gradient_many
from autopoly_env.raster import rasteriser as raster
from autopoly_env.refit import FROM_AFAR, Bonds, RefitTarget, refit, shape_kernels
from autopoly_env.score import intersection_over_union
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import Silhouette, Target, area_means, load_silhouette
from autopoly_env.simulator import Simulator, State
from docs import draw_guidance
from tests.helpers.drawings import BOTTLE, FRAME, HOUSE, L_SHAPE, TWO_SQUARES, noise, painted
from tests.helpers.shapes import central_differences, frame, hourglass, polygon, shapely_coverage, star

PLAYERS = ("greedy", "beam", "random", "mcts")
WHOLE = ("trace", "climb", "decimate", "dr-simple", "dr-complex")
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


def weighted_target(resolution: int, seed: int = 0) -> tuple[Target, FloatArray]:
    """Random levels with random weights, a third of them 0; and the weights."""
    rng = np.random.default_rng(seed)
    weights = np.maximum(rng.random((resolution, resolution)) - 0.33, 0.0)
    target = Target(rng.random((resolution, resolution)), weights)
    assert target.weights is not None
    return target, target.weights


# --- where matching matters: kernels


def test_weighted_loss_and_gradient__equal_brute_force_over_shapelys_pixels() -> None:
    """A ring on more pixels than one word of the bit set has bits, with a part outside of the image."""
    mesh = frame(star(2, 4, center=(0.81, 0.52)), np.array((0.81, 0.52)) + 0.4 * (star(2, 4) - 0.5))

    def brute(points: np.ndarray) -> float:
        image = shapely_coverage(shapely.Polygon(points[:4], [points[4:]]), target.resolution)
        return float((weights * (image - target.coverage) ** 2).sum())

    target, weights = weighted_target(70)
    assert (weights == 0.0).mean() > 0.2
    assert loss_and_gradient(mesh, target)[0] == pytest.approx(brute(mesh.vertices), rel=1e-10)
    target, weights = weighted_target(16)
    loss, gradient = loss_and_gradient(mesh, target)
    expected = central_differences(brute, mesh.vertices, 1e-6)
    assert loss == pytest.approx(brute(mesh.vertices), rel=1e-10)
    assert np.linalg.norm(gradient - expected) <= 1e-6 * np.linalg.norm(expected)
    losses, gradients = loss_and_gradient_many([mesh, mesh], target)
    assert losses.tolist() == [loss, loss] and (gradients[1] == gradient).all()


@pytest.mark.parametrize("mesh", [hourglass(), polygon(star(0, 12))], ids=["pinch", "concave"])
def test_weighted_normal_equations__equal_those_of_the_dense_jacobian(mesh: PolyMesh) -> None:
    size, batch = 9, raster.batch_of([mesh])
    target, weights = weighted_target(9)
    n = len(mesh.vertices)
    pixels = np.eye(size**2).reshape(size**2, size, size)
    jacobian = raster.coverage_vjp(raster.batch_of([mesh] * size**2), pixels).reshape(size**2, 2 * n) / size
    residual = (coverage(mesh, size) - target.coverage).ravel()
    weights = weights.ravel()
    gradient, normal = np.zeros((n, 2)), np.zeros((2 * n, 2 * n))
    work = raster.workspace(size, len(batch.edges))
    loss = derivative_kernels.normal_equations(
        batch.points, batch.edges, raster.picture_of(target), work, gradient, normal
    )
    assert loss == pytest.approx(weights @ residual**2, rel=1e-11)
    np.testing.assert_allclose(gradient.ravel(), jacobian.T @ (weights * residual), rtol=0, atol=1e-12)
    np.testing.assert_allclose(normal, np.tril(jacobian.T @ (weights[:, None] * jacobian)), rtol=0, atol=1e-12)


@pytest.mark.parametrize("resolution", [1, 10, 64, 130])
def test_weighted_iou__is_weights_of_the_intersection_over_those_of_the_union(resolution: int) -> None:
    target, weights = weighted_target(resolution, seed=1)
    for mesh in (hourglass(), polygon(1.5 * star(1, 9) - 0.4)):
        covered = coverage(mesh, resolution) >= 0.5
        both = (weights * (covered & target.mask)).sum()
        either = (weights * (covered | target.mask)).sum()
        assert intersection_over_union(mesh, target) == (both / either if either else 1.0)


# --- where matching matters: the picture


def test_area_means__by_hand() -> None:
    levels = np.array([[0.0, 0.4], [0.8, 1.0]])
    assert area_means(levels, (1, 1)).tolist() == [[pytest.approx(0.55)]]
    assert area_means(levels, (4, 2))[:, 0].tolist() == pytest.approx([0.0, 0.0, 0.8, 0.8])
    assert area_means(levels, (2, 3))[0].tolist() == pytest.approx([0.0, 0.2, 0.4])


def test_importance__lies_on_the_picture_as_it_was_padded() -> None:
    """A picture of 4 x 2 pixels in a frame of 4 x 4: the padding weighs as much as the edge beside it."""
    target = load_silhouette(np.array([[0, 1, 1, 0], [0, 1, 1, 0]], bool))
    found = weighted(target, np.array([[0.25, 0.5], [0.25, 0.25]], np.float64)[:1])
    assert np.asarray(found.weights).tolist() == [[0.5, 0.5, 1.0, 1.0]] * 4
    square = weighted(target, np.array([[0.2, 0.2], [0.1, 0.1]]))  # for the frame, padding and all
    assert np.asarray(square.weights)[:, 0].tolist() == pytest.approx([1.0, 1.0, 0.5, 0.5])


@pytest.mark.parametrize(("shape", "level"), [((17, 31), 1), ((7, 7), 128), ((1, 1), 255)])
def test_importance__of_one_grey_is_none_bit_for_bit(shape: tuple[int, int], level: int) -> None:
    wide = load_silhouette(np.pad(np.ones((9, 23), bool), 4))
    plain = Simulator(wide, resolution=32)
    guided = Simulator(wide, resolution=32, importance=np.full(shape, level, np.uint8))
    assert guided.settings() == plain.settings() and guided.silhouette is wide
    assert solve("greedy", guided).sequence.to_json() == solve("greedy", plain).sequence.to_json()


def test_importance__decides_which_of_two_squares_is_matched() -> None:
    target = painted(TWO_SQUARES, 32)
    for half, centre in ((LEFT, 0.25), (~LEFT, 0.75)):
        game = Simulator(target, resolution=32, importance=half.astype(np.float64))
        state = game.initial()
        assert state.done == "matched" and state.score.iou == 1.0  # whatever is on the other side
        start = PolyMesh.rectangle(centre - 0.2, 0.3, centre + 0.2, 0.7)
        fitted = refit(start, RefitTarget.of(game.silhouette, 32), FROM_AFAR).mesh
        box = shapely.box(centre - 0.125, 0.375, centre + 0.125, 0.625)
        assert shapely.Polygon(fitted.vertices).symmetric_difference(box).area < 0.01


def test_importance__of_nothing_is_no_reason_to_act() -> None:
    whole = painted(TWO_SQUARES, 32)
    guided = weighted(whole, np.where(LEFT, 0.5, 0.0))
    missing = Disagreement(PolyMesh.rectangle(0.4, 0.1, 0.6, 0.2), guided)
    assert missing.n_regions == 2  # the left square, and the left half of the rectangle
    assert missing.regions[:, MEAN_X].max() < 0.5
    full = Disagreement(PolyMesh.rectangle(0.4, 0.1, 0.6, 0.2), whole)
    assert full.n_regions == 3
    assert missing.blame[:, 0, MASS].sum() == pytest.approx(0.25**2)  # weights are as the brightest pixel, 1


def test_importance__survives_pickling_and_threads() -> None:
    target = weighted(painted(HOUSE, 32), np.linspace(0.0, 1.0, 64).reshape(8, 8))
    copy = pickle.loads(pickle.dumps(target))
    assert (copy.target(16).weights == target.target(16).weights).all()
    assert not np.asarray(copy.target(16).weights).flags.writeable


# --- vertices that stay


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


# --- a mesh or a sequence to go on from


def test_start__is_the_first_state_as_it_is() -> None:
    game = Simulator(painted(HOUSE), resolution=32, start=START)
    state = game.initial()
    assert state.mesh == START and (state.n_refits, state.step) == (0, 0)
    solution = make_agent("greedy").solve(game, Budget(refits=0))
    assert solution.mesh == START and solution.sequence.start == START and not solution.sequence.steps


@pytest.mark.parametrize("name", PLAYERS)
def test_sequence__is_gone_on_from_and_replays_from_its_own_start(name: str) -> None:
    first = solve("greedy", Simulator(painted(L_SHAPE), resolution=32, operators="paper"), refits=20).sequence
    assert first.steps
    game = Simulator(painted(L_SHAPE), resolution=32, start=first)
    solution = solve(name, game)
    whole = ConstructionSequence.from_json(solution.sequence.to_json())
    n = len(first.steps)
    assert whole.start == first.start and whole.meshes()[n] == first.final()
    assert [step.element for step in whole.steps[:n]] == [step.element for step in first.steps]
    assert whole.final() == solution.mesh and whole.settings["earlier_steps"] == n
    totals = [whole.start_score["total"], *(step.score["total"] for step in whole.steps)]
    assert totals == [game.final_score(mesh).total for mesh in whole.meshes()]
    assert solution.score.total >= game.final_score(first.final()).total


def test_obj__comes_back_with_its_polygons() -> None:
    for mesh in (PolyMesh.grid(2, 0.1, 0.2, 0.8, 0.9), hourglass(), polygon(star(3, 9))):
        read = from_obj(to_obj(mesh))
        assert read.faces == mesh.faces
        np.testing.assert_allclose(read.vertices, mesh.vertices, rtol=0, atol=1e-15)


def test_obj__of_other_programs_is_read() -> None:
    text = "mtllib a.mtl\no quad\nv 0.1 0.1 5\nv .9 .1 0 1.0\nv 0.9 0.9 0\nv 1e-1 0.9 0\nvn 0 0 1\nvt 0 0\ns off\n"
    for face in ("f 1/1/1 2/1/1 3/1/1 4/1/1", "f -4 -3 -2 -1", "f 4//1 3//1 2//1 1//1 # seen from behind"):
        mesh = from_obj(text + face)
        assert mesh.face_areas().tolist() == [pytest.approx(0.64)]
        assert mesh.vertices[0].tolist() == [0.1, 0.9]


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "0 vertices and 0 faces"),
        ("v 0 0 0\nf 1 2 3", "line 2 of the OBJ text, 'f 1 2 3': vertex 2 is not among the 1 so far"),
        ("v 0 0", "expected v x y z"),
        ("v 0 zero 0", "could not convert"),
        ("v 0 0 0\nv 1 0 0\nf 1 2", "at least 3 corners"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 0 1 2", "vertex 0 is not among"),
        ("v nan 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3", "vertex 0 is not finite"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3", "vertex 3 belongs to no face"),
    ],
)
def test_obj__that_is_broken_is_refused_in_one_line(text: str, complaint: str, tmp_path: Path) -> None:
    (tmp_path / "broken.obj").write_text(text)
    with pytest.raises(MeshError, match=complaint) as caught:
        load_obj(tmp_path / "broken.obj")
    assert "\n" not in str(caught.value) and "broken.obj" in str(caught.value)


# --- symmetry


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


def assert_symmetric(mesh: PolyMesh, axis: float) -> None:
    images = images_of(mesh, axis)
    assert images is not None
    paired = images >= 0
    opposite = mirrored(mesh.vertices[images[paired]], axis)
    np.testing.assert_allclose(mesh.vertices[paired], opposite, rtol=0, atol=1e-12)
    assert (paired == mesh.topology.is_boundary_vertex).all()


@given(st.integers(0, 2**32 - 1), st.sampled_from([True, 0.37]))
@settings(max_examples=6)
def test_symmetry__holds_after_any_play(seed: int, symmetry: bool | float) -> None:
    game = Simulator(noise(seed, 32), resolution=32, symmetry=symmetry)
    axis = game.guidance.axis
    assert axis is not None
    states = [game.initial()]
    for before, action, after in play(game, seed, 20):
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


def test_symmetry__finds_the_frame_and_both_squares() -> None:
    framed = Simulator(painted(FRAME), resolution=64, symmetry=True)
    holed = max(framed.transition_all(framed.initial()), key=lambda child: child.score.total)
    assert holed.mesh.topology.n_holes == 1 and holed.halfway is None and holed.score.iou > 0.97
    two = painted(FRAME.difference(shapely.box(0.45, 0.0, 0.55, 1.0)) | shapely.box(0.45, 0.2, 0.55, 0.8))
    assert solve("greedy", Simulator(two, resolution=64, symmetry=True), 300).score.iou > 0.9


@pytest.mark.parametrize("name", PLAYERS)
def test_symmetric_solutions__record_both_halves_of_every_step(name: str) -> None:
    solution = solve(name, Simulator(painted(BOTTLE), resolution=32, symmetry=True), refits=100)
    sequence = ConstructionSequence.from_json(solution.sequence.to_json())
    assert sequence.final() == solution.mesh and sequence.settings["symmetry"] == 0.5
    assert all(is_valid(mesh) for mesh in sequence.meshes())
    assert_symmetric(solution.mesh, 0.5)


def test_finish__records_half_way_states() -> None:
    game = Simulator(painted(BOTTLE), resolution=32, symmetry=0.5)
    states = [game.initial()]
    states.append(game.transition(states[0], Action("edge_subdivide", states[0].mesh.edge_index(0, 3))))
    steps = finish(game, states, Meter.unlimited()).sequence.steps
    assert [step.operator for step in steps] == ["edge_subdivide", "edge_subdivide"]
    assert [sorted(step.element["edge"]) for step in steps] == [[0, 3], [1, 2]]  # type: ignore[arg-type]


# --- all at once, and what is refused


@pytest.mark.parametrize("name", PLAYERS)
def test_players__heed_all_guidance_at_once(name: str) -> None:
    game = Simulator(
        painted(HOUSE), resolution=32, start=START, locked=(2, 3), symmetry=0.5,
        importance=np.linspace(0.2, 1.0, 16).reshape(16, 1) @ np.ones((1, 16)),
    )  # fmt: skip
    solution = solve(name, game)
    assert_symmetric(solution.mesh, 0.5)
    for vertex in (2, 3):
        assert (solution.mesh.vertices[solution.mesh.vertex_index(vertex)] == START.vertices[vertex]).all()
    said = solution.sequence.settings
    assert (said["locked"], said["symmetry"]) == ([2, 3], 0.5) and len(said["importance"]) == len(said["start"]) == 32
    assert solution.score.total >= game.final_score(START).total


@pytest.mark.parametrize("name", WHOLE)
def test_agents_that_find_wholes__take_importance_and_nothing_else(name: str) -> None:
    game = Simulator(painted(L_SHAPE), resolution=32, importance=np.where(LEFT, 1.0, 0.3))
    assert solve(name, game, refits=10).sequence.settings["importance"]
    for guidance in ({"start": START}, {"start": START, "locked": (0,)}, {"symmetry": True}):
        with pytest.raises(ConfigError, match=f"{name} .* cannot heed '(start|symmetry)'.* greedy"):
            solve(name, Simulator(painted(L_SHAPE), resolution=32, **guidance))


def test_every_agent__says_whether_it_takes_guidance() -> None:
    for name in set(AGENTS) & {*PLAYERS, *WHOLE}:
        assert make_agent(name).takes_guidance == (name in PLAYERS)


FLIPPED = PolyMesh.from_faces([(0.2, 0.2), (0.2, 0.8), (0.8, 0.8), (0.8, 0.2)], [(0, 1, 2, 3)])
CROSSED = polygon([(0.1, 0.1), (0.9, 0.1), (0.1, 0.6), (0.9, 0.9)])
LOPSIDED = polygon([(0.1, 0.1), (0.9, 0.2), (0.8, 0.8), (0.2, 0.9)])


@pytest.mark.parametrize(
    ("guidance", "complaint"),
    [
        ({"locked": (0,)}, "no start mesh"),
        ({"start": START, "locked": (0, 7)}, "locked vertex 7 is not in the start mesh"),
        ({"start": START, "locked": (0,), "symmetry": 0.5}, "its mirror image 1 is not"),
        ({"start": LOPSIDED, "symmetry": 0.5}, "not symmetric about x = 0.5"),
        ({"start": CROSSED}, "cross"),
        ({"start": FLIPPED}, "flipped"),
        ({"start": START.with_vertices(START.vertices + 0.5)}, "outside the unit square"),
        ({"start": START.with_vertices(START.vertices * np.nan)}, "not finite"),
        ({"start": "mug.obj"}, "expected a PolyMesh or a ConstructionSequence"),
        ({"start": START, "operators": "weld"}, "weld"),
        ({"symmetry": 0.0}, "well inside"),
        ({"symmetry": 1.2}, "well inside"),
        ({"symmetry": float("nan")}, "well inside"),
        ({"importance": np.zeros((4, 4))}, "black all over"),
        ({"importance": np.full((4, 4), np.nan)}, "NaN"),
        ({"importance": np.full((4, 4), -0.5)}, "spans -0.5"),
        ({"importance": np.full((4, 4), 300.0)}, "spans 300"),
        ({"importance": np.eye(4)[:3]}, "4x3 pixels"),
        ({"importance": np.pad(np.ones((4, 1)), ((0, 0), (0, 31)))[:, :4]}, "black on all of the object"),
        ({"importance": __file__}, "not an image"),
        ({"importance": "nothere.png"}, "does not exist"),
    ],
)
def test_impossible_guidance__is_one_clear_error(guidance: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ConfigError, match=complaint) as caught:
        Simulator(painted(HOUSE), resolution=32, **guidance)
    assert "\n" not in str(caught.value)


def test_initial__of_another_mesh_has_to_be_symmetric() -> None:
    game = Simulator(painted(HOUSE), resolution=32, symmetry=True)
    with pytest.raises(ConfigError, match="not symmetric"):
        game.initial(LOPSIDED)
    with pytest.raises(IllegalActionError, match="not symmetric"):
        game.transition(State(LOPSIDED, game.score(LOPSIDED)), Action("edge_subdivide", 0))


def test_unguided_settings__are_those_without_guidance() -> None:
    said = Simulator(painted(HOUSE)).settings()
    assert not {"importance", "start", "earlier_steps", "locked", "symmetry"} & said.keys()


# --- the command


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., int]:
    monkeypatch.chdir(tmp_path)
    Image.fromarray(painted(BOTTLE, 64).mask).save("bottle.png")
    Path("box.obj").write_text(to_obj(START))
    return lambda *words: main(["bottle.png", "--resolution", "32", "--refits", "40", "--quiet", *map(str, words)])


def test_command__takes_all_guidance(command: Callable[..., int]) -> None:
    Image.fromarray((255 * LEFT).astype(np.uint8) // 2 + 100).save("left.png")
    guided = ("--importance", "left.png", "--start", "box.obj", "--lock", "2,3", "--symmetry", "auto")
    assert command("--agent", "greedy", *guided) == 0
    sequence = ConstructionSequence.load("out/bottle/sequence.json")
    assert sequence.settings["locked"] == [2, 3] and sequence.settings["symmetry"] == 0.5
    assert sequence.settings["guided_by"] == {"importance": "left.png", "start": "box.obj"}
    assert (sequence.final().vertices[[2, 3]] == from_obj(to_obj(START)).vertices[[2, 3]]).all()


def test_command__goes_on_from_a_sequence(command: Callable[..., int]) -> None:
    assert command("--agent", "greedy", "--refits", "5") == 0
    Path("out/bottle/sequence.json").rename("first.json")
    assert command("--agent", "greedy", "--start", "first.json") == 0
    whole, first = (ConstructionSequence.load(path) for path in ("out/bottle/sequence.json", "first.json"))
    assert whole.start == first.start and whole.meshes()[len(first.steps)] == first.final()


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--agent", "climb", "--symmetry", "auto"), "climb finds outlines as a whole and cannot heed 'symmetry'"),
        (("--agent", "greedy", "--lock", "1"), "no start mesh"),
        (("--agent", "greedy", "--start", "box.obj", "--lock", "one"), "--lock one: expected ids"),
        (("--agent", "greedy", "--start", "box.obj", "--lock", "9"), "locked vertex 9"),
        (("--agent", "greedy", "--start", "bottle.png"), "expected a mesh"),
        (("--agent", "greedy", "--start", "nothere.obj"), "cannot read nothere.obj"),
        (("--agent", "greedy", "--start", "nothere.json"), "cannot read nothere.json"),
        (("--agent", "greedy", "--symmetry", "left"), "--symmetry left: expected auto"),
        (("--importance", "box.obj"), "not an image"),
    ],
)
def test_command__refuses_wrong_guidance_in_one_line(
    command: Callable[..., int], capsys: pytest.CaptureFixture[str], words: tuple[str, ...], complaint: str
) -> None:
    assert command(*words) == 2
    out, err = capsys.readouterr()
    assert not out and err.count("\n") == 1 and complaint in err


def test_pictures__are_those_that_the_text_shows() -> None:
    text = (draw_guidance.PICTURES.parent / "guidance.md").read_text(encoding="utf-8")
    drawn = {f"guidance-{name}.png" for name in draw_guidance.DRAWINGS}
    assert drawn == {path.name for path in draw_guidance.PICTURES.glob("guidance-*.png")}
    assert all(f"(pictures/{name})" in text for name in drawn)
