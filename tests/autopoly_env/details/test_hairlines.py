"""Hairlines: corridors and slits that nobody sees."""

import numpy as np
import pytest

from autopoly_env.details import hairlines
from autopoly_env.mesh import PolyMesh, is_sane
from autopoly_env.silhouette import Silhouette

SIZE = 64


def ring(points: list[tuple[float, float]]) -> PolyMesh:
    """One face with these corners, in pixels."""
    return PolyMesh.from_faces(np.array(points) / SIZE, [tuple(range(len(points)))])


def bars_joined(width: float) -> PolyMesh:
    """Two bars, 16 pixels apart, and a corridor between them."""
    low, high = 32.0 - 0.5 * width, 32.0 + 0.5 * width
    left = [(8.0, 56.0), (8.0, 8.0), (24.0, 8.0), (24.0, low)]
    right = [(40.0, low), (40.0, 8.0), (56.0, 8.0), (56.0, 56.0), (40.0, 56.0), (40.0, high)]
    return ring([*left, *right, (24.0, high), (24.0, 56.0)])


def frame_slit(width: float) -> PolyMesh:
    """A square with a square hole that a slit opens to the right."""
    low, high = 32.0 - 0.5 * width, 32.0 + 0.5 * width
    outside = [(56.0, high), (56.0, 56.0), (8.0, 56.0), (8.0, 8.0), (56.0, 8.0), (56.0, low)]
    return ring([*outside, (44.0, low), (44.0, 20.0), (20.0, 20.0), (20.0, 44.0), (44.0, 44.0), (44.0, high)])


def painted(*boxes: tuple[int, int, int, int], holes: tuple[tuple[int, int, int, int], ...] = ()) -> Silhouette:
    mask = np.zeros((SIZE, SIZE), np.bool_)
    for value, group in ((True, boxes), (False, holes)):
        for x0, y0, x1, y1 in group:
            mask[y0:y1, x0:x1] = value
    return Silhouette(mask)


BARS = painted((8, 8, 24, 56), (40, 8, 56, 56))
H_SHAPE = painted((8, 8, 24, 56), (40, 8, 56, 56), (24, 31, 40, 33))
FRAME = painted((8, 8, 56, 56), holes=((20, 20, 44, 44),))
C_SHAPE = painted((8, 8, 56, 56), holes=((20, 20, 44, 44), (44, 31, 56, 33)))


def test_is_sane__refuses_a_corridor_of_no_width() -> None:
    assert not is_sane(bars_joined(0.01))
    assert is_sane(bars_joined(0.1))  # 1.6e-3 of the picture: wide enough for a mesh that knows no picture


def test_is_sane__refuses_two_vertices_as_good_as_in_one_place() -> None:
    near = 32.0 + 1e-11
    points = np.array([(8, 8), (32, 8), (32, 32), (8, 32), (near, near), (56, 32), (56, 56), (32, 56)])
    assert not is_sane(PolyMesh.from_faces(points / SIZE, [(0, 1, 2, 3), (4, 5, 6, 7)]))
    assert is_sane(pinched())


def pinched() -> PolyMesh:
    """Two squares that share a vertex."""
    points = np.array([(8, 8), (32, 8), (32, 32), (8, 32), (56, 32), (56, 56), (32, 56)]) / SIZE
    return PolyMesh.from_faces(points, [(0, 1, 2, 3), (2, 4, 5, 6)])


@pytest.mark.parametrize("width", [0.1, 0.5, 1.2])
def test_hairlines__are_corridors_over_background(width: float) -> None:
    assert hairlines(bars_joined(width), BARS.target(SIZE)) > 0


def test_hairlines__are_no_corridors_that_the_picture_has_or_that_can_be_seen() -> None:
    assert hairlines(bars_joined(1.2), H_SHAPE.target(SIZE)) == 0
    assert hairlines(bars_joined(3.0), BARS.target(SIZE)) == 0


def test_hairlines__are_what_is_too_narrow_for_any_picture() -> None:
    assert hairlines(bars_joined(0.1), H_SHAPE.target(SIZE)) > 0


@pytest.mark.parametrize("width", [0.1, 1.0])
def test_hairlines__are_slits_through_the_object(width: float) -> None:
    assert hairlines(frame_slit(width), FRAME.target(SIZE)) > 0


def test_hairlines__are_no_slits_that_the_picture_has() -> None:
    assert hairlines(frame_slit(1.4), C_SHAPE.target(SIZE)) == 0


def test_hairlines__are_no_spikes_and_no_short_edges() -> None:
    spike = ring([(8.0, 8.0), (40.0, 8.0), (56.0, 8.5), (40.0, 9.0), (40.0, 40.0), (8.0, 40.0)])
    blunt = ring([(8.0, 8.0), (40.0, 8.0), (40.5, 8.5), (40.5, 40.0), (8.0, 40.0)])
    assert hairlines(spike, painted((8, 8, 40, 40)).target(SIZE)) == 0
    assert hairlines(blunt, painted((8, 8, 40, 40)).target(SIZE)) == 0
