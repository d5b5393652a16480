"""Where picture and target disagree: regions, what they measure, and the edges that are to blame."""

import numpy as np
import pytest

from autopoly_env.arrays import FloatArray
from autopoly_env.mesh import PolyMesh
from autopoly_env.placement import blame_kernels as placement_kernels
from autopoly_env.placement.blame_kernels import blame_edges, measure_regions, regions_of
from tests.helpers.shapes import loop, star

MASS, FAR_X, FAR_Y, LOW, HIGH, DEPTH = range(6)


def picture(text: str) -> FloatArray:
    """A difference image: '+' is missing, '-' is excess, '.' agrees."""
    return np.array([[{"+": 1.0, "-": -1.0, ".": 0.0}[c] for c in row] for row in text.split()])


def test_regions__are_4_connected_and_of_one_sign() -> None:
    labels, n_labels = regions_of(picture("++.- .+-- ...+ +..+"), 0.5)
    assert n_labels == 4
    assert labels.tolist() == [[0, 0, -1, 1], [-1, 0, 1, 1], [-1, -1, -1, 2], [3, -1, -1, 2]]


def test_regions__lie_above_the_threshold() -> None:
    labels, n_labels = regions_of(np.array([[0.3, -0.3], [0.31, -0.31]]), 0.3)
    assert (labels.tolist(), n_labels) == ([[-1, -1], [0, 1]], 2)
    assert regions_of(np.zeros((2, 2)), 0.0)[1] == 0


def test_regions__may_wind() -> None:
    labels, n_labels = regions_of(picture("+++++ +...+ +.+.+ +.+++ +...."), 0.5)
    assert n_labels == 1 and (labels == 0).sum() == 15


def blame(difference: FloatArray, mesh: PolyMesh) -> dict[tuple[int, int], FloatArray]:
    """What each boundary edge answers for, by its two vertices: (2, 6)."""
    edges = mesh.topology.boundary_half_edges
    table = blame_edges(mesh.vertices, edges, difference, *regions_of(difference, 0.5))
    return {(int(a), int(b)): row for (a, b), row in zip(edges, table, strict=True)}


def test_blame__goes_to_the_nearest_edge_of_a_square() -> None:
    """Two missing pixels right of the square 2..6 of 8, and one too many inside near its top."""
    difference = picture("........ ........ ....-.+. ......+. ........ ........ ........ ........")
    mesh = PolyMesh.from_faces([(0.25, 0.25), (0.75, 0.25), (0.75, 0.75), (0.25, 0.75)], [(0, 1, 2, 3)])
    table = blame(difference, mesh)
    assert table[1, 2][0].tolist() == [2 / 64, 6.5 / 8, 2.5 / 8, 0.125, 0.375, 0.5 / 8]
    assert table[0, 1][1].tolist() == [1 / 64, 4.5 / 8, 2.5 / 8, 0.625, 0.625, 0.5 / 8]
    assert not any(table[edge].any() for edge in ((2, 3), (3, 0)))
    assert not table[1, 2][1].any() and not table[0, 1][0].any()


def test_blame__is_for_the_larger_of_two_regions_alone() -> None:
    difference = picture("........ ........ ......+. ........ ......++ ......++ ........ ........")
    table = blame(difference, PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75))
    (missing,) = [rows[0] for rows in table.values() if rows[0].any()]
    assert missing[MASS] == 4 / 64 and missing[DEPTH] == 1.5 / 8
    assert (missing[LOW], missing[HIGH]) == (0.625, 0.875)


def test_blame__survives_an_edge_of_no_length() -> None:
    points = np.array([(0.25, 0.25), (0.75, 0.25), (0.75, 0.25), (0.5, 0.75)])
    difference = picture("++++ ++++ ++++ ++++")
    table = blame_edges(points, loop(4), difference, *regions_of(difference, 0.5))
    assert np.isfinite(table).all()
    assert table[:, 0, MASS].sum() == pytest.approx(1.0)


def test_measure_regions__of_a_block_and_a_corner() -> None:
    difference = 0.8 * picture("..... .+++. .+++. .+++. ....-")
    block, corner = measure_regions(difference, *regions_of(difference, 0.5))
    area, x, y, radius, *moments = block
    assert area == pytest.approx(0.8 * 9 / 25)
    assert (x, y, radius) == pytest.approx((0.5, 0.5, 1.5 / 5))
    assert moments == pytest.approx([0.5, 0.5, 2 / 3 / 25, 2 / 3 / 25, 0.0])
    assert corner == pytest.approx([-0.8 / 25, 0.9, 0.9, 0.1, 0.9, 0.9, 0.0, 0.0, 0.0])


def test_measure_regions__of_a_diagonal_band_knows_its_slant() -> None:
    difference = picture("++... .++.. ..++. ...++ ....+")
    (band,) = measure_regions(difference, *regions_of(difference, 0.5))
    assert band[placement_kernels.COV_XY] > 0.9 * np.sqrt(band[placement_kernels.VAR_X] * band[placement_kernels.VAR_Y])


def test_measure_regions__takes_the_rim_of_the_image_for_the_rim_of_the_region() -> None:
    difference = picture("+++ +++ +++")
    (whole,) = measure_regions(difference, *regions_of(difference, 0.5))
    assert whole[placement_kernels.RADIUS] == pytest.approx(0.5)
    assert measure_regions(np.zeros((3, 3)), *regions_of(np.zeros((3, 3)), 0.5)).shape == (0, 9)


def test_blame__reaches_every_pixel_of_a_star() -> None:
    points = star(0, 9)
    difference = np.random.default_rng(0).choice([-1.0, 0.0, 1.0], (12, 12))
    labels, n_labels = regions_of(difference, 0.5)
    table = blame_edges(points, loop(9), difference, labels, n_labels)
    for side, sign in ((0, 1.0), (1, -1.0)):
        assert 0.0 < table[:, side, MASS].sum() <= (difference == sign).sum() / 144 + 1e-12
    assert ((table[:, :, LOW] >= 0.0) & (table[:, :, HIGH] <= 1.0)).all()
