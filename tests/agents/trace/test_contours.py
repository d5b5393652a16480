"""Contours of pictures, and the optimal polygons of contours."""

from itertools import combinations, pairwise

import numpy as np
import numpy.typing as npt
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from agents.trace.rings import signed_area, trace_rings
from agents.trace.simplify import Contour
from agents.trace.simplify_kernels import chord_errors, thin
from autopoly_env.arrays import FloatArray
from autopoly_env.silhouette import Silhouette, label_holes, label_parts
from tests.helpers.drawings import FRAME, HOUSE, ISLAND, noise, painted
from tests.helpers.rings import BOX, TRIANGLE, regular
from tests.helpers.shapes import star

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


@pytest.mark.slow
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
    parts = label_parts(silhouette.mask.astype(np.float64)).max()
    holes = label_holes(silhouette.mask.astype(np.float64)).max()
    assert [ring.is_hole for ring in rings] == [False] * parts + [True] * holes
    for ring in rings[parts:]:
        around = shapely.Polygon(rings[ring.parent].points)
        assert around.contains(shapely.Polygon(ring.points))
    areas = [signed_area(ring.points) for ring in rings]
    assert areas == [*sorted(areas[:parts], reverse=True), *sorted(areas[parts:])]


@pytest.mark.slow
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


@pytest.mark.slow
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
    errors = chord_errors(np.array([(0.0, 0.0), (1.0, 1.0), (3.0, -1.0), (4.0, 0.0)]), 4)
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
