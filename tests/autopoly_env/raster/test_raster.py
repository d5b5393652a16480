"""The rasteriser: coverage against shapely and exact fractions, derivatives, batches, and a clean workspace."""

from collections.abc import Iterator
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.compute import set_threads
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import OPERATORS
from autopoly_env.raster import (
    Batch,
    coverage,
    coverage_many,
    derivative_kernels,
    loss_and_gradient,
    loss_and_gradient_many,
    raster_kernels,
)
from autopoly_env.raster import rasteriser as raster
from autopoly_env.silhouette import Target
from tests.helpers.shapes import (
    central_differences,
    exact_coverage,
    frame,
    hourglass,
    loop,
    polygon,
    shapely_coverage,
    star,
)
from tests.helpers.strategies import meshes

TOLERANCE = 1e-10  # of a pixel's area
RING = frame(star(3, 7), 0.5 + 0.4 * (star(3, 7) - 0.5))


def single(points: FloatArray, edges: IntArray) -> Batch:
    """A batch of one set of loops, which need not belong to a mesh."""
    return Batch(points, edges, np.array([0, len(points)]), np.array([0, len(edges)]))


def picture_of(points: npt.ArrayLike, edges: IntArray, resolution: int) -> FloatArray:
    return raster.coverage_of_batch(single(np.array(points, np.float64), edges), resolution)[0]


def random_target(resolution: int, seed: int = 0) -> Target:
    return Target(np.random.default_rng(seed).random((resolution, resolution)))


def assert_clean(resolution: int, n_edges: int) -> None:
    work = raster.workspace(resolution, n_edges)
    assert not work.cells.any() and not work.touched.any()


# --- coverage, by hand ---


def test_coverage__of_a_triangle_over_half_the_image() -> None:
    triangle = polygon([(0, 0), (1, 0), (0, 1)])
    assert coverage(triangle, 1).tolist() == [[0.5]]
    assert coverage(triangle, 3).tolist() == [[1, 1, 0.5], [1, 0.5, 0], [0.5, 0, 0]]


def test_coverage__counts_overlapping_faces_twice() -> None:
    points = [(0, 0), (0.5, 0), (0.5, 1), (0, 1), (0.25, 0), (0.75, 0), (0.75, 1), (0.25, 1)]
    both = PolyMesh.from_faces(points, [(0, 1, 2, 3), (4, 5, 6, 7)])
    assert coverage(both, 4).tolist() == [[1, 2, 1, 0]] * 4


def test_coverage__of_a_figure_eight_is_negative_where_it_runs_backwards() -> None:
    assert picture_of([(0, 0), (1, 1), (1, 0), (0, 1)], loop(4), 2).tolist() == [[0.5, -0.5]] * 2


def test_coverage__of_a_mesh_without_a_boundary_is_zero() -> None:
    closed = PolyMesh.from_faces(
        [(0.1, 0.1), (0.9, 0.1), (0.5, 0.9), (0.5, 0.4)], [(0, 1, 3), (1, 2, 3), (2, 0, 3), (0, 2, 1)]
    )
    assert not coverage(closed, 4).any()
    loss, gradient = loss_and_gradient(closed, Target(np.ones((4, 4))))
    assert loss == 16.0 and not gradient.any()


@pytest.mark.parametrize("resolution", [0, -1, 16385])
def test_coverage__refuses_a_senseless_resolution(resolution: int) -> None:
    with pytest.raises(ConfigError, match="1 to 16384"):
        coverage(RING, resolution)
    with pytest.raises(ConfigError, match="1 to 16384"):
        coverage_many([], resolution)


# --- coverage, against the areas of intersections ---


@pytest.mark.slow
@pytest.mark.parametrize("resolution", [1, 2, 3, 7, 33, 63, 64, 65, 127, 128, 129, 200])
def test_coverage__of_concave_polygons_equals_shapely(resolution: int) -> None:
    for seed in range(3 if resolution > 100 else 8):
        points = star(seed, 4 + 3 * seed)
        expected = shapely_coverage(shapely.Polygon(points), resolution)
        np.testing.assert_allclose(coverage(polygon(points), resolution), expected, rtol=0, atol=TOLERANCE)


@pytest.mark.slow
@pytest.mark.parametrize("resolution", [5, 64, 131])
def test_coverage__of_shapes_with_a_hole_equals_shapely(resolution: int) -> None:
    cut = OPERATORS["face_hole"].apply(polygon(star(5, 9)), 1)
    for mesh in (RING, cut):
        expected = sum(shapely_coverage(shapely.Polygon(mesh.vertices[list(f)]), resolution) for f in mesh.faces)
        assert len(mesh.topology.boundary_loops) == 2
        np.testing.assert_allclose(coverage(mesh, resolution), expected, rtol=0, atol=TOLERANCE)


def test_coverage__of_a_reversed_loop_is_a_hole() -> None:
    outer, inner = star(1, 9), 0.5 + 0.3 * (star(1, 9) - 0.5)[::-1]
    image = picture_of(np.concatenate((outer, inner)), np.concatenate((loop(9), loop(9, first=9))), 20)
    expected = shapely_coverage(shapely.Polygon(outer, [inner]), 20)
    np.testing.assert_allclose(image, expected, rtol=0, atol=TOLERANCE)


@pytest.mark.parametrize("resolution", [6, 70])
@pytest.mark.parametrize("x", [-0.2, 0.5, 1.2])
@pytest.mark.parametrize("y", [-0.2, 0.5, 1.2])
def test_coverage__of_polygons_that_leave_the_image_equals_shapely(x: float, y: float, resolution: int) -> None:
    for radius in (0.1, 0.6, 3.0):
        points = star(7, 11, center=(x, y), radius=radius)
        expected = shapely_coverage(shapely.Polygon(points), resolution)
        np.testing.assert_allclose(coverage(polygon(points), resolution), expected, rtol=0, atol=TOLERANCE)


TINY = st.sampled_from([0.0] * 6 + [1e-15, -1e-12, 1e-9, -1e-6, 1e-300])
LATTICE = st.builds(lambda half, tiny: half / 2 + tiny, st.integers(-2, 10), TINY)  # in pixels


@pytest.mark.slow
@given(st.lists(st.tuples(LATTICE, LATTICE), min_size=3, max_size=6), st.sampled_from([1, 3, 4]))
@settings(max_examples=150)
def test_coverage__of_any_loop_on_pixel_borders_equals_exact_fractions(
    points: list[tuple[float, float]], resolution: int
) -> None:
    """Crossing, empty, sliver and outside loops, with vertices and edges on or next to the borders of pixels."""
    at, edges = np.array(points) / resolution, loop(len(points))
    expected = exact_coverage(at, edges, resolution).astype(float)
    np.testing.assert_allclose(picture_of(at, edges, resolution), expected, rtol=0, atol=TOLERANCE)
    assert_clean(resolution, len(edges))


@pytest.mark.parametrize("width", [0.0, 1e-300, 1e-16, 1e-12, 1e-9, 1e-5])
def test_coverage__of_a_sliver_sums_to_its_area(width: float) -> None:
    for end in ((0.9, 0.35), (0.1, 0.95), (0.9, 0.1), (0.8, 0.8)):
        points = np.array([(0.1, 0.1), end, (end[0] - width, end[1] + width)])
        area = shapely.Polygon(points).area
        for resolution in (1, 8, 65):
            image = picture_of(points, loop(3), resolution)
            assert abs(image.sum()) / resolution**2 == pytest.approx(area, rel=1e-6, abs=1e-15)


def test_coverage__of_a_grid_depends_on_its_outline_only() -> None:
    grid, outline = PolyMesh.grid(3, 0.12, 0.2, 0.77, 0.9), PolyMesh.rectangle(0.12, 0.2, 0.77, 0.9)
    np.testing.assert_allclose(coverage(grid, 50), coverage(outline, 50), rtol=0, atol=1e-13)
    inner = ~grid.topology.is_boundary_vertex
    shaken = grid.vertices.copy()
    shaken[inner] += np.random.default_rng(0).normal(0.0, 0.3, (4, 2))
    assert inner.sum() == 4
    np.testing.assert_array_equal(coverage(grid.with_vertices(shaken), 50), coverage(grid, 50))


@given(meshes())
@settings(max_examples=40)
def test_coverage__of_a_mesh_is_the_sum_over_its_faces(mesh: PolyMesh) -> None:
    faces = sum(picture_of(mesh.vertices[list(face)], loop(len(face)), 17) for face in mesh.faces)
    np.testing.assert_allclose(coverage(mesh, 17), faces, rtol=0, atol=TOLERANCE)


# --- the workspace ---


def test_calls__leave_nothing_behind_for_those_that_follow() -> None:
    mesh = RING.with_vertices(1.4 * RING.vertices - 0.2)  # partly outside
    resolutions = (9, 64, 130, 1, 65)
    n_edges = len(mesh.topology.boundary_half_edges)
    targets = {resolution: random_target(resolution) for resolution in resolutions}

    def call_all(resolution: int) -> tuple[bytes, ...]:
        target, batch = targets[resolution], raster.batch_of([mesh])
        work = raster.workspace(resolution, n_edges)
        counts = raster_kernels.overlap_counts(batch.points, batch.edges, raster.pixels_of(target), work)
        loss, gradient = loss_and_gradient(mesh, target)
        pulled = raster.coverage_vjp(batch, target.coverage[None].copy())
        assert_clean(resolution, n_edges)
        results = (coverage(mesh, resolution), np.array(counts), np.array(loss), gradient, pulled)
        return tuple(result.tobytes() for result in results)

    first = {resolution: call_all(resolution) for resolution in resolutions}
    for resolution in reversed(resolutions):
        assert call_all(resolution) == first[resolution]
        assert call_all(resolution) == first[resolution]


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e308, -1e18])
def test_calls__with_a_wild_vertex_do_no_harm_to_others(value: float) -> None:
    target, expected = random_target(9), coverage(RING, 9)
    for k in range(4):
        wild = RING.vertices.copy()
        wild.flat[k] = value
        loss_and_gradient(RING.with_vertices(wild), target)
        coverage(RING.with_vertices(wild), 9)
        assert_clean(9, 14)
        np.testing.assert_array_equal(coverage(RING, 9), expected)


# --- loss and gradient ---


def test_gradient__of_a_rectangle_by_hand() -> None:
    """One pixel, a rectangle of width w and the full height: the loss is w², and either end gets half of 2w."""
    loss, gradient = loss_and_gradient(PolyMesh.rectangle(0.0, 0.0, 0.6, 1.0), Target(np.zeros((1, 1))))
    assert loss == pytest.approx(0.36)
    right = PolyMesh.rectangle(0.0, 0.0, 0.6, 1.0).vertices[:, 0] == 0.6
    np.testing.assert_allclose(gradient[right, 0], 0.6)
    np.testing.assert_allclose(gradient[~right, 0], -0.6)


@pytest.mark.slow
@given(meshes(), st.sampled_from([1, 8, 65]), st.integers(0, 99), st.floats(0.5, 3.0))
@settings(max_examples=60)
def test_loss__equals_the_dense_sum_also_outside_the_image(
    mesh: PolyMesh, resolution: int, seed: int, zoom: float
) -> None:
    mesh = mesh.with_vertices((mesh.vertices - 0.4) * zoom + 0.5)
    target = random_target(resolution, seed)
    dense = ((coverage(mesh, resolution) - target.coverage) ** 2).sum()
    assert loss_and_gradient(mesh, target)[0] == pytest.approx(dense, rel=1e-9, abs=1e-12)


def test_loss__of_a_perfect_fit_is_zero() -> None:
    for resolution in (8, 64, 128):
        loss, gradient = loss_and_gradient(RING, Target(coverage(RING, resolution)))
        assert 0.0 <= loss <= 1e-10
        np.testing.assert_allclose(gradient, 0.0, atol=1e-10)


@pytest.mark.slow
@pytest.mark.parametrize("offset", [(0.0, 0.0), (0.31, 0.0), (-0.33, 0.29), (0.03, 0.41)])
@pytest.mark.parametrize("resolution", [1, 4])
def test_gradient__equals_differences_of_exact_images(offset: tuple[float, float], resolution: int) -> None:
    mesh = polygon(star(11, 5) + offset)
    target = random_target(resolution)
    fractions = np.vectorize(Fraction, otypes=[object])

    def exact_loss(points: npt.NDArray[Any]) -> Any:
        image = exact_coverage(points, mesh.topology.boundary_half_edges.tolist(), resolution)
        return ((image - fractions(target.coverage)) ** 2).sum()

    exact = central_differences(exact_loss, fractions(mesh.vertices), Fraction(1, 2**30))
    loss, gradient = loss_and_gradient(mesh, target)
    assert loss == pytest.approx(float(exact_loss(mesh.vertices)), rel=1e-12)
    assert np.linalg.norm(gradient - exact) <= 1e-9 * np.linalg.norm(exact)


def test_gradient__equals_differences_of_shapelys_images() -> None:
    """A ring on more pixels than one word of the bit set has bits, with a part outside of the image."""
    mesh = frame(star(2, 4, center=(0.81, 0.52)), np.array((0.81, 0.52)) + 0.4 * (star(2, 4) - 0.5))
    target = random_target(70)

    def loss(points: npt.NDArray[Any]) -> float:
        hull, hole = points[:4], points[4:]
        return ((shapely_coverage(shapely.Polygon(hull, [hole]), 70) - target.coverage) ** 2).sum()

    expected = central_differences(loss, mesh.vertices, 1e-6)
    _, gradient = loss_and_gradient(mesh, target)
    assert mesh.vertices.max() > 1.0
    assert np.linalg.norm(gradient - expected) <= 1e-6 * np.linalg.norm(expected)


def jacobians_by_edge(many: raster.Batch, n_edges: int, pixels: npt.NDArray[Any]) -> list[npt.NDArray[Any]]:
    """Pull-backs of single pixels as (N * V, 2), by each edge alone; the batch holds one mesh, once for each pixel."""
    edges, starts = many.edges.reshape(len(many), n_edges, 2), np.arange(len(many) + 1)
    alone = [raster.Batch(many.points, edges[:, e].copy(), many.point_starts, starts) for e in range(n_edges)]
    return [raster.coverage_vjp(batch, pixels) for batch in alone]


@pytest.mark.parametrize("mesh", [RING, hourglass(), polygon(star(0, 12))], ids=["ring", "pinch", "concave"])
def test_normal_equations__equal_those_of_each_edges_dense_jacobian(mesh: PolyMesh) -> None:
    size, batch = 9, raster.batch_of([mesh])
    n = len(mesh.vertices)
    # the rows of the Jacobian (R*R, 2V) are pull-backs of single pixels
    many = raster.batch_of([mesh] * size**2)
    pixels = np.eye(size**2).reshape(size**2, size, size)
    jacobian = raster.coverage_vjp(many, pixels).reshape(size**2, 2 * n) / size
    by_edge = jacobians_by_edge(many, len(batch.edges), pixels)
    target = random_target(size)
    residual = (coverage(mesh, size) - target.coverage).ravel()
    work = raster.workspace(size, len(batch.edges))
    gradient, normal = np.zeros((n, 2)), np.zeros((2 * n, 2 * n))
    picture = raster.picture_of(target)
    loss = derivative_kernels.normal_equations(batch.points, batch.edges, picture, work, gradient, normal)
    assert_clean(size, len(batch.edges))
    assert loss == pytest.approx(residual @ residual, rel=1e-12)
    np.testing.assert_allclose(gradient.ravel(), jacobian.T @ residual, rtol=0, atol=1e-12)
    np.testing.assert_allclose(sum(by_edge).reshape(size**2, 2 * n) / size, jacobian, rtol=0, atol=1e-12)
    expected = sum(one.T @ one for one in (each.reshape(size**2, 2 * n) / size for each in by_edge))
    np.testing.assert_allclose(normal, np.tril(expected), rtol=0, atol=1e-12)


@pytest.mark.parametrize("resolution", [1, 10, 64, 130])
def test_overlap_counts__are_those_of_the_thresholded_images(resolution: int) -> None:
    target = random_target(resolution)
    for mesh in (RING, hourglass(), RING.with_vertices(1.5 * RING.vertices - 0.4)):
        batch = raster.batch_of([mesh])
        work = raster.workspace(resolution, len(batch.edges))
        inside, filled = raster_kernels.overlap_counts(batch.points, batch.edges, raster.pixels_of(target), work)
        rendered = coverage(mesh, resolution) >= 0.5
        assert (inside, filled) == ((rendered & target.mask).sum(), rendered.sum())
        assert_clean(resolution, len(batch.edges))


@pytest.mark.parametrize("resolution", [1, 10, 64, 130])
def test_overlap_counts_in_rows__are_those_of_the_rows(resolution: int) -> None:
    target, rng = random_target(resolution), np.random.default_rng(0)
    cuts = sorted({0, resolution, *rng.integers(resolution + 1, size=4).tolist()})
    for mesh in (RING, hourglass(), RING.with_vertices(1.5 * RING.vertices - 0.4)):
        batch = raster.batch_of([mesh])
        work = raster.workspace(resolution, len(batch.edges))
        rendered = coverage(mesh, resolution) >= 0.5
        for first, last in pairwise(cuts):
            inside, filled = raster_kernels.overlap_counts_in_rows(
                batch.points, batch.edges, raster.pixels_of(target), work, first, last
            )
            band = slice(first, last)
            assert (inside, filled) == ((rendered & target.mask)[band].sum(), rendered[band].sum())
            assert_clean(resolution, len(batch.edges))


# --- batches ---


@pytest.fixture(params=[1, 2, 3])
def threads(request: pytest.FixtureRequest) -> Iterator[int]:
    set_threads(request.param)
    yield request.param
    set_threads(None)


def ragged_meshes() -> list[PolyMesh]:
    kinds = [RING, hourglass(), PolyMesh.grid(3, 0.1, 0.1, 0.9, 0.9), polygon(star(1, 20)), polygon(star(2, 4))]
    return [kinds[k % 5].with_vertices(kinds[k % 5].vertices + 0.001 * k) for k in range(211)]


def test_batches__equal_single_calls_bit_for_bit(threads: int) -> None:
    meshes, target = ragged_meshes(), random_target(65)
    images = coverage_many(meshes, 65)
    losses, gradients = loss_and_gradient_many(meshes, target)
    assert len(meshes) * 4 * 65 > raster._SERIAL_PIECES  # enough for threads to be used
    for mesh, image, loss, gradient in zip(meshes, images, losses, gradients, strict=True):
        np.testing.assert_array_equal(image, coverage(mesh, 65))
        alone = loss_and_gradient(mesh, target)
        assert loss == alone[0]
        np.testing.assert_array_equal(gradient, alone[1])


@pytest.mark.parametrize("n", [1, 2])
def test_batches__may_be_small(n: int) -> None:
    images = coverage_many(ragged_meshes()[:n], 12)
    assert images.shape == (n, 12, 12)
    np.testing.assert_array_equal(images[-1], coverage(ragged_meshes()[n - 1], 12))


def test_batches__may_be_empty() -> None:
    assert coverage_many([], 12).shape == (0, 12, 12)
    losses, gradients = loss_and_gradient_many([], random_target(12))
    assert losses.shape == (0,) and gradients == []
