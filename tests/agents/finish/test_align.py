"""Regular shapes: what is nearly regular becomes exactly so, and nothing else moves, or for more than is allowed."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from agents.budget import Budget, Meter
from agents.finish import finish
from agents.finish.align import MOST_LOST, Regularity, aligned, regularities
from agents.registry import make_agent
from autopoly_env.mesh import PolyMesh
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator
from tests.helpers.drawings import HOUSE, SQUARE, painted

TABLE = shapely.box(0.125, 0.25, 0.875, 0.375) | shapely.box(0.125, 0.375, 0.25, 0.875)
TABLE = TABLE | shapely.box(0.75, 0.375, 0.875, 0.875)
CORNERS = np.array([(1, 2), (7, 2), (7, 3), (1, 3), (2, 3), (2, 7), (1, 7), (6, 3), (7, 7), (6, 7)], np.float64) / 8.0
FACES = [(0, 1, 2, 7, 4, 3), (3, 4, 5, 6), (7, 2, 8, 9)]


def table(jitter: float, seed: int = 0) -> PolyMesh:
    noise = np.random.default_rng(seed).uniform(-jitter, jitter, CORNERS.shape)
    return PolyMesh.from_faces(CORNERS + noise, FACES)


def test_table__stands_on_level_legs_of_equal_length() -> None:
    game = Simulator(painted(TABLE, 256))
    mesh = aligned(game, table(0.0005))
    (left, right), points = ((3, 4, 5, 6), (7, 2, 8, 9)), mesh.vertices
    assert len({points[v, 1] for v in (5, 6, 8, 9)}) == 1  # all four on the ground, to the last bit
    for a, b, c, d in (left, right):
        assert points[a, 1] == points[b, 1] and points[a, 0] == points[d, 0] and points[b, 0] == points[c, 0]
    assert points[0, 1] == points[1, 1]
    assert game.final_score(mesh).iou >= game.final_score(table(0.0005)).iou - MOST_LOST


def test_aligned__is_the_same_mesh_where_nothing_is_nearly_regular() -> None:
    slanted = PolyMesh.from_faces([(0.2, 0.3), (0.6, 0.1), (0.9, 0.8), (0.3, 0.7)], [(0, 1, 2, 3)])
    assert regularities(slanted) == []
    shape = shapely.Polygon(slanted.vertices)
    assert aligned(Simulator(painted(shape, 128)), slanted) == slanted


@given(st.integers(0, 50), st.sampled_from([0.001, 0.004, 0.01]))
def test_aligned__loses_next_to_nothing_and_stays_sane(seed: int, jitter: float) -> None:
    game, mesh = Simulator(painted(TABLE, 96)), table(jitter, seed)
    if not game.is_sane(mesh):
        return
    straight = aligned(game, mesh)
    assert game.final_score(straight).iou >= game.final_score(mesh).iou - MOST_LOST - 1e-12
    assert game.is_sane(straight) and straight.topology == mesh.topology
    assert np.abs(straight.vertices - mesh.vertices).max() < 0.03


def test_aligned__leaves_locked_vertices_where_they_are() -> None:
    start = table(0.002)
    game = Simulator(painted(TABLE, 256), start=start, locked=(0, 5))
    mesh = aligned(game, start)
    np.testing.assert_array_equal(mesh.vertices[[0, 5]], start.vertices[[0, 5]])
    assert (mesh.vertices != start.vertices).any()


def test_equal__has_the_derivatives_of_differences() -> None:
    points = np.array([(0.1, 0.2), (0.5, 0.25), (0.9, 0.7), (0.3, 0.6)])
    regularity = Regularity("equal", (0, 1, 3, 2), 0.0)
    _, slope = regularity.residual(points)
    for index in np.ndindex(points.shape):
        shift = np.zeros_like(points)
        shift[index] = 1e-6
        more, less = (regularity.residual(points + sign * shift)[0] for sign in (1.0, -1.0))
        assert slope[index] == pytest.approx((more - less) / 2e-6, abs=1e-6)


@pytest.mark.parametrize("kind", ["equal", "parallel"])
def test_edges__without_a_length_are_equal_and_parallel_to_nothing(kind: str) -> None:
    points = np.array([(0.0, 0.0), (0.5, 0.0), (0.2, 0.4), (0.2, 0.4)])
    assert not Regularity(kind, (0, 1, 2, 3), 0.0).has_sides(points)
    assert Regularity(kind, (0, 1, 1, 2), 0.0).has_sides(points)
    assert Regularity("x", (2, 3), 0.0).has_sides(points)


@pytest.mark.slow
@pytest.mark.filterwarnings("error")
def test_aligned__gives_up_where_an_edge_would_vanish() -> None:
    mask = np.zeros((32, 32), np.bool_)
    mask[6:26, 6:26] = True
    mask[12:20, 12:20] = False
    game = Simulator(Silhouette(mask), operators="modeller", faces="quads", symmetry="auto", align=True)
    assert make_agent("quads").solve(game, Budget(20)).score.iou > 0.999  # on the way are meshes with shorter edges


def test_parallel__is_zero_exactly_where_the_cross_product_is() -> None:
    points = np.array([(0.1, 0.2), (0.5, 0.3), (0.9, 0.7), (0.5, 0.6)])
    assert Regularity("parallel", (0, 1, 3, 2), 0.0).residual(points)[0] == pytest.approx(0.0, abs=1e-15)
    points[2] += (0.0, 0.1)
    assert abs(Regularity("parallel", (0, 1, 3, 2), 0.0).residual(points)[0]) > 0.05


def test_finish__aligns_where_it_is_asked_for() -> None:
    crooked = PolyMesh.from_faces([(0.25, 0.252), (0.748, 0.25), (0.752, 0.75), (0.25, 0.747)], [(0, 1, 2, 3)])
    free, straight = (Simulator(painted(SQUARE, 128), align=align) for align in (False, True))
    mesh = finish(straight, [straight.initial(crooked)], Meter.unlimited()).mesh
    assert mesh.vertices[0, 1] == mesh.vertices[1, 1] and mesh.vertices[1, 0] == mesh.vertices[2, 0]
    assert straight.settings()["align"] is True and "align" not in free.settings()


def test_house__keeps_its_symmetry() -> None:
    game = Simulator(painted(HOUSE, 128), symmetry=0.5)
    mesh = PolyMesh.from_faces(
        [(0.248, 0.5), (0.5, 0.2), (0.752, 0.5), (0.751, 0.851), (0.249, 0.851)], [(0, 1, 2, 3, 4)]
    )
    straight = aligned(game, mesh)
    assert straight.vertices[0, 0] == straight.vertices[4, 0] and straight.vertices[2, 0] == straight.vertices[3, 0]
    assert game.guidance.is_symmetric(straight)
