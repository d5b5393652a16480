"""Outlines cut into convex quads and triangles: the whole area, as few faces as there can be, holes and all."""

from functools import cache
from itertools import combinations, pairwise

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from agents.quads.hill import complexity_of
from agents.quads.partition import LEAST_SINE, MOST_BENT, Cuts, bent, least_faces, mesh_of, partitioned
from agents.trace.outline import Outline
from agents.trace.rings import Ring
from autopoly_env.arrays import FloatArray
from autopoly_env.mesh import PolyMesh, broken_faces, is_sane
from autopoly_env.mesh.corner_kernels import turn
from tests.helpers.rings import BOX, TRIANGLE, hole, random_rings, regular, small
from tests.helpers.shapes import star

L_SHAPE = np.array([(0.2, 0.2), (0.8, 0.2), (0.8, 0.45), (0.45, 0.45), (0.45, 0.8), (0.2, 0.8)])
TABLET = np.array([(0.1, 0.2), (0.9, 0.2), (0.9, 0.4), (0.6, 0.4), (0.6, 0.9), (0.4, 0.9), (0.4, 0.4), (0.1, 0.4)])


def outline(*rings: FloatArray | Ring) -> Outline:
    return Outline(tuple(ring if isinstance(ring, Ring) else Ring(ring, -1) for ring in rings))


def area_of(shape: Outline) -> shapely.Geometry:
    parts = [ring for ring in shape.rings if not ring.is_hole]
    holes = [ring.points for ring in shape.rings if ring.is_hole]
    whole = shapely.union_all([shapely.Polygon(ring.points) for ring in parts])
    return whole.difference(shapely.union_all([shapely.Polygon(points) for points in holes]))


def assert_cut(shape: Outline) -> PolyMesh:
    """The cut covers the outline, no face overlaps another, all are convex, and Euler's formula holds."""
    partition = partitioned(shape)
    assert partition is not None
    mesh = mesh_of(shape, partition)
    faces = [shapely.Polygon(mesh.vertices[list(face)]) for face in mesh.faces]
    assert shapely.union_all(faces).symmetric_difference(area_of(shape)).area < 1e-9
    assert sum(face.area for face in faces) == pytest.approx(area_of(shape).area, abs=1e-9)
    assert broken_faces(mesh, "quads") == [] and is_sane(mesh, "quads")
    assert mesh.complexity == complexity_of(shape, len(mesh.faces))
    assert len(mesh.faces) >= least_faces(shape)
    return mesh


def fewest_faces(points: FloatArray) -> float:
    """The least number of convex triangles and quads that a polygon can be cut into, by trying every face in turn."""
    polygon = shapely.Polygon(points)

    def is_face(corners: tuple[int, ...]) -> bool:
        n = len(corners)
        turns = [turn(points, corners[k], corners[(k + 1) % n], corners[(k + 2) % n]) for k in range(n)]
        return min(turns) >= LEAST_SINE and polygon.buffer(1e-9).covers(shapely.Polygon(points[list(corners)]))

    @cache
    def fewest(ring: tuple[int, ...]) -> float:
        if len(ring) < 3:
            return 0
        first, last, between = ring[0], ring[-1], range(1, len(ring) - 1)
        best = float("inf")
        for size in (1, 2):
            for inner in combinations(between, size):
                if is_face((first, *(ring[k] for k in inner), last)):
                    bounds = [0, *inner, len(ring) - 1]
                    pieces = [ring[a : b + 1] for a, b in pairwise(bounds)]
                    best = min(best, 1 + sum(fewest(piece) for piece in pieces))
        return best

    return fewest(tuple(range(len(points))))


def test_known_shapes__have_as_few_faces_as_there_can_be() -> None:
    for points, sizes in (
        (TRIANGLE, [3]),
        (BOX, [4]),
        (L_SHAPE, [4, 4]),
        (regular(5), [3, 4]),
        (regular(8), [4, 4, 4]),
    ):
        assert sorted(len(face) for face in assert_cut(outline(points)).faces) == sizes


def test_frame__is_a_ring_of_quads() -> None:
    mesh = assert_cut(outline(BOX, hole(small(BOX, 0.5, 0.5, 0.5))))
    assert sorted(len(face) for face in mesh.faces) == [4, 4, 4, 4]
    assert (mesh.counts, mesh.topology.n_holes) == ((8, 12, 4), 1)


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(4, 8))
def test_polygon__has_the_fewest_faces_that_trying_all_finds(seed: int, n: int) -> None:
    points = star(seed, n)
    partition = partitioned(outline(points))
    fewest = fewest_faces(points)
    assert (np.inf if partition is None else len(partition.faces)) == fewest


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 2**32 - 1))
def test_rings__are_cut_with_their_holes(seed: int) -> None:
    shape = outline(*random_rings(seed))
    assume(partitioned(shape) is not None)  # a sliver may have no convex cut
    assert_cut(shape)


def test_straight_corners__are_bent_where_that_saves_faces() -> None:
    shape = outline(TABLET)
    strict, relaxed = Cuts(shape).best(), Cuts(shape).best(MOST_BENT)
    assert strict is not None and relaxed is not None
    assert len(relaxed.faces) == least_faces(shape) == 3 < len(strict.faces)
    mesh = bent(mesh_of(shape, relaxed))
    assert mesh is not None and broken_faces(mesh, "quads") == []
    assert np.abs(mesh.vertices - shape.loops.vertices).max() < 0.02


def test_what_cannot_be_bent__is_left() -> None:
    dart = PolyMesh.from_faces([(0.2, 0.2), (0.5, 0.45), (0.8, 0.2), (0.5, 0.9)], [(0, 1, 2, 3)])
    mesh = bent(dart)
    assert mesh is None or broken_faces(mesh, "quads") == []


def test_crossing_outline__has_no_cut() -> None:
    assert partitioned(outline(np.array([(0.2, 0.2), (0.8, 0.8), (0.8, 0.2), (0.2, 0.8)]))) is None
