"""Placement: which edge is blamed for what, where new vertices start, and what they never make worse."""

import numpy as np
import pytest
import scipy.ndimage
import shapely
import skimage.measure
from hypothesis import given
from hypothesis import strategies as st

from autopoly_env.arrays import FloatArray
from autopoly_env.errors import IllegalActionError
from autopoly_env.mesh import PolyMesh, defects_of
from autopoly_env.operators import OPERATORS, Action, HoleChoice, Start, legal_actions
from autopoly_env.placement import Disagreement, tried
from autopoly_env.placement import blame_kernels as placement_kernels
from autopoly_env.raster import coverage
from tests.helpers.drawings import FRAME, SQUARE, noise, painted
from tests.helpers.shapes import polygon
from tests.helpers.strategies import meshes

RECTANGLE = PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75)  # SQUARE
PIXEL = 1 / 64
RIGHT, BOTTOM = 1, 2  # corner from which the edge starts
BUMP = shapely.box(48 * PIXEL, 26 * PIXEL, 56 * PIXEL, 38 * PIXEL)  # on the right edge
NOTCH = shapely.box(24 * PIXEL, 40 * PIXEL, 36 * PIXEL, 48 * PIXEL)  # in the bottom edge
MISSING, EXCESS = 0, 1


def starts(disagreement: Disagreement, action: Action) -> list[Start]:
    return tried(disagreement, action).starts


def row_from(mesh: PolyMesh, corner: int) -> int:
    """The boundary edge that starts at a vertex, as a row of `blame`."""
    return mesh.topology.boundary_half_edges[:, 0].tolist().index(corner)


def edge_from(mesh: PolyMesh, corner: int) -> int:
    return mesh.edge_index(*mesh.topology.boundary_half_edges[row_from(mesh, corner)].tolist())


# --- blame ---


def test_blame__of_a_perfect_mesh_is_nothing() -> None:
    disagreement = Disagreement(RECTANGLE, painted(SQUARE))
    assert disagreement.n_regions == 0
    assert not disagreement.blame[:, :, placement_kernels.MASS].any()


@pytest.mark.parametrize("resolution", [64, 256])
def test_blame__for_a_bump_goes_to_the_edge_it_sits_on(resolution: int) -> None:
    blame = Disagreement(RECTANGLE, painted(SQUARE | BUMP, resolution)).blame
    mass, x, y, low, high, depth = blame[row_from(RECTANGLE, RIGHT), MISSING]
    assert mass == pytest.approx(BUMP.area)
    assert depth == pytest.approx(7.5 * PIXEL)
    assert x == pytest.approx(55.5 * PIXEL) and 26 * PIXEL < y < 38 * PIXEL
    assert (low, high) == pytest.approx((10.5 / 32, 21.5 / 32))
    assert blame[:, :, placement_kernels.MASS].sum() == pytest.approx(BUMP.area)


def test_blame__for_a_notch_is_an_excess() -> None:
    blame = Disagreement(RECTANGLE, painted(SQUARE - NOTCH)).blame
    mass, _, y, low, high, depth = blame[row_from(RECTANGLE, BOTTOM), EXCESS]
    assert mass == pytest.approx(NOTCH.area)
    assert (y, depth) == pytest.approx((40.5 * PIXEL, 7.5 * PIXEL))
    assert (low, high) == pytest.approx((12.5 / 32, 23.5 / 32))  # from the right, as the edge runs
    assert blame[:, :, placement_kernels.MASS].sum() == pytest.approx(NOTCH.area)


def test_blame__keeps_to_the_larger_of_two_regions_at_one_edge() -> None:
    speck = shapely.box(48 * PIXEL, 18 * PIXEL, 50 * PIXEL, 20 * PIXEL)
    blame = Disagreement(RECTANGLE, painted(SQUARE | BUMP | speck)).blame
    assert blame[row_from(RECTANGLE, RIGHT), MISSING, placement_kernels.MASS] == pytest.approx(BUMP.area)


def test_blame__counts_faces_that_overlap_once() -> None:
    twice = PolyMesh.from_faces(np.concatenate((RECTANGLE.vertices, RECTANGLE.vertices)), [(0, 1, 2, 3), (4, 5, 6, 7)])
    assert Disagreement(twice, painted(SQUARE)).n_regions == 0


# --- regions ---


def difference(seed: int) -> FloatArray:
    return Disagreement(RECTANGLE, noise(seed, 64)).difference


@pytest.mark.parametrize("seed", range(6))
def test_regions__are_the_components_of_what_is_missing_and_of_the_excess(seed: int) -> None:
    image = difference(seed)
    labels, n_regions = placement_kernels.regions_of(image, 0.3)
    kinds = np.where(image > 0.3, 1, np.where(image < -0.3, 2, 0))
    expected, n_expected = skimage.measure.label(kinds, connectivity=1, return_num=True)
    assert n_regions == n_expected
    assert len(np.unique(np.stack((labels, expected)).reshape(2, -1), axis=1).T) == n_expected + (kinds == 0).any()
    np.testing.assert_array_equal(labels < 0, kinds == 0)


@pytest.mark.parametrize("seed", range(6))
def test_regions__are_measured_as_numpy_does(seed: int) -> None:
    image = difference(seed)
    labels, n_regions = placement_kernels.regions_of(image, 0.3)
    measured = placement_kernels.measure_regions(image, labels, n_regions)
    for label, (area, deep_x, deep_y, radius, *moments) in enumerate(measured):
        rows, columns = np.nonzero(labels == label)
        x, y = (columns + 0.5) / 64, (rows + 0.5) / 64
        assert area == pytest.approx(image[rows, columns].sum() / 64**2)
        assert moments == pytest.approx(
            [x.mean(), y.mean(), x.var(), y.var(), ((x - x.mean()) * (y - y.mean())).mean()]
        )
        depth = scipy.ndimage.distance_transform_edt(np.pad(labels == label, 1)).max() - 0.5  # to the pixels' rim
        assert 64 * radius == pytest.approx(depth, abs=0.5 + 0.08 * depth)  # a chamfer distance
        assert labels[int(64 * deep_y), int(64 * deep_x)] == label


# --- starts ---


def test_subdivide__starts_at_the_far_end_of_the_bump() -> None:
    disagreement = Disagreement(RECTANGLE, painted(SQUARE | BUMP))
    (_, pulled, _), (_, plain, _) = starts(disagreement, Action("edge_subdivide", edge_from(RECTANGLE, RIGHT)))
    x, y = pulled.vertices[-1]
    assert x == pytest.approx(55.5 * PIXEL) and 26 * PIXEL < y < 38 * PIXEL
    assert plain == OPERATORS["edge_subdivide"].apply(RECTANGLE, edge_from(RECTANGLE, RIGHT))


def test_subdivide__starts_at_the_inner_end_of_the_notch() -> None:
    disagreement = Disagreement(RECTANGLE, painted(SQUARE - NOTCH))
    (_, pulled, _), _ = starts(disagreement, Action("edge_subdivide", edge_from(RECTANGLE, BOTTOM)))
    x, y = pulled.vertices[-1]
    assert y == pytest.approx(40.5 * PIXEL) and 24 * PIXEL < x < 36 * PIXEL


def test_extrude__starts_as_wide_and_deep_as_the_bump() -> None:
    disagreement = Disagreement(RECTANGLE, painted(SQUARE | BUMP))
    (_, stretched, _), (_, plain, _) = starts(disagreement, Action("edge_extrude", edge_from(RECTANGLE, RIGHT)))
    grown = shapely.Polygon(stretched.vertices[list(stretched.faces[-1])])
    assert grown.exterior.is_ccw  # positive area
    np.testing.assert_allclose(stretched.vertices[-2:], [(55.5 * PIXEL, 26.5 * PIXEL), (55.5 * PIXEL, 37.5 * PIXEL)])
    assert plain == OPERATORS["edge_extrude"].apply(RECTANGLE, edge_from(RECTANGLE, RIGHT))


@pytest.mark.parametrize("operator", ["edge_subdivide", "edge_extrude"])
def test_starts__at_an_edge_without_blame_are_the_operators_own(operator: str) -> None:
    disagreement = Disagreement(RECTANGLE, painted(SQUARE | BUMP))
    element = edge_from(RECTANGLE, BOTTOM)
    assert starts(disagreement, Action(operator, element)) == [
        Start(None, OPERATORS[operator].apply(RECTANGLE, element))
    ]


@pytest.mark.parametrize("n_sides", [3, 4])
@pytest.mark.parametrize("turn", [0.0, 30.0])
def test_hole__starts_over_the_excess(n_sides: int, turn: float) -> None:
    excess = shapely.affinity.rotate(shapely.box(0.35, 0.5, 0.65, 0.6), turn)
    disagreement = Disagreement(RECTANGLE, painted(SQUARE - excess))
    ((choice, mesh, _),) = starts(disagreement, Action("face_hole", n_sides - 3))
    assert isinstance(choice, HoleChoice) and len(choice.points) == n_sides
    hole = shapely.Polygon(choice.points)
    assert hole.intersection(excess).area > (0.75 if n_sides == 4 else 0.35) * hole.union(excess).area
    np.testing.assert_array_equal(mesh.vertices[-n_sides:], choice.points)
    assert defects_of(mesh) == (0, 0)


def test_hole__starts_over_the_larger_of_two() -> None:
    large, little = shapely.box(0.3, 0.3, 0.45, 0.45), shapely.box(0.6, 0.6, 0.7, 0.7)
    ((choice, _, _),) = starts(Disagreement(RECTANGLE, painted(SQUARE - large - little)), Action("face_hole", 1))
    assert isinstance(choice, HoleChoice)
    assert shapely.Polygon(choice.points).intersection(large).area > 0.75 * large.area


def test_hole__of_the_frame_is_its_square() -> None:
    mesh = PolyMesh.rectangle(0.125, 0.125, 0.875, 0.875)
    ((choice, _, _),) = starts(Disagreement(mesh, painted(FRAME)), Action("face_hole", 1))
    assert isinstance(choice, HoleChoice)
    assert shapely.Polygon(choice.points).symmetric_difference(shapely.box(0.375, 0.375, 0.625, 0.625)).area < 0.02


def test_hole__in_a_face_with_nothing_too_much_is_the_operators_own() -> None:
    disagreement = Disagreement(RECTANGLE, painted(SQUARE))
    default = OPERATORS["face_hole"].choose(RECTANGLE, 1)
    assert starts(disagreement, Action("face_hole", 1)) == [Start(default, OPERATORS["face_hole"].apply(RECTANGLE, 1))]


def test_hole__that_fits_nowhere_is_refused() -> None:
    crossed = polygon([(0.1, 0.1), (0.9, 0.9), (0.9, 0.1), (0.1, 0.9)])
    with pytest.raises(IllegalActionError, match="face_hole"):
        starts(Disagreement(crossed, painted(SQUARE)), Action("face_hole", 0))


@pytest.mark.parametrize("operator", OPERATORS)
def test_starts__refuse_an_element_that_does_not_exist(operator: str) -> None:
    disagreement = Disagreement(RECTANGLE, painted(SQUARE))
    for element in (-1, OPERATORS[operator].element.count(RECTANGLE)):
        with pytest.raises(IllegalActionError, match=rf"^{operator} cannot work on \w+ {element}"):
            starts(disagreement, Action(operator, element))


@pytest.mark.slow
@given(meshes(), st.integers(0, 99))
def test_starts__are_no_worse_than_the_mesh_or_else_the_operators_own(mesh: PolyMesh, seed: int) -> None:
    """Crossings and flipped faces; the last start is the operator's own unless it cuts a hole."""
    disagreement = Disagreement(mesh, noise(seed))
    before = defects_of(mesh)
    for action in legal_actions(mesh, OPERATORS)[seed % 4 :: 4]:
        found = starts(disagreement, action)
        for choice, start, _ in found:
            made = OPERATORS[action.operator].apply(mesh, action.element, choice)
            assert made.with_vertices(start.vertices) == start  # all but positions
            after = defects_of(start)
            assert start == made or (after[0] <= before[0] and after[1] <= before[1])
        assert found[-1].mesh == made


@pytest.mark.slow
@given(meshes(), st.integers(0, 99))
def test_what_does_not_show__leaves_the_picture_as_it_is(mesh: PolyMesh, seed: int) -> None:
    disagreement = Disagreement(mesh, noise(seed))
    actions = [
        action
        for action in legal_actions(mesh, OPERATORS)
        if not OPERATORS[action.operator].shows(mesh, action.element)
    ]
    silent = {"edge_subdivide", "face_split", "edge_dissolve", "loop_cut", "face_inset"}
    assert {action.operator for action in actions} <= silent
    for action in actions[seed % 4 :: 4]:
        (_, after, _), *_ = starts(disagreement, action)
        np.testing.assert_allclose(coverage(after, 32), coverage(mesh, 32), atol=1e-12)
