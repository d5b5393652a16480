"""Where matching matters: weights in kernels, scores and pictures."""

import pickle

import numpy as np
import pytest
import shapely

from autopoly_env.arrays import FloatArray
from autopoly_env.guidance import weighted
from autopoly_env.mesh import PolyMesh
from autopoly_env.placement import Disagreement
from autopoly_env.placement.blame_kernels import MASS, MEAN_X
from autopoly_env.raster import coverage, derivative_kernels, loss_and_gradient, loss_and_gradient_many
from autopoly_env.raster import rasteriser as raster
from autopoly_env.refit import FROM_AFAR, RefitTarget, refit
from autopoly_env.score import intersection_over_union
from autopoly_env.silhouette import Target, area_means, load_silhouette
from autopoly_env.simulator import Simulator
from tests.helpers.drawings import HOUSE, TWO_SQUARES, painted
from tests.helpers.guidance import LEFT, solve
from tests.helpers.shapes import central_differences, frame, hourglass, polygon, shapely_coverage, star


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
def test_weighted_normal_equations__equal_those_of_each_edges_dense_jacobian(mesh: PolyMesh) -> None:
    size, batch = 9, raster.batch_of([mesh])
    target, weights = weighted_target(9)
    n = len(mesh.vertices)
    pixels = np.eye(size**2).reshape(size**2, size, size)
    many = raster.batch_of([mesh] * size**2)
    jacobian = raster.coverage_vjp(many, pixels).reshape(size**2, 2 * n) / size
    residual = (coverage(mesh, size) - target.coverage).ravel()
    weights = weights.ravel()
    gradient, normal = np.zeros((n, 2)), np.zeros((2 * n, 2 * n))
    work = raster.workspace(size, len(batch.edges))
    loss = derivative_kernels.normal_equations(
        batch.points, batch.edges, raster.picture_of(target), work, gradient, normal
    )
    assert loss == pytest.approx(weights @ residual**2, rel=1e-11)
    np.testing.assert_allclose(gradient.ravel(), jacobian.T @ (weights * residual), rtol=0, atol=1e-12)
    expected = np.zeros_like(normal)
    edges, starts = many.edges.reshape(len(many), -1, 2), np.arange(len(many) + 1)
    for e in range(len(batch.edges)):
        alone = raster.Batch(many.points, edges[:, e].copy(), many.point_starts, starts)
        one = raster.coverage_vjp(alone, pixels).reshape(size**2, 2 * n) / size
        expected += one.T @ (weights[:, None] * one)
    np.testing.assert_allclose(normal, np.tril(expected), rtol=0, atol=1e-12)


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
