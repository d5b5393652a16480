"""The last touch: vertices move as long as the IoU gains, and what binds them holds."""

import numpy as np
import pytest

from autopoly_env.mesh import PolyMesh, is_sane
from autopoly_env.refit import Bonds, tune
from autopoly_env.score import intersection_over_union
from autopoly_env.silhouette import Target


def target() -> Target:
    """40 x 40 pixels with a rectangle over rows 8..31 and columns 10..29, scored by counting them."""
    coverage = np.zeros((40, 40))
    coverage[8:32, 10:30] = 1.0
    return Target(coverage)


def box(x0: float, y0: float, x1: float, y1: float) -> PolyMesh:
    return PolyMesh.rectangle(x0 / 40, y0 / 40, x1 / 40, y1 / 40)


@pytest.mark.parametrize("start", [(11, 9, 29, 31), (8.5, 7, 31, 33), (12, 8, 30, 32)])
def test_tune__brings_a_box_that_is_a_pixel_off_to_a_perfect_match(start: tuple[float, ...]) -> None:
    assert intersection_over_union(box(*start), target()) < 0.95
    assert intersection_over_union(tune(box(*start), target()), target()) == 1.0


def test_tune__leaves_a_perfect_match_alone() -> None:
    mesh = box(10, 8, 30, 32)
    assert np.array_equal(tune(mesh, target()).vertices, mesh.vertices)


def test_tune__leaves_locked_vertices_alone() -> None:
    mesh = box(11, 9, 29, 31)
    bonds = Bonds(np.array([True, False, False, True]), np.full(4, -1))
    tuned = tune(mesh, target(), bonds)
    still = (tuned.vertices == mesh.vertices).all(axis=1)
    assert still.tolist() == [True, False, False, True]


def test_tune__keeps_mirror_images_mirror_images() -> None:
    mesh = box(11.3, 9, 28.7, 31)
    images = np.array([1, 0, 3, 2])
    tuned = tune(mesh, target(), Bonds(np.zeros(4, np.bool_), images, 0.5)).vertices
    assert not np.array_equal(tuned, mesh.vertices)
    assert np.abs(tuned[:, 0] + tuned[images, 0] - 1.0).max() < 1e-12
    assert np.array_equal(tuned[:, 1], tuned[images, 1])


def test_tune__keeps_a_vertex_on_the_axis_there() -> None:
    roof = np.array([(0.5, 0.12), (0.72, 0.3), (0.72, 0.78), (0.28, 0.78), (0.28, 0.3)])
    mesh = PolyMesh.from_faces(roof, [(0, 1, 2, 3, 4)])
    tuned = tune(mesh, target(), Bonds(np.zeros(5, np.bool_), np.array([0, 4, 3, 2, 1]), 0.5)).vertices
    assert tuned[0, 0] == 0.5 and not np.array_equal(tuned, roof)


def test_tune__never_loses_and_never_crosses() -> None:
    rng = np.random.default_rng(5)
    for _ in range(60):
        angles = np.sort(rng.random(7)) * 2 * np.pi
        radii = rng.uniform(0.1, 0.45, 7)[:, None]
        mesh = PolyMesh.from_faces(0.5 + radii * np.column_stack((np.cos(angles), np.sin(angles))), [tuple(range(7))])
        if not is_sane(mesh):
            continue
        tuned = tune(mesh, target())
        assert intersection_over_union(tuned, target()) >= intersection_over_union(mesh, target())
        assert is_sane(tuned)
        assert (tuned.vertices >= 0.0).all() and (tuned.vertices <= 1.0).all()
