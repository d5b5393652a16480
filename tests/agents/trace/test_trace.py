"""The trace agent, part by part: contours, optimal polygons, peeling, construction; then whole pictures."""

from collections.abc import Sequence
from itertools import combinations, pairwise

import numpy as np
import numpy.typing as npt
import pytest
import shapely
import skimage.measure
from hypothesis import given, settings
from hypothesis import strategies as st

from agents.budget import Budget, Meter
from agents.trace.agent import TraceAgent, TraceConfig, build_best, choose_sizes
from agents.trace.construct import UnbuildableError, construct
from agents.trace.outline import Outline, outline_of_mesh
from agents.trace.peel_kernels import peel
from agents.trace.reach import Reach
from agents.trace.rings import Ring, signed_area, trace_rings
from agents.trace.simplify import Contour
from agents.trace.simplify_kernels import chord_errors, thin
from autopoly_env.arrays import FloatArray
from autopoly_env.mesh import PolyMesh, defects_of, is_valid
from autopoly_env.score import ScoreWeights
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator, State
from tests.helpers.drawings import FRAME, HOUSE, ISLAND, SQUARE, TWO_SQUARES, noise, painted
from tests.helpers.shapes import star

NO_WALLS = np.empty((0, 4))
GAME = Simulator(painted(SQUARE), resolution=16)
PAPER_GAME = Simulator(painted(SQUARE), resolution=16, operators="paper")
BOX = np.array([(0.2, 0.2), (0.8, 0.2), (0.8, 0.8), (0.2, 0.8)])
TRIANGLE = np.array([(0.2, 0.2), (0.8, 0.3), (0.4, 0.8)])


def small(points: npt.ArrayLike, x: float, y: float, scale: float = 0.2) -> FloatArray:
    """A ring shrunk about the centre of the image and moved to another."""
    return (np.asarray(points, np.float64) - 0.5) * scale + (x, y)


def hole(points: FloatArray, parent: int = 0) -> Ring:
    return Ring(points[::-1], parent)


# --- contours ---


def test_rings__of_a_frame_are_an_outer_one_and_a_hole() -> None:
    outer, inner = trace_rings(painted(FRAME))
    assert (outer.parent, inner.parent) == (-1, 0)
    assert signed_area(outer.points) == pytest.approx(0.75**2, rel=0.01)
    assert signed_area(inner.points) == pytest.approx(-(0.25**2), rel=0.01)
    x, y = inner.points.T
    assert (x.min(), x.max(), y.min(), y.max()) == pytest.approx((0.375, 0.625, 0.375, 0.625), abs=1e-4)


def test_rings__of_an_island_in_a_hole_are_outer_ones_again() -> None:
    shape = ISLAND - shapely.box(0.48, 0.48, 0.52, 0.52)
    rings = trace_rings(painted(shape, 128))
    assert [ring.parent for ring in rings] == [-1, -1, 0, 1]
    assert [ring.is_hole for ring in rings] == [False, False, True, True]
    assert [signed_area(ring.points) > 0.0 for ring in rings] == [True, True, False, False]


@given(st.integers(0, 999), st.integers(1, 64))
def test_rings__part_the_pixels_of_the_object_from_all_others(seed: int, resolution: int) -> None:
    silhouette = noise(seed, resolution)
    rings = trace_rings(silhouette)
    layers = np.zeros((resolution, resolution), np.int64)
    x, y = np.meshgrid(*2 * [(np.arange(resolution) + 0.5) / resolution])
    for ring in rings:
        assert (signed_area(ring.points) < 0.0) == ring.is_hole
        layers += np.where(ring.is_hole, -1, 1) * shapely.contains_xy(shapely.Polygon(ring.points), x, y)
    np.testing.assert_array_equal(layers, silhouette.mask)
    parts = skimage.measure.label(silhouette.mask, connectivity=1).max()
    holes = skimage.measure.label(~np.pad(silhouette.mask, 1), connectivity=2).max() - 1
    assert [ring.is_hole for ring in rings] == [False] * parts + [True] * holes
    for ring in rings[parts:]:
        around = shapely.Polygon(rings[ring.parent].points)
        assert around.contains(shapely.Polygon(ring.points))
    areas = [signed_area(ring.points) for ring in rings]
    assert areas == [*sorted(areas[:parts], reverse=True), *sorted(areas[parts:])]


@pytest.mark.parametrize("resolution", [300, 384, 512])
def test_rings__never_touch_where_pixels_are_covered_by_half(resolution: int) -> None:
    """Above 256 pixels the contours run on area averages, of which many are exactly a half."""
    blocks = np.random.default_rng(resolution).random((resolution // 2, resolution // 2)) < 0.5
    mask = np.roll(np.kron(blocks, np.ones((2, 2), np.bool_)), (1, 1), (0, 1))
    rings = trace_rings(Silhouette(mask))
    assert len(rings) > 100
    assert all(shapely.LinearRing(ring.points).is_simple for ring in rings)


@pytest.mark.parametrize(
    ("rows", "columns", "area"),
    [((0, 32), (0, 32), 1.0), ((0, 9), (5, 20), 9 * 15 / 32**2), ((7, 8), (3, 30), 27 / 32**2)],
)
def test_rings__follow_the_border_of_the_image_and_thin_lines(
    rows: tuple[int, int], columns: tuple[int, int], area: float
) -> None:
    mask = np.zeros((32, 32), np.bool_)
    mask[slice(*rows), slice(*columns)] = True
    (ring,) = trace_rings(Silhouette(mask))
    assert signed_area(ring.points) == pytest.approx(area, abs=2 * 0.26 / 32**2)  # each corner is cut by 1/8 pixel
    assert ring.points.min() > -1e-4 and ring.points.max() < 1 + 1e-4


def test_rings__of_what_is_lost_at_256_pixels_are_none() -> None:
    mask = np.zeros((2048, 2048), np.bool_)
    mask[1000] = True
    assert trace_rings(Silhouette(mask)) == []


# --- optimal polygons ---


def densely(corners: npt.ArrayLike, n: int = 12) -> FloatArray:
    """A contour (n * corners, 2) with points all along its edges."""
    corners = np.asarray(corners, np.float64)
    steps = np.linspace(0.0, 1.0, n, endpoint=False)[:, None]
    return np.concatenate([a + steps * (b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)])


def regular(n: int) -> FloatArray:
    angles = 2.0 * np.pi * np.arange(n) / n
    return 0.5 + 0.4 * np.column_stack((np.cos(angles), np.sin(angles)))


@pytest.mark.parametrize(
    "corners",
    [TRIANGLE, BOX, regular(5), regular(8), np.array(HOUSE.exterior.coords[:-1]), star(2, 7)],
    ids=["triangle", "box", "pentagon", "octagon", "house", "star"],
)
def test_polygons__find_the_corners_of_a_shape_and_need_them_all(corners: FloatArray) -> None:
    contour = Contour(np.roll(densely(corners), 5, axis=0))
    k = len(corners)
    assert contour.errors[k] == pytest.approx(0.0, abs=1e-12)
    assert k == 3 or contour.errors[k - 1] > 1e-3
    assert np.isinf(contour.errors[:3]).all()
    found = contour.polygon(k)
    assert signed_area(found) == pytest.approx(abs(signed_area(corners)))
    assert sorted(found.round(9).tolist()) == sorted(corners.round(9).tolist())


def area_between(points: FloatArray) -> float:
    """Between an open path and the chord of its ends, by sampling."""
    along = points[-1] - points[0]
    along = along / np.hypot(*along)
    t = np.linspace(0.0, 1.0, 2001)[:, None]
    area = 0.0
    for a, b in pairwise(points - points[0]):
        samples = a + t * (b - a)
        across = np.abs(samples @ (-along[1], along[0]))
        area += abs((b - a) @ along) * float(np.mean(0.5 * (across[1:] + across[:-1])))
    return area


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("n", [4, 6, 9])
def test_polygons__err_as_little_as_the_best_of_all_subsets(seed: int, n: int) -> None:
    contour = Contour(star(seed, n))
    ring = contour.polygon(n)  # all points, from the one that every polygon begins with
    closed = np.concatenate((ring, ring[:1]))
    for k in range(3, n + 1):
        subsets = [(0, *rest, n) for rest in combinations(range(1, n), k - 1)]
        expected = min(sum(area_between(closed[i : j + 1]) for i, j in pairwise(subset)) for subset in subsets)
        assert contour.errors[k] == pytest.approx(expected, abs=1e-6)
        chosen = contour.polygon(k)
        places = [int(np.flatnonzero((ring == point).all(axis=1))[0]) for point in chosen]
        assert places == sorted(places) and len(places) == k
        assert sum(area_between(closed[i : j + 1]) for i, j in pairwise([*places, n])) == pytest.approx(
            expected, abs=1e-6
        )


def test_chord_errors__are_areas_known_by_hand() -> None:
    errors = chord_errors(np.array([(0.0, 0.0), (1.0, 1.0), (3.0, -1.0), (4.0, 0.0)]))
    assert errors[0, 1] == errors[1, 2] == 0.0
    assert errors[0, 3] == pytest.approx(2.0)  # the path crosses the chord: a triangle of area 1 on either side
    assert errors[1, 3] == pytest.approx(2.0)  # triangle (1,1) (3,-1) (4,0)
    assert np.isinf(errors[0, 4])  # all the way round: no chord


def test_thin__keeps_the_corners() -> None:
    np.testing.assert_array_equal(thin(densely(BOX, 5), 4), [0, 5, 10, 15])
    np.testing.assert_array_equal(thin(BOX, 4), range(4))


def test_contour__of_a_thousand_points_is_thinned_first() -> None:
    contour = Contour(densely(star(1, 20), 60))
    assert len(contour.errors) == 61
    assert contour.errors[20] == pytest.approx(0.0, abs=1e-9)


# --- peeling ---


def stages(points: FloatArray, order: Sequence[int]) -> list[FloatArray]:
    """The polygon before and after every vertex that is dropped."""
    return [points[sorted({*range(len(points))} - {*order[:k]})] for k in range(len(order) + 1)]


@given(st.integers(0, 2**32 - 1), st.integers(5, 40), st.integers(3, 5))
def test_peel__keeps_a_polygon_simple_all_the_way(seed: int, n: int, n_keep: int) -> None:
    points = star(seed, n)
    order = peel(points, NO_WALLS, np.zeros(n, np.bool_), n_keep).tolist()
    assert len(order) == len(set(order)) == n - n_keep  # there is always an ear
    assert all(shapely.LinearRing(ring).is_simple for ring in stages(points, order))


def test_peel__drops_the_least_visible_first() -> None:
    points = np.array([(0.2, 0.2), (0.5, 0.21), (0.8, 0.2), (0.81, 0.5), (0.8, 0.8), (0.5, 0.9), (0.2, 0.8)])
    assert peel(points, NO_WALLS, np.zeros(7, np.bool_), 4).tolist() == [1, 3, 5]


def test_peel__leaves_locked_vertices() -> None:
    points = star(3, 12)
    locked = np.arange(12) % 2 == 0
    order = peel(points, NO_WALLS, locked, 4)
    assert (order % 2 == 1).all()
    assert all(shapely.LinearRing(ring).is_simple for ring in stages(points, order.tolist()))


@given(st.integers(0, 2**32 - 1), st.integers(5, 20))
def test_peel__never_touches_nor_swallows_a_wall(seed: int, n: int) -> None:
    points = star(seed, n)
    rim = shapely.LinearRing(points)
    starts = np.random.default_rng(seed).random((30, 2))
    walls = np.hstack((starts, starts + np.random.default_rng(seed + 1).normal(0.0, 0.03, (30, 2))))
    lines = shapely.linestrings(walls.reshape(-1, 2, 2))
    walls, lines = walls[~rim.intersects(lines)], lines[~rim.intersects(lines)]
    was_inside = shapely.Polygon(points).contains(lines)
    order = peel(points, walls, np.zeros(n, np.bool_), 4).tolist()
    for ring in stages(points, order):
        assert shapely.LinearRing(ring).is_simple
        assert not shapely.LinearRing(ring).intersects(lines).any()
        np.testing.assert_array_equal(shapely.Polygon(ring).contains(lines), was_inside)


def test_peel__may_go_past_a_wall_that_ends_in_a_vertex() -> None:
    """A bridge holds its vertex, but not the ones beside it."""
    points = regular(8)
    bridge = np.array([[*points[0], 0.99, 0.5]])
    locked = np.arange(8) == 0
    assert len(peel(points, bridge, locked, 4)) == 4


# --- construction ---


def cycles(rings: Sequence[FloatArray]) -> set[tuple[tuple[float, float], ...]]:
    """Rings as sets of cycles, wherever they begin."""
    found = set()
    for ring in rings:
        points = [(float(x), float(y)) for x, y in ring]
        first = points.index(min(points))
        found.add((*points[first:], *points[:first]))
    return found


def rings_of(mesh: PolyMesh) -> set[tuple[tuple[float, float], ...]]:
    return cycles([mesh.vertices[loop] for loop in mesh.topology.boundary_loops])


def assert_sane(states: Sequence[State]) -> None:
    """Each state follows from the one before, is valid, and has no crossing or flipped face."""
    assert states[0].action is None
    for step, state in enumerate(states):
        assert state.step == step
        assert is_valid(state.mesh) and defects_of(state.mesh) == (0, 0)


def assert_built(states: Sequence[State], rings: Sequence[Ring]) -> None:
    """The last state has exactly these rings, and costs what an outline of them says."""
    assert_sane(states)
    mesh, outline = states[-1].mesh, Outline(tuple(rings))
    assert rings_of(mesh) == cycles([ring.points for ring in rings])
    assert mesh.topology.n_holes == sum(ring.is_hole for ring in rings)
    assert mesh.complexity == outline.complexity
    assert len(states) - 1 == outline.n_steps
    read = outline_of_mesh(mesh)
    assert read is not None and cycles([r.points for r in read.rings]) == rings_of(mesh)


def random_rings(seed: int) -> list[Ring]:
    """A blob in the middle with up to four holes, and up to four parts in the corners, some of them triangles."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(6, 24))
    blob = 0.5 + (regular(n) - 0.5) * rng.uniform(0.65, 0.85, (n, 1))
    places = [(0.42, 0.42), (0.58, 0.42), (0.42, 0.58), (0.58, 0.58)]
    corners = [(0.1, 0.1), (0.9, 0.1), (0.1, 0.9), (0.9, 0.9)]
    holes = [hole(some_ring(rng, places[k], 0.07)) for k in rng.permutation(4)[: rng.integers(0, 5)]]
    parts = [Ring(some_ring(rng, corners[k], 0.09), -1) for k in rng.permutation(4)[: rng.integers(0, 5)]]
    return [Ring(blob, -1), *parts, *holes]


def some_ring(rng: np.random.Generator, centre: tuple[float, float], radius: float) -> FloatArray:
    if rng.random() < 0.3:
        return small(TRIANGLE, *centre, 2 * radius)
    return star(int(rng.integers(2**32)), int(rng.integers(4, 12)), centre, radius)


@pytest.mark.parametrize("seed", range(40))
def test_construct__builds_a_blob_with_holes_and_further_parts(seed: int) -> None:
    rings = random_rings(seed)
    assert_built(construct(GAME, rings), rings)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30)
def test_construct__builds_any_star(seed: int) -> None:
    rings = [Ring(star(seed, 4 + seed % 30), -1)]
    assert_built(construct(GAME, rings), rings)
    assert_built(construct(PAPER_GAME, rings), rings)


def test_construct__builds_an_island_in_a_hole_in_an_island() -> None:
    rings = [Ring(small(BOX, 0.5, 0.5, s), -1) for s in (1.4, 0.8, 0.3)]
    rings += [hole(small(BOX, 0.5, 0.5, 1.1), 0), hole(small(BOX, 0.5, 0.5, 0.5), 1)]
    assert_built(construct(GAME, rings), rings)


def test_construct__ties_a_hole_past_the_holes_that_are_still_to_come() -> None:
    later = [hole(small(BOX, 0.5 + x, 0.5 + y, 0.1)) for x in (-0.2, 0.2) for y in (-0.2, 0.2)]  # before the corners
    rings = [Ring(BOX, -1), hole(small(BOX, 0.5, 0.5, 0.25)), *later]
    assert_built(construct(GAME, rings), rings)


def test_construct__builds_a_part_that_holds_a_corner_of_another() -> None:
    notched = np.array([(0.82, 0.7), (1.0, 0.7), (1.0, 1.0), (0.7, 1.0), (0.7, 0.82), (0.82, 0.82)])
    rings = [Ring(BOX, -1), Ring(notched, -1)]  # its quad must not have the corner of the box in it
    assert_built(construct(GAME, rings), rings)


def test_construct__grows_a_part_that_can_be_seen_where_it_will_be() -> None:
    left, right = small(BOX, 0.25, 0.5, 0.4), small(BOX, 0.75, 0.5, 0.4)
    *_, before, after = construct(GAME, [Ring(left, -1), Ring(right, -1)])
    assert after.action is not None and after.action.operator == "face_delete"
    assert {*map(tuple, right.tolist())} <= {*map(tuple, before.mesh.vertices.tolist())}


def test_construct__builds_triangles() -> None:
    assert_built(construct(GAME, [Ring(TRIANGLE, -1)]), [Ring(TRIANGLE, -1)])
    part, cut = Ring(small(TRIANGLE, 0.9, 0.9), -1), hole(small(TRIANGLE, 0.5, 0.5))
    assert_built(construct(GAME, [Ring(BOX, -1), part, cut]), [Ring(BOX, -1), part, cut])


def test_construct__makes_quads_of_triangles_where_no_vertex_can_be_dissolved() -> None:
    (state,) = construct(PAPER_GAME, [Ring(TRIANGLE, -1)])
    assert state.mesh.counts == (4, 4, 1)
    assert shapely.Polygon(state.mesh.vertices).symmetric_difference(shapely.Polygon(TRIANGLE)).area < 1e-12
    assert_built(construct(PAPER_GAME, [Ring(BOX, -1), Ring(small(TRIANGLE, 0.9, 0.9), -1)]), [Ring(BOX, -1)])


@pytest.mark.parametrize("seed", range(10))
def test_construct__leaves_holes_out_and_builds_parts_with_the_papers_operators(seed: int) -> None:
    rings = random_rings(seed)
    states = construct(PAPER_GAME, rings)
    assert {state.action.operator for state in states[1:] if state.action} <= set(PAPER_GAME.operators)
    assert_built(states, [ring for ring in rings if not ring.is_hole and (len(ring.points) > 3)])


def test_construct__builds_the_main_ring_only_where_it_can_only_subdivide() -> None:
    game = Simulator(painted(SQUARE), resolution=16, operators="edge_subdivide")
    rings = random_rings(7)
    assert len(rings) > 3
    assert_built(construct(game, rings), rings[:1])


@pytest.mark.parametrize(
    "bad",
    [
        hole(small(BOX, 0.2, 0.5)),  # across the outline
        hole(small(BOX, 0.95, 0.95, 0.05)),  # outside
        hole(small(BOX, 0.3, 0.5, 1 / 3)),  # touches the outline
        hole(BOX),  # all of it
        hole(small(BOX[[0, 2, 1, 3]], 0.5, 0.5)),  # crosses itself
        hole(small(BOX[::-1], 0.5, 0.5)),  # wound the wrong way
        Ring(small(BOX, 0.2, 0.5), -1),  # a part across the outline
        Ring(small(BOX[[0, 2, 1, 3]], 0.9, 0.9), -1),
        Ring(small(BOX[::-1], 0.9, 0.9), -1),
    ],
)
def test_construct__leaves_out_what_cannot_be_built(bad: Ring) -> None:
    good = hole(small(BOX, 0.65, 0.65, 0.1))
    assert_built(construct(GAME, [Ring(BOX, -1), bad, good]), [Ring(BOX, -1), good])


def test_construct__leaves_out_the_holes_of_a_part_that_is_left_out() -> None:
    rings = [Ring(BOX, -1), Ring(small(BOX, 0.2, 0.5), -1), hole(small(BOX, 0.2, 0.5, 0.1), 1)]
    assert_built(construct(GAME, rings), rings[:1])


@pytest.mark.parametrize("main", [BOX[[0, 2, 1, 3]], BOX[::-1], np.insert(BOX, 2, (0.1, 0.5), axis=0)[[0, 2, 1, 3, 4]]])
def test_construct__refuses_a_main_ring_that_is_not_sane(main: FloatArray) -> None:
    with pytest.raises(UnbuildableError):
        construct(GAME, [Ring(main, -1)])


# --- outlines ---


@pytest.mark.parametrize("seed", range(6))
def test_outline__scores_like_the_mesh_that_is_built_of_it(seed: int) -> None:
    game = Simulator(noise(seed), resolution=48)
    outline = Outline(tuple(random_rings(seed)))
    target = game.silhouette.target(48)
    assert outline.score(target, game.weights) == construct(game, outline.rings)[-1].score


def test_outline__without_a_ring_has_not_the_holes_in_it_either() -> None:
    rings = [
        Ring(BOX, -1),
        Ring(small(BOX, 0.9, 0.9), -1),
        hole(small(BOX, 0.5, 0.5)),
        hole(small(BOX, 0.9, 0.9, 0.1), 1),
    ]
    outline = Outline(tuple(rings))
    assert [ring.parent for ring in outline.without_ring(1).rings] == [-1, 0]
    assert [ring.parent for ring in outline.without_ring(2).rings] == [-1, -1, 1]
    assert [ring.parent for ring in outline.without_ring(0).rings] == [-1, 0]


def test_sizes__shrink_as_vertices_grow_dear() -> None:
    rings = trace_rings(noise(1, 48))
    contours = [Contour(ring.points) for ring in rings]
    reach = Reach.of(Simulator(noise(1, 48), resolution=48))
    totals = []
    for price in (0.01, 0.1, 0.3, 1.0, 3.0):
        sizes = list(choose_sizes(rings, contours, ScoreWeights(w_sc=price), 0.5, reach))
        assert len(sizes) == len(rings)
        totals.append(sum(sizes))
    assert totals == sorted(totals, reverse=True) and totals[0] > 2 * totals[-1]


# --- the agent ---


def solved(game: Simulator) -> tuple[PolyMesh, float]:
    solution = TraceAgent(TraceConfig()).solve(game)
    for mesh in solution.sequence.meshes():
        assert defects_of(mesh) == (0, 0)
    return solution.mesh, solution.score.iou


@pytest.mark.parametrize(
    ("shape", "counts"),
    [
        (SQUARE, (4, 4, 1)),
        (HOUSE, (5, 5, 1)),
        (FRAME, (8, 10, 2)),
        (TWO_SQUARES, (8, 8, 2)),
        (ISLAND, (12, 14, 3)),
        (shapely.Polygon(TRIANGLE), (3, 3, 1)),
    ],
)
def test_trace__builds_simple_shapes_with_as_little_as_it_takes(
    shape: shapely.Geometry, counts: tuple[int, int, int]
) -> None:
    mesh, iou = solved(Simulator(painted(shape, 128), resolution=64))
    assert mesh.counts == counts and iou > 0.995


def test_trace__leaves_out_with_a_hole_what_stands_in_it() -> None:
    game = Simulator(painted(ISLAND), resolution=64, operators="paper")
    for outline in TraceAgent(TraceConfig()).outlines(game, Meter(Budget())):
        assert len(outline.rings) == 1
    assert solved(game)[0].counts == (4, 4, 1)


def test_trace__is_the_same_for_weights_all_ten_times_as_large() -> None:
    silhouette = noise(5, 48)
    light, heavy = (
        Simulator(silhouette, resolution=48, weights=ScoreWeights(100.0 * k, 0.3 * k, 5.0 * k)) for k in (1.0, 10.0)
    )
    assert solved(light)[0] == solved(heavy)[0]


def test_trace__falls_back_on_a_rectangle_where_no_outline_can_be_built() -> None:
    crossed = Outline((Ring(BOX[[0, 2, 1, 3]], -1),))
    assert build_best(GAME, [crossed], 3) == [GAME.initial()]
    assert build_best(GAME, [], 3) == [GAME.initial()]
    sane = Outline((Ring(BOX, -1),))
    assert build_best(GAME, [crossed, crossed, crossed, sane], 1)[-1].mesh.counts == (4, 4, 1)


def pixels(*rows_and_columns: tuple[int, int], size: int = 32) -> npt.NDArray[np.bool_]:
    mask = np.zeros((size, size), np.bool_)
    mask[tuple(np.transpose(rows_and_columns))] = True
    return mask


BLOCK = [(row, column) for row in range(3) for column in range(3)]
ODD_MASKS = {
    "one pixel": pixels((7, 9)),
    "one pixel in a corner": pixels((0, 0)),
    "one pixel in all": pixels((0, 0), size=1),
    "a tiny block": pixels(*((r + 12, c + 12) for r, c in BLOCK)),
    "a tiny block in a corner": pixels(*BLOCK),
    "a tiny ring": pixels(*((r + 12, c + 12) for r, c in BLOCK if (r, c) != (1, 1))),
    "a row": pixels(*((5, column) for column in range(32))),
    "a column at the border": pixels(*((row, 31) for row in range(32))),
    "a diagonal": np.eye(32, dtype=np.bool_),
    "a chessboard": np.indices((16, 16)).sum(axis=0) % 2 == 0,
    "everything": np.ones((32, 32), np.bool_),
    "everything but a pixel": ~pixels((9, 9)),
    "everything but a corner": ~pixels((0, 0)),
    "a frame along the border": ~np.pad(np.ones((28, 28), np.bool_), 2),
    "a comb": np.indices((32, 32))[1] * (np.indices((32, 32))[0] > 3) % 3 == 0,
    "a line lost in a large image": pixels(*((700, column) for column in range(100, 900)), size=1024),
}


@pytest.mark.parametrize("operators", ["full", "paper"])
@pytest.mark.parametrize("mask", ODD_MASKS.values(), ids=ODD_MASKS)
def test_trace__builds_something_sane_of_odd_pictures(mask: npt.NDArray[np.bool_], operators: str) -> None:
    solved(Simulator(Silhouette(mask), resolution=32, operators=operators))


@given(
    st.integers(0, 999),
    st.integers(2, 72),
    st.sampled_from(("full", "paper", "edge_subdivide", "face_hole", "edge_extrude,face_delete,vertex_dissolve")),
    st.sampled_from((0, 4, 100)),
)
@settings(max_examples=40)
def test_trace__builds_something_sane_of_any_blobs(seed: int, resolution: int, operators: str, max_steps: int) -> None:
    game = Simulator(noise(seed, resolution), resolution=32, operators=operators, max_steps=max_steps)
    solution = TraceAgent(TraceConfig(prices=(0.5, 2.0))).solve(game)
    assert len(solution.sequence.steps) <= max_steps
    assert all(defects_of(mesh) == (0, 0) for mesh in solution.sequence.meshes())
