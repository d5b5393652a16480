"""The score: totals by hand, the IoU against a dense one, crossings against shapely."""

import json
from dataclasses import asdict, replace

import numpy as np
import pytest
import shapely
from hypothesis import assume, example, given
from hypothesis import strategies as st

from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh
from autopoly_env.raster import coverage
from autopoly_env.score import Score, ScoreWeights, intersection_over_union, score, self_intersections
from autopoly_env.silhouette import Silhouette, Target
from tests.helpers.drawings import SQUARE, noise, painted
from tests.helpers.shapes import hourglass, pairs_that_meet, polygon, shapely_coverage, star
from tests.helpers.strategies import meshes

HALF = PolyMesh.rectangle(0.25, 0.25, 0.75, 0.5)  # of SQUARE
BOW_TIE = polygon([(0.1, 0.1), (0.9, 0.9), (0.9, 0.1), (0.1, 0.9)])


def target_of(*rows: str) -> Target:
    """A target drawn in characters, # being object."""
    return Target(np.array([[c == "#" for c in row] for row in rows], np.float64))


# --- totals ---


def test_score__of_half_a_square_is_known_by_hand() -> None:
    found = score(HALF, painted(SQUARE, 8).target(8), ScoreWeights())
    assert (found.iou, found.complexity, found.self_intersections) == (0.5, 9, 0)
    assert found.total == pytest.approx(50.0 - 0.3 * 9)


def test_score__takes_off_for_every_crossing() -> None:
    # The two triangles are wound against each other: one covers the left of the image, the other minus the right.
    found = score(BOW_TIE, target_of("#.", "#."), ScoreWeights(w_sm=10.0, w_sc=1.0, w_si=2.0))
    assert (found.complexity, found.self_intersections) == (9, 1)
    assert found.total == pytest.approx(10.0 * found.iou - 9.0 - 2.0)


def test_score__counts_vertices_edges_and_faces() -> None:
    found = score(PolyMesh.grid(2, 0.0, 0.0, 1.0, 1.0), target_of("##", "##"), ScoreWeights())
    assert (found.iou, found.complexity) == (1.0, 9 + 12 + 4)
    assert found.total == pytest.approx(92.5)


def test_score__comes_back_from_json() -> None:
    found = score(HALF, painted(SQUARE).target(64), ScoreWeights())
    assert Score(**json.loads(json.dumps(found.as_dict()))) == found


@pytest.mark.slow
@given(meshes(), st.sampled_from(("w_sm", "w_sc", "w_si")), st.floats(0.0, 1e3), st.floats(0.0, 1e3))
def test_score__rises_with_w_sm_and_falls_with_the_other_weights(mesh: PolyMesh, name: str, a: float, b: float) -> None:
    target = painted(SQUARE, 16).target(16)
    low, high = (score(mesh, target, replace(ScoreWeights(), **{name: w})) for w in sorted((a, b)))
    assert (low.total <= high.total) if name == "w_sm" else (low.total >= high.total)


@pytest.mark.parametrize("name", ["w_sm", "w_sc", "w_si"])
@pytest.mark.parametrize("value", [-1e-9, float("nan"), float("inf")])
def test_weights__refuse_what_is_negative_or_not_finite(name: str, value: float) -> None:
    with pytest.raises(ConfigError, match=rf"^{name} = {value}: .*at least 0$"):
        replace(ScoreWeights(), **{name: value})


def test_weights__are_those_of_the_paper_by_default_and_may_be_zero() -> None:
    assert asdict(ScoreWeights()) == {"w_sm": 100.0, "w_sc": 0.3, "w_si": 5.0, "w_locality": 0.0}
    assert score(HALF, painted(SQUARE, 8).target(8), ScoreWeights(0.0, 0.0, 0.0)).total == 0.0


# --- intersection over union ---


@pytest.mark.parametrize(
    ("right", "expected"), [(0.12, 0.0), (0.125, 1 / 2), (0.37, 1 / 2), (0.375, 1.0), (0.625, 2 / 3), (0.99, 2 / 4)]
)
def test_iou__counts_pixels_covered_by_half_or_more(right: float, expected: float) -> None:
    target = target_of("....", "##..", "....", "....")
    assert intersection_over_union(PolyMesh.rectangle(0.0, 0.25, right, 0.5), target) == expected


def test_iou__counts_what_lies_outside_the_object_once_and_outside_the_image_never() -> None:
    target = target_of("#.", "..")
    assert intersection_over_union(PolyMesh.rectangle(-3.0, -3.0, 4.0, 4.0), target) == 1 / 4
    assert intersection_over_union(PolyMesh.rectangle(0.5, 0.5, 4.0, 4.0), target) == 0.0


def test_iou__of_nothing_with_nothing_is_one() -> None:
    speck = np.zeros((8, 8), np.bool_)
    speck[0, 0] = True
    assert intersection_over_union(PolyMesh.rectangle(0.0, 0.0, 0.1, 0.1), Silhouette(speck).target(2)) == 1.0


def test_iou__does_not_see_how_a_shape_is_divided_into_faces() -> None:
    target = noise(3, 32).target(32)
    whole = PolyMesh.rectangle(0.2, 0.3, 0.9, 0.8)
    assert intersection_over_union(PolyMesh.grid(3, 0.2, 0.3, 0.9, 0.8), target) == intersection_over_union(
        whole, target
    )


@pytest.mark.parametrize("seed", range(8))
def test_iou__of_a_polygon_equals_that_of_its_exact_areas(seed: int) -> None:
    points = star(seed, 9)
    target = Target(noise(seed, 16).target(16).coverage)  # that counts pixels, small as it is
    drawn = shapely_coverage(shapely.Polygon(points), 16) >= 0.5
    expected = (drawn & target.mask).sum() / (drawn | target.mask).sum()
    assert intersection_over_union(polygon(points), target) == expected


@pytest.mark.slow
@given(meshes(), st.integers(0, 99), st.sampled_from((5, 16, 64, 100)))
def test_iou__equals_that_of_the_whole_image(mesh: PolyMesh, seed: int, resolution: int) -> None:
    target = noise(seed).target(resolution)
    drawn = coverage(mesh, resolution)
    assume(np.abs(drawn - 0.5).min() > 1e-12)  # which rounding would decide
    union = ((drawn > 0.5) | target.mask).sum()
    expected = ((drawn > 0.5) & target.mask).sum() / union if union else 1.0
    assert intersection_over_union(mesh, target) == expected


# --- self-intersections ---


@pytest.mark.parametrize(
    ("mesh", "expected"),
    [
        (PolyMesh.rectangle(0.1, 0.1, 0.9, 0.9), 0),
        (PolyMesh.grid(2, 0.1, 0.1, 0.9, 0.9), 0),
        (hourglass(), 0),  # edges that share a vertex do not count
        (BOW_TIE, 1),
        (polygon([(0.5 + 0.4 * np.cos(t), 0.5 + 0.4 * np.sin(t)) for t in 0.8 * np.pi * np.arange(5)]), 5),  # pentagram
        (polygon([(0, 0), (1, 0), (1, 1), (0.5, 0), (0, 1)]), 2),  # a corner touches an edge: two edges meet it
        (polygon([(0, 0), (1, 0), (1, 1), (0.75, 0), (0.25, 0), (0, 1)]), 3),  # an edge lies on an edge
        (polygon([(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)]), 1),  # two corners in one place: both their other edges
        (polygon([(0, 0), (1, 0), (0.5, 0), (0.5, 1)]), 1),  # a spike: two edges of one line share a vertex
    ],
)
def test_self_intersections__are_the_pairs_of_edges_that_meet(mesh: PolyMesh, expected: int) -> None:
    assert self_intersections(mesh) == expected


@pytest.mark.slow
@given(meshes())
def test_self_intersections__equal_shapelys(mesh: PolyMesh) -> None:
    assert self_intersections(mesh) == pairs_that_meet(mesh.vertices, mesh.edges)


@given(
    st.lists(st.tuples(st.integers(0, 4), st.integers(0, 4)), min_size=3, max_size=8),
    st.sampled_from((1.0, 0.25, 0.1, 1 / 3)),
)
@example([(0, 0), (0, 1), (1, 1), (0, 0), (0, 0), (1, 0), (0, 0)], 0.35)  # edges without length on other edges
def test_self_intersections__equal_shapelys_where_all_is_degenerate(
    corners: list[tuple[int, int]], step: float
) -> None:
    mesh = polygon(step * np.array(corners))
    assert self_intersections(mesh) == pairs_that_meet(mesh.vertices, mesh.edges)


# --- small pictures: exact areas ---


@pytest.mark.slow
@given(st.integers(0, 2**32 - 1), st.integers(1, 63))
def test_iou__of_a_small_picture_is_that_of_the_shapes(seed: int, resolution: int) -> None:
    rng = np.random.default_rng(seed)
    mask = rng.random((resolution, resolution)) < 0.5
    mask[rng.integers(resolution), rng.integers(resolution)] = True
    mesh = polygon(star(seed, 7))
    pixels = shapely.union_all([shapely.box(x, y, x + 1, y + 1) for y, x in np.argwhere(mask)])
    shape = shapely.Polygon(mesh.vertices[list(mesh.faces[0])] * resolution)
    expected = shape.intersection(pixels).area / shape.union(pixels).area
    target = Target(mask.astype(np.float64), by_area=True)
    assert intersection_over_union(mesh, target) == pytest.approx(expected, abs=1e-9)


def test_iou__counts_areas_of_small_pictures_but_not_of_slanting_lines() -> None:
    assert painted(SQUARE, 32).target(32).by_area
    assert not Silhouette(np.eye(32, dtype=np.bool_)).target(32).by_area
    assert not painted(SQUARE, 64).target(64).by_area
    assert not painted(SQUARE, 32).target(64).by_area  # blocks of a small one, as a refit sees it
