"""The refit: known polygons found again, and what it promises for any mesh and any target."""

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autopoly_env.arrays import FloatArray
from autopoly_env.compute import map_threads, set_threads
from autopoly_env.details import hairlines
from autopoly_env.errors import MeshError
from autopoly_env.mesh import PolyMesh, broken_faces, defects_of
from autopoly_env.mesh.geometry_kernels import count_crossings
from autopoly_env.raster import coverage
from autopoly_env.refit import (
    FROM_AFAR,
    LOCAL,
    QUICK,
    THOROUGH,
    Judge,
    RefitConfig,
    RefitResult,
    RefitTarget,
    quick_resolution,
    refit,
    refit_best,
)
from autopoly_env.refit.refitting import shape_arguments
from autopoly_env.refit.shape_kernels import shape_of
from autopoly_env.score import intersection_over_union, iou_of
from autopoly_env.silhouette import Silhouette, Target
from tests.helpers.shapes import frame, hourglass, pairs_that_meet, polygon
from tests.helpers.strategies import meshes, random_walk

CONFIGS = {
    "from afar": FROM_AFAR,
    "local": LOCAL,
    "quick": QUICK,
    "plain": RefitConfig(),
    "free": RefitConfig(keep_defects=True),
}
SQUARE = PolyMesh.from_faces(
    [(0.25, 0.25), (0.5, 0.25), (0.75, 0.25), (0.75, 0.75), (0.25, 0.75)], [(0, 1, 2, 3, 4)]
)  # with a subdivided edge
HALVES = PolyMesh.from_faces([(0.3, 0.3), (0.7, 0.3), (0.7, 0.7), (0.3, 0.7)], [(0, 1, 2), (0, 2, 3)])


def target_of(mesh: PolyMesh, resolution: int) -> RefitTarget:
    """A target whose pictures are exactly those of a mesh."""
    sizes = [max(min(8, resolution), resolution // divisor) for divisor in (8, 4, 2, 1)]
    return RefitTarget.of_levels([Target(coverage(mesh, size)) for size in sizes])


def shaken(points: FloatArray, seed: int, length: float) -> FloatArray:
    """Every point moved by this length in a random direction."""
    angles = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, len(points))
    return points + length * np.column_stack((np.cos(angles), np.sin(angles)))


def dense_loss(mesh: PolyMesh, target: RefitTarget) -> float:
    return float(((coverage(mesh, target.resolution) - target.pictures[-1].coverage) ** 2).sum())


def n_flips(mesh: PolyMesh) -> int:
    return int((mesh.face_areas() < 0.9e-9).sum())  # the refit tells empty from full at 1e-9


def assert_sound(mesh: PolyMesh, result: RefitResult, target: RefitTarget, config: RefitConfig) -> None:
    """All that `refit` promises."""
    after = result.mesh
    assert np.isfinite(after.vertices).all() and after.topology is mesh.topology
    assert np.isfinite(result.loss) and result.loss <= result.loss_before
    assert result.loss_before == pytest.approx(dense_loss(mesh, target), rel=1e-9, abs=1e-9)
    assert result.loss == pytest.approx(dense_loss(after, target), rel=1e-9, abs=1e-9)
    if result.loss == result.loss_before:
        np.testing.assert_array_equal(after.vertices, mesh.vertices)
    if not config.keep_defects:
        assert pairs_that_meet(after.vertices, after.edges) <= sum(count_crossings(mesh.vertices, mesh.edges))
        assert n_flips(after) <= n_flips(mesh)
    if (mesh.vertices >= 0.0).all() and (mesh.vertices <= 1.0).all():
        clean = n_flips(after) == 0 and sum(count_crossings(after.vertices, after.edges)) == 0
        bound = after.vertices if clean else after.vertices[mesh.topology.is_boundary_vertex]
        assert (bound >= 0.0).all() and (bound <= 1.0).all()


# --- known answers ---


def cornered(seed: int, n: int) -> PolyMesh:
    """A polygon or, from 8 corners on, a star: no corner is so flat that a picture would not pin it down; n even."""
    jitter = np.random.default_rng(seed).uniform(-0.03, 0.03, (2, n))
    inner = 0.42 if n < 8 else 0.25 * np.cos(2.0 * np.pi / n)
    angles = 2.0 * np.pi * (np.arange(n) + 0.3) / n + jitter[0]
    radii = np.where(np.arange(n) % 2, inner, 0.42) + jitter[1]
    return polygon(0.5 + radii[:, None] * np.column_stack((np.cos(angles), np.sin(angles))))


@pytest.mark.parametrize("config", ["from afar", "local"])
@pytest.mark.parametrize("resolution", [64, 128])
@pytest.mark.parametrize("n", [4, 6, 8, 12])
def test_refit__finds_a_known_polygon_from_two_pixels_away(n: int, resolution: int, config: str) -> None:
    for seed in range(4):
        known = cornered(seed, n)
        start = known.with_vertices(shaken(known.vertices, seed, 2.0 / resolution))
        result = refit(start, target_of(known, resolution), CONFIGS[config])
        assert result.loss <= 1e-7 < result.loss_before
        np.testing.assert_allclose(result.mesh.vertices, known.vertices, rtol=0, atol=1e-4 / resolution)


@pytest.mark.parametrize("resolution", [8, 64, 100, 128])
def test_refit__carries_a_square_across_the_image(resolution: int) -> None:
    known = PolyMesh.rectangle(0.35, 0.3, 0.95, 0.9)
    result = refit(PolyMesh.rectangle(0.05, 0.1, 0.5, 0.55), target_of(known, resolution))
    np.testing.assert_allclose(result.mesh.vertices, known.vertices, rtol=0, atol=1e-3 / resolution)


@pytest.mark.parametrize("way", [(0.03, 0.0), (-0.05, 0.05), (0.1, -0.15)])
def test_quick_refit__brings_a_square_home(way: tuple[float, float]) -> None:
    known = PolyMesh.rectangle(0.35, 0.3, 0.75, 0.7)
    target = target_of(known, quick_resolution(128))
    result = refit(known.with_vertices(known.vertices + way), target, QUICK)
    np.testing.assert_allclose(result.mesh.vertices, known.vertices, rtol=0, atol=0.1 / 128)


@pytest.mark.parametrize(("whole", "quick"), [(1, 1), (8, 8), (16, 8), (64, 20), (128, 40), (512, 160)])
def test_quick_resolution__is_five_sixteenths_but_no_less_than_8(whole: int, quick: int) -> None:
    assert quick_resolution(whole) == quick


def test_refit__finds_a_ring_again() -> None:
    inner = 0.5 + 0.5 * (cornered(1, 6).vertices - 0.5)
    known = frame(cornered(1, 6).vertices, inner)
    start = known.with_vertices(shaken(known.vertices, 5, 1.5 / 64))
    result = refit(start, target_of(known, 64))
    np.testing.assert_allclose(result.mesh.vertices, known.vertices, rtol=0, atol=1e-3 / 64)


@pytest.mark.parametrize("config", CONFIGS)
@pytest.mark.parametrize("resolution", [8, 64, 100, 128])
def test_refit__moves_nothing_that_fits(resolution: int, config: str) -> None:
    silhouette = Silhouette(np.pad(np.ones((4, 4), bool), 2))
    result = refit(SQUARE, RefitTarget.of(silhouette, resolution), CONFIGS[config])
    np.testing.assert_array_equal(result.mesh.vertices, SQUARE.vertices)
    assert result.loss == result.loss_before == pytest.approx(0.0, abs=1e-9)


def test_refit__leaves_the_idle_side_where_it_is() -> None:
    """The target ends two pixels further right, so the two corners on the left have nothing to gain."""
    wider = np.where(SQUARE.vertices == (0.75, 0.75), 1.0, 0.0)[:, :1] * (2.0 / 64, 0.0)
    target = target_of(SQUARE.with_vertices(SQUARE.vertices + wider), 64)
    for config in (FROM_AFAR, LOCAL):
        moved = refit(SQUARE, target, config).mesh.vertices
        np.testing.assert_array_equal(moved[[0, 4]], SQUARE.vertices[[0, 4]])
        np.testing.assert_allclose(moved[[2, 3]], SQUARE.vertices[[2, 3]] + (2.0 / 64, 0.0), rtol=0, atol=1e-6)


@pytest.mark.parametrize("box", [(0.3, 0.35, 0.9, 0.95), (0.05, 0.05, 0.3, 0.3), (0.0, 0.0, 1.0, 1.0)])
def test_refit__takes_inner_vertices_along(box: tuple[float, float, float, float]) -> None:
    grid, target = PolyMesh.grid(3, 0.2, 0.2, 0.6, 0.6), target_of(PolyMesh.rectangle(*box), 64)
    after = refit(grid, target).mesh
    inner = ~grid.topology.is_boundary_vertex
    assert n_flips(after) == 0 and sum(count_crossings(after.vertices, after.edges)) == 0
    x0, y0, x1, y1 = box
    assert (after.vertices[inner] > (x0, y0)).all() and (after.vertices[inner] < (x1, y1)).all()
    assert dense_loss(after, target) < 0.02 * dense_loss(grid, target)


def n_defects(mesh: PolyMesh) -> int:
    return pairs_that_meet(mesh.vertices, mesh.edges) + n_flips(mesh)


@pytest.mark.parametrize("mesh", [cornered(0, 10), HALVES, hourglass()], ids=["crossing", "flipping", "pinch"])
def test_keep_defects__lets_an_outline_cross_and_faces_flip(mesh: PolyMesh) -> None:
    """Noisy targets are drawn better by outlines that fold; without leave they may not."""
    n_with_leave = 0
    for seed in range(100):
        target = RefitTarget.of(Silhouette(np.random.default_rng(seed).random((9, 9)) < 0.2), 32)
        n_with_leave += n_defects(refit(mesh, target, RefitConfig(keep_defects=True)).mesh) > 0
        assert n_defects(refit(mesh, target, RefitConfig()).mesh) == 0
    assert n_with_leave > 0


# --- promises, for any mesh and target ---


@st.composite
def silhouettes(draw: st.DrawFn) -> Silhouette:
    """One pixel, a full image, a half plane, blobs and noise, on 1 to 40 pixels a side."""
    size = draw(st.integers(1, 40))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    kind = draw(st.sampled_from(["pixel", "full", "half", "blob", "noise"]))
    y, x = np.mgrid[:size, :size]
    mask = np.zeros((size, size), bool)
    if kind == "full":
        mask[:] = True
    elif kind == "half":
        mask[:, : (size + 1) // 2] = True
    elif kind == "blob":
        mask = (x - rng.uniform(0, size)) ** 2 + (y - rng.uniform(0, size)) ** 2 < rng.uniform(1, size) ** 2
    elif kind == "noise":
        mask = rng.random((size, size)) < 0.4
    mask[size // 2, size // 2] = True
    return Silhouette(mask)


@st.composite
def awkward_meshes(draw: st.DrawFn) -> PolyMesh:
    """Meshes at their worst: crossing, flipped, empty or tiny faces, coincident and far-off vertices, pinches."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    mesh = draw(
        st.one_of(
            meshes(max_steps=10),
            st.sampled_from(
                [hourglass(), SQUARE, HALVES, PolyMesh.grid(3, 0.2, 0.2, 0.7, 0.7), PolyMesh.grid(2, 0, 0, 1, 1)]
            ),
            st.builds(lambda n: polygon(rng.random((n, 2))), st.integers(3, 9)),
            st.builds(lambda n: polygon(rng.integers(0, 5, (n, 2)) / 4), st.integers(3, 9)),
        )
    )
    points, n = mesh.vertices.copy(), len(mesh.vertices)
    match draw(st.sampled_from(["as is", "as is", "coincident", "point", "far", "tiny", "line", "flat", "shaken"])):
        case "coincident":
            points[rng.integers(n)] = points[rng.integers(n)]
        case "point":
            points[:] = points[0]
        case "far":
            points[rng.integers(n)] += rng.normal(0.0, 2.0, 2)
        case "tiny":
            points = 0.4 + 1e-4 * points
        case "line":
            points[:, 1] = 0.3
        case "flat":
            points[:, 0] = np.round(points[:, 0])
        case "shaken":
            points += rng.normal(0.0, 0.1, points.shape)
    return mesh.with_vertices(points)


@pytest.mark.slow
@given(awkward_meshes(), silhouettes(), st.sampled_from([1, 3, 8, 16, 64, 65, 100]), st.sampled_from([*CONFIGS]))
@settings(max_examples=250)
def test_refit__keeps_its_promises(mesh: PolyMesh, silhouette: Silhouette, resolution: int, config: str) -> None:
    target = RefitTarget.of(silhouette, resolution)
    result = refit(mesh, target, CONFIGS[config])
    assert_sound(mesh, result, target, CONFIGS[config])
    again = refit(mesh, target, CONFIGS[config])
    np.testing.assert_array_equal(again.mesh.vertices, result.mesh.vertices)


@pytest.mark.slow
@given(awkward_meshes(), silhouettes())
@settings(max_examples=60)
def test_refit__of_its_own_result_gains_and_breaks_nothing_more(mesh: PolyMesh, silhouette: Silhouette) -> None:
    target = RefitTarget.of(silhouette, 64)
    first = refit(mesh, target, RefitConfig())
    second = refit(first.mesh, target, LOCAL)
    assert_sound(first.mesh, second, target, LOCAL)
    assert second.loss_before == pytest.approx(first.loss, rel=1e-9, abs=1e-9)


# --- many at once ---


@pytest.fixture
def default_threads() -> Iterator[None]:
    yield
    set_threads(None)


@pytest.mark.usefixtures("default_threads")
def test_refit__is_the_same_bit_for_bit_beside_others_on_any_number_of_threads() -> None:
    starts = [random_walk(seed, n_steps=8)[-1].after for seed in range(24)] + [hourglass(), SQUARE]
    target = target_of(cornered(0, 9), 64)
    alone = [refit(mesh, target) for mesh in starts]
    for threads in (1, 2, 3):
        set_threads(threads)
        for one, other in zip(alone, map_threads(lambda mesh: refit(mesh, target), starts), strict=True):
            np.testing.assert_array_equal(one.mesh.vertices, other.mesh.vertices)
            assert (one.loss_before, one.loss, one.n_evaluations) == (
                other.loss_before, other.loss, other.n_evaluations,
            )  # fmt: skip


# --- what the kernels are told ---


def test_shape__of_a_grid_by_hand() -> None:
    """2 x 2 quads: vertex 4 is the inner one, joined to 1, 3, 5 and 7."""
    grid = PolyMesh.grid(2, 0.0, 0.0, 1.0, 1.0)
    shape = shape_of.py_func(*shape_arguments(grid.topology, "any", None))
    assert sorted(shape.boundary.tolist()) == [0, 1, 2, 3, 5, 6, 7, 8]
    assert shape.inner.tolist() == [4]
    assert sorted(shape.neighbours.tolist()) == [1, 3, 5, 7]
    np.testing.assert_array_equal(shape.boundary[shape.loops], grid.topology.boundary_half_edges)


@pytest.mark.parametrize(
    ("resolution", "sizes"), [(1, [1] * 4), (8, [8] * 4), (64, [8, 16, 32, 64]), (100, [12, 25, 50, 100])]
)
def test_target__has_four_levels(resolution: int, sizes: list[int]) -> None:
    target = RefitTarget.of(Silhouette(np.eye(3, dtype=bool)), resolution)
    assert [len(picture.coverage) for picture in target.pictures] == sizes
    assert target.resolution == resolution


@settings(max_examples=20)
@given(meshes(), st.integers(0, 999), st.sampled_from([THOROUGH, LOCAL]))
def test_refit_best__is_the_best_refit_of_each_start_and_says_what_it_is_worth(
    mesh: PolyMesh, seed: int, config: RefitConfig
) -> None:
    target, scored = target_of(SQUARE, 32), Target(coverage(SQUARE, 48))
    starts = [mesh, *(mesh.with_vertices(shaken(mesh.vertices, seed + k, 0.05)) for k in range(2))]
    best = refit_best(starts, target, config, judge=Judge(scored, scored))
    alone = [refit(start, target, config) for start in starts]
    order = [(sum(defects_of(result.mesh)), result.loss) for result in alone]
    assert (sum(defects_of(best.mesh)), best.loss) == min(order)
    assert best.which == order.index(min(order))
    assert best.mesh == alone[best.which].mesh and best.n_evaluations == alone[best.which].n_evaluations
    assert best.mesh.defects == PolyMesh(*alone[best.which].mesh.__reduce__()[1]).defects  # counted anew
    assert iou_of(best.overlap, scored) == intersection_over_union(best.mesh, scored)
    assert best.n_hairlines == hairlines(best.mesh, scored)


def test_refit_best__under_a_rule_prefers_what_keeps_it() -> None:
    dart = PolyMesh.from_faces([(0.3, 0.3), (0.7, 0.3), (0.4, 0.4), (0.3, 0.7)], [(0, 1, 2, 3)])
    convex = dart.with_vertices([(0.3, 0.3), (0.7, 0.3), (0.6, 0.6), (0.3, 0.7)])
    target = target_of(dart, 32)
    best = refit_best([dart, convex], target, LOCAL, faces="quads")
    assert best.which == 1 and not broken_faces(best.mesh, "quads")
    assert refit_best([dart, convex], target, LOCAL).which == 0


def test_refit_best__leaves_out_starts_that_are_not_finite() -> None:
    broken = SQUARE.with_vertices(np.full((5, 2), np.nan))
    assert refit_best([broken, SQUARE], target_of(SQUARE, 32)).which == 1
    with pytest.raises(MeshError, match="not finite"):
        refit_best([broken, broken], target_of(SQUARE, 32))
