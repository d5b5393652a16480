"""Plane geometry: orientation, crossings and face areas, against fractions and shapely."""

from fractions import Fraction

import numpy as np
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from autopoly_env.mesh import PolyMesh
from autopoly_env.mesh.geometry_kernels import UNCERTAIN, count_crossings, face_areas, orientation
from tests.helpers.shapes import pairs_that_meet
from tests.helpers.strategies import meshes, random_walk

# --- orientation ---


def test_orientation__has_the_sign_of_the_area() -> None:
    assert orientation(0.0, 0.0, 1.0, 0.0, 0.0, 1.0) == 1
    assert orientation(0.0, 0.0, 0.0, 1.0, 1.0, 0.0) == -1
    assert orientation(0.5, 0.5, 0.5, 0.5, 0.5, 0.5) == 0
    assert orientation(0.0, 0.25, 1.0, 0.25, 0.5, 0.25) == 0


def test_orientation__says_where_rounding_decides() -> None:
    assert orientation(0.0, 0.0, 1.0, 1.0, 0.5, 0.5 + 2.0**-53) == UNCERTAIN
    assert orientation(0.0, 0.0, 1.0, 1.0, 0.5, 0.5 + 2.0**-40) == 1
    assert orientation(0.0, 0.0, 1.0, 1.0, 0.5, 0.5 - 2.0**-40) == -1


COORDINATE = st.floats(-2.0, 2.0, allow_subnormal=False).filter(lambda x: x == 0.0 or abs(x) > 1e-100)
NEAR_DIAGONAL = st.builds(lambda x, k: (x, x + k * 2.0**-54), COORDINATE, st.integers(-3, 3))


@given(*[st.tuples(COORDINATE, COORDINATE) | NEAR_DIAGONAL] * 3)
@settings(max_examples=300)
def test_orientation__is_never_wrong_when_certain(
    a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]
) -> None:
    sign = orientation(*a, *b, *c)
    (ax, ay), (bx, by), (cx, cy) = ((Fraction(x), Fraction(y)) for x, y in (a, b, c))
    exact = (ax - cx) * (by - cy) - (ay - cy) * (bx - cx)
    assert sign == UNCERTAIN or sign == (exact > 0) - (exact < 0)


# --- crossings ---


def test_crossings__by_hand() -> None:
    cross = np.array([(0.0, 0.1), (1.0, 0.8), (0.1, 1.0), (0.9, 0.0)])
    assert count_crossings(cross, np.array([(0, 1), (2, 3)])) == (1, 0)
    assert count_crossings(cross, np.array([(0, 3), (1, 2)])) == (0, 0)
    assert count_crossings(cross, np.array([(0, 1), (1, 2), (2, 0)])) == (0, 0)  # all of them share a vertex
    assert count_crossings(cross, np.empty((0, 2), np.int64)) == (0, 0)


def test_crossings__count_touching_and_overlapping_edges() -> None:
    points = np.array([(0.0, 0.5), (1.0, 0.5), (0.25, 0.5), (0.25, 1.0), (0.5, 0.5), (2.0, 0.5), (1.5, 0.5)])
    assert count_crossings(points, np.array([(0, 1), (2, 3)])) == (1, 0)
    assert count_crossings(points, np.array([(0, 1), (4, 5)])) == (1, 0)
    assert count_crossings(points, np.array([(0, 1), (5, 6)])) == (0, 0)


@given(st.integers(0, 2**32 - 1), st.integers(2, 24), st.integers(1, 30))
@settings(max_examples=60)
def test_crossings__of_random_edges_equal_shapelys(seed: int, n_points: int, n_edges: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.random((n_points, 2))
    edges = np.array([rng.choice(n_points, 2, replace=False) for _ in range(n_edges)])
    assert count_crossings(points, edges) == (pairs_that_meet(points, edges), 0)


@given(st.integers(0, 2**32 - 1), st.integers(4, 14), st.integers(1, 4))
@settings(max_examples=100)
def test_crossings__on_a_coarse_grid_are_bracketed(seed: int, n_points: int, side: int) -> None:
    """Many touching, collinear, coincident and empty edges: those that rounding decides may go either way."""
    rng = np.random.default_rng(seed)
    points = rng.integers(0, side + 1, (n_points, 2)).astype(float)
    edges = np.array([rng.choice(n_points, 2, replace=False) for _ in range(20)])
    certain, uncertain = count_crossings(points, edges)
    assert certain <= pairs_that_meet(points, edges) <= certain + uncertain


@given(meshes(max_steps=12), st.integers(0, 2**32 - 1), st.sampled_from([0.0, 0.05, 0.3]))
@settings(max_examples=30)
def test_crossings__of_meshes_are_bracketed(mesh: PolyMesh, seed: int, shake: float) -> None:
    points = mesh.vertices + np.random.default_rng(seed).normal(0.0, shake, mesh.vertices.shape)
    certain, uncertain = count_crossings(points, mesh.edges)
    assert certain <= pairs_that_meet(points, mesh.edges) <= certain + uncertain
    assert shake == 0.0 or uncertain == 0


# --- face areas ---


def areas_of(mesh: PolyMesh) -> list[float]:
    return face_areas(mesh.vertices, mesh.topology.corners, mesh.topology.face_offsets).tolist()


def test_face_areas__by_hand() -> None:
    points = [(0, 0), (1, 0), (1, 1), (0, 1), (0.5, 0.5), (0.5, 0.25)]
    assert areas_of(PolyMesh.from_faces(points, [(0, 1, 2, 4, 3), (2, 1, 5)])) == [0.75, -0.25]


def test_face_areas__equal_shapelys() -> None:
    for seed in range(5):
        mesh = random_walk(seed, n_steps=20)[-1].after
        expected = [shapely.Polygon(mesh.vertices[list(face)]).area for face in mesh.faces]
        np.testing.assert_allclose(areas_of(mesh), expected, rtol=0, atol=1e-15)
