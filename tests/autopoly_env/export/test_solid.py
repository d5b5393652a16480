"""Thickness: solids that are closed, have the right volume and keep their n-gons; the triangles they are cut into."""

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from autopoly_env.errors import ConfigError
from autopoly_env.export.solid import APART, Solid, to_solid, to_solid_obj, to_triangles
from autopoly_env.export.triangles import is_concave, triangulate
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import OPERATORS
from tests.helpers.shapes import hourglass, polygon, star
from tests.helpers.strategies import meshes

QUAD = PolyMesh.rectangle(0.25, 0.125, 0.75, 0.5)
RING = OPERATORS["face_delete"].apply(PolyMesh.grid(3, 0.1, 0.1, 0.9, 0.9), 4)  # 8 quads around a hole
DIAGONAL = OPERATORS["face_delete"].apply(
    OPERATORS["face_delete"].apply(PolyMesh.grid(2, 0.1, 0.1, 0.9, 0.9), 1), 1
)  # two quads that meet in the middle


def volume(solid: Solid) -> float:
    """By the divergence theorem, each face as a fan, which is exact for flat faces."""
    corners = [(face[0], *pair) for face in solid.faces for pair in pairwise(face[1:])]
    return float(np.linalg.det(solid.vertices[corners]).sum() / 6.0)


def n_faces_along(faces: tuple[tuple[int, ...], ...]) -> Counter[tuple[int, int]]:
    """How many faces run along each directed edge."""
    return Counter(pair for face in faces for pair in pairwise((*face, face[0])))


def is_closed(faces: tuple[tuple[int, ...], ...]) -> bool:
    """Whether each edge has two faces that run along it in opposite directions."""
    along = n_faces_along(faces)
    return all(n == 1 and along[(b, a)] == 1 for (a, b), n in list(along.items()))


def test_solid_of_a_quad__is_a_box() -> None:
    solid = to_solid(QUAD, 0.5)
    assert len(solid.vertices) == 8 and [len(face) for face in solid.faces] == [4] * 6
    np.testing.assert_array_equal(solid.vertices.min(axis=0), (0.25, 0.5, -0.5))
    np.testing.assert_array_equal(solid.vertices.max(axis=0), (0.75, 0.875, 0.0))
    assert is_closed(solid.faces) and volume(solid) == pytest.approx(0.5 * 0.375 * 0.5)


def test_solid__keeps_an_n_gon_in_front_and_its_mirror_image_behind() -> None:
    outline = [(0.1, 0.1), (0.4, 0.1), (0.4, 0.5), (0.9, 0.5), (0.9, 0.9), (0.1, 0.9)]
    solid = to_solid(PolyMesh.from_faces(outline, [range(6)]), 0.25)
    assert [len(face) for face in solid.faces] == [6, 6, 4, 4, 4, 4, 4, 4]
    assert solid.faces[0] == (0, 5, 4, 3, 2, 1) and solid.faces[1] == (6, 7, 8, 9, 10, 11)


def test_solid_with_a_hole__has_walls_inside_it() -> None:
    solid = to_solid(RING, 0.1)
    assert len(solid.faces) == 8 + 8 + 12 + 4
    assert is_closed(solid.faces) and volume(solid) == pytest.approx(0.64 * 8 / 9 * 0.1)


@pytest.mark.parametrize("mesh", [hourglass(), DIAGONAL], ids=["hourglass", "diagonal"])
def test_solid_with_a_pinch__has_a_vertex_for_either_side(mesh: PolyMesh) -> None:
    solid = to_solid(mesh, 0.2)
    assert len(solid.vertices) == 2 * (len(mesh.vertices) + 1)
    assert is_closed(solid.faces) and volume(solid) == pytest.approx(0.2 * mesh.face_areas().sum(), rel=1e-5)
    front = solid.vertices[: len(mesh.vertices) + 1, :2]
    gaps = np.linalg.norm(front[:, None] - front, axis=2) + np.eye(len(front))
    assert 0.5 * APART < gaps.min() < 2.1 * APART  # drawn apart, by no more than a printer's step


@pytest.mark.slow
@given(meshes(), st.floats(0.01, 2.0))
def test_solid__is_closed_and_has_the_volume_area_times_depth(mesh: PolyMesh, depth: float) -> None:
    solid = to_solid(mesh, depth)
    assert is_closed(solid.faces)
    slack = APART * depth * np.abs(mesh.vertices[mesh.edges[:, 0]] - mesh.vertices[mesh.edges[:, 1]]).sum()
    assert volume(solid) == pytest.approx(depth * mesh.face_areas().sum(), abs=1e-9 + 2.0 * slack)


@pytest.mark.slow
@given(meshes(), st.sampled_from((0.0, 0.25)))
def test_triangles_of_a_solid__keep_its_edges(mesh: PolyMesh, depth: float) -> None:
    solid = to_solid(mesh, depth)
    triangles = to_triangles(solid)
    whole, cut = n_faces_along(solid.faces), n_faces_along(tuple(map(tuple, triangles.tolist())))
    assert len(triangles) == sum(len(face) - 2 for face in solid.faces)
    assert whole - cut == Counter(), "an edge of the solid has no triangle"
    assert all((cut - whole)[(b, a)] == n for (a, b), n in (cut - whole).items()), "a cut has one side only"


def test_solid__is_watertight_for_trimesh() -> None:
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed (pip install trimesh)")
    for mesh in (QUAD, RING, hourglass(), DIAGONAL, polygon(star(3, 17))):
        solid = to_solid(mesh, 0.3)
        for process in (False, True):  # True merges vertices that lie in one place
            body = trimesh.Trimesh(solid.vertices, to_triangles(solid), process=process)
            assert body.is_watertight and body.is_winding_consistent
            assert body.volume == pytest.approx(0.3 * mesh.face_areas().sum(), rel=1e-5)


def test_vertices_in_one_place__are_drawn_apart() -> None:
    near = polygon([(0.1, 0.1), (0.9, 0.1), (0.5, 0.5), (0.9, 0.9), (0.1, 0.9), (0.5 - 2e-13, 0.5)])
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed (pip install trimesh)")
    solid = to_solid(near, 0.25)
    body = trimesh.Trimesh(solid.vertices, to_triangles(solid), process=True)
    assert body.is_watertight and body.volume == pytest.approx(0.25 * near.face_areas().sum(), rel=1e-5)


def test_solid_of_no_depth__is_the_flat_mesh() -> None:
    solid = to_solid(hourglass(), 0.0)
    assert len(solid.vertices) == 7 and solid.faces == ((0, 3, 2, 1), (2, 6, 5, 4))
    assert not solid.vertices[:, 2].any()


@pytest.mark.parametrize("depth", [-0.1, float("nan"), float("inf"), 1e7])
def test_solid__refuses_a_depth_that_is_none(depth: float) -> None:
    with pytest.raises(ConfigError, match=r"depth .*: expected 0 \(flat\) or more"):
        to_solid(QUAD, depth)


def test_solid_obj__lists_quads() -> None:
    lines = to_solid_obj(QUAD, 0.5).splitlines()
    assert lines[0] == "# AutoPoly: solid of depth 0.5, 8 vertices, 6 faces"
    assert lines[1] == "v 0.25 0.875 0.0" and lines[5] == "v 0.25 0.875 -0.5"
    assert lines[9:] == ["f 1 4 3 2", "f 5 6 7 8", "f 1 2 6 5", "f 2 3 7 6", "f 3 4 8 7", "f 4 1 5 8"]


ELL = [(0.1, 0.1), (0.4, 0.1), (0.4, 0.5), (0.9, 0.5), (0.9, 0.9), (0.1, 0.9)]
ARROW = [(0.5, 0.1), (0.9, 0.9), (0.5, 0.6), (0.1, 0.9)]  # four corners, one of them reflex


@pytest.mark.parametrize(("outline", "n_quads"), [(ELL, 6), (ARROW, 4)])
def test_solid_obj__has_triangles_where_quads_do_not_do(outline: list[tuple[float, float]], n_quads: int) -> None:
    def sides(text: str) -> Counter[int]:
        return Counter(len(line.split()) - 1 for line in text.splitlines() if line.startswith("f "))

    mesh, n_cut = polygon(outline), 2 * (len(outline) - 2)
    assert sides(to_solid_obj(mesh, 0.5)) == {4: n_quads, 3: n_cut}
    assert sides(to_solid_obj(mesh, 0.5, triangles=True)) == {3: n_cut + 2 * n_quads}


def test_concave__is_a_face_with_a_corner_that_turns_back() -> None:
    square = [(0, 0), (1, 0), (1, 1), (0, 1)]
    straight = [(0, 0), (0.3, 0), (1, 0), (1, 1), (0, 1)]
    assert not any(is_concave(ring[::way]) for ring in (square, straight) for way in (1, -1))
    assert all(is_concave(ring[::way]) for ring in (ELL, ARROW) for way in (1, -1))


# --- triangles ---


def area(ring: np.ndarray) -> float:
    x, y = np.asarray(ring, np.float64).T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


@given(st.integers(0, 10_000), st.integers(4, 40), st.booleans())
def test_triangles_of_a_simple_ring__do_not_overlap(seed: int, n: int, is_reversed: bool) -> None:
    ring = star(seed, n)[:: -1 if is_reversed else 1]
    areas = [area(ring[list(corners)]) for corners in triangulate(ring.tolist())]
    assert len(areas) == n - 2 and sum(areas) == pytest.approx(area(ring))
    assert all((piece < 1e-12) if is_reversed else (piece > -1e-12) for piece in areas)


def test_triangles__pass_a_corner_that_touches_the_ring_elsewhere() -> None:
    ring = [(0, 0), (4, 0), (4, 4), (2, 2), (3, 1), (2, 2), (0, 4)]  # a slit from the notch at (2, 2)
    areas = [area(np.array([ring[k] for k in corners])) for corners in triangulate(ring)]
    assert sum(areas) == pytest.approx(area(np.array(ring))) and min(areas) >= 0.0


@given(st.lists(st.tuples(st.floats(0, 1), st.floats(0, 1)), min_size=3, max_size=12))
def test_triangles_of_any_ring__add_up_to_its_area(ring: list[tuple[float, float]]) -> None:
    triangles = triangulate(ring)
    assert len(triangles) == len(ring) - 2
    assert sum(area(np.array([ring[k] for k in corners])) for corners in triangles) == pytest.approx(
        area(np.array(ring)), abs=1e-9
    )
