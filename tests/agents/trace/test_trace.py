"""The trace agent: outlines, sizes, and whole pictures."""

import numpy as np
import numpy.typing as npt
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from agents.budget import Budget, Meter
from agents.trace.agent import TraceAgent, TraceConfig, build_best, choose_sizes
from agents.trace.construct import construct
from agents.trace.outline import Outline
from agents.trace.reach import Reach
from agents.trace.rings import Ring, trace_rings
from agents.trace.simplify import Contour
from autopoly_env.mesh import PolyMesh, defects_of
from autopoly_env.score import ScoreWeights
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator
from tests.helpers.drawings import FRAME, HOUSE, ISLAND, SQUARE, TWO_SQUARES, noise, painted
from tests.helpers.rings import BOX, GAME, TRIANGLE, hole, random_rings, small

# --- outlines ---


@pytest.mark.parametrize("seed", range(6))
def test_outline__scores_like_the_mesh_that_is_built_of_it(seed: int) -> None:
    game = Simulator(noise(seed), resolution=48)
    outline = Outline(tuple(random_rings(seed)))
    target = game.silhouette.target(48)
    assert outline.score(target, game.weights) == construct(game, outline.rings)[-1].score


def test_outline__without_a_ring_has_not_the_holes_in_it_either() -> None:
    rings = [
        Ring(BOX, -1),
        Ring(small(BOX, 0.9, 0.9), -1),
        hole(small(BOX, 0.5, 0.5)),
        hole(small(BOX, 0.9, 0.9, 0.1), 1),
    ]
    outline = Outline(tuple(rings))
    assert [ring.parent for ring in outline.without_ring(1).rings] == [-1, 0]
    assert [ring.parent for ring in outline.without_ring(2).rings] == [-1, -1, 1]
    assert [ring.parent for ring in outline.without_ring(0).rings] == [-1, 0]


def test_sizes__shrink_as_vertices_grow_dear() -> None:
    rings = trace_rings(noise(1, 48))
    contours = [Contour(ring.points) for ring in rings]
    reach = Reach.of(Simulator(noise(1, 48), resolution=48))
    totals = []
    for price in (0.01, 0.1, 0.3, 1.0, 3.0):
        sizes = list(choose_sizes(rings, contours, ScoreWeights(w_sc=price), 0.5, reach))
        assert len(sizes) == len(rings)
        totals.append(sum(sizes))
    assert totals == sorted(totals, reverse=True) and totals[0] > 2 * totals[-1]


# --- the agent ---


def solved(game: Simulator) -> tuple[PolyMesh, float]:
    solution = TraceAgent(TraceConfig()).solve(game)
    for mesh in solution.sequence.meshes():
        assert defects_of(mesh) == (0, 0)
    return solution.mesh, solution.score.iou


@pytest.mark.parametrize(
    ("shape", "counts"),
    [
        (SQUARE, (4, 4, 1)),
        (HOUSE, (5, 5, 1)),
        (FRAME, (8, 10, 2)),
        (TWO_SQUARES, (8, 8, 2)),
        (ISLAND, (12, 14, 3)),
        (shapely.Polygon(TRIANGLE), (3, 3, 1)),
    ],
)
def test_trace__builds_simple_shapes_with_as_little_as_it_takes(
    shape: shapely.Geometry, counts: tuple[int, int, int]
) -> None:
    mesh, iou = solved(Simulator(painted(shape, 128), resolution=64))
    assert mesh.counts == counts and iou > 0.995


def test_trace__leaves_out_with_a_hole_what_stands_in_it() -> None:
    game = Simulator(painted(ISLAND), resolution=64, operators="paper")
    for outline in TraceAgent(TraceConfig()).outlines(game, Meter(Budget())):
        assert len(outline.rings) == 1
    assert solved(game)[0].counts == (4, 4, 1)


def test_trace__is_the_same_for_weights_all_ten_times_as_large() -> None:
    silhouette = noise(5, 48)
    light, heavy = (
        Simulator(silhouette, resolution=48, weights=ScoreWeights(100.0 * k, 0.3 * k, 5.0 * k)) for k in (1.0, 10.0)
    )
    assert solved(light)[0] == solved(heavy)[0]


def test_trace__falls_back_on_a_rectangle_where_no_outline_can_be_built() -> None:
    crossed = Outline((Ring(BOX[[0, 2, 1, 3]], -1),))
    assert build_best(GAME, [crossed], 3) == [GAME.initial()]
    assert build_best(GAME, [], 3) == [GAME.initial()]
    sane = Outline((Ring(BOX, -1),))
    assert build_best(GAME, [crossed, crossed, crossed, sane], 1)[-1].mesh.counts == (4, 4, 1)


def pixels(*rows_and_columns: tuple[int, int], size: int = 32) -> npt.NDArray[np.bool_]:
    mask = np.zeros((size, size), np.bool_)
    mask[tuple(np.transpose(rows_and_columns))] = True
    return mask


BLOCK = [(row, column) for row in range(3) for column in range(3)]
ODD_MASKS = {
    "one pixel": pixels((7, 9)),
    "one pixel in a corner": pixels((0, 0)),
    "one pixel in all": pixels((0, 0), size=1),
    "a tiny block": pixels(*((r + 12, c + 12) for r, c in BLOCK)),
    "a tiny block in a corner": pixels(*BLOCK),
    "a tiny ring": pixels(*((r + 12, c + 12) for r, c in BLOCK if (r, c) != (1, 1))),
    "a row": pixels(*((5, column) for column in range(32))),
    "a column at the border": pixels(*((row, 31) for row in range(32))),
    "a diagonal": np.eye(32, dtype=np.bool_),
    "a chessboard": np.indices((16, 16)).sum(axis=0) % 2 == 0,
    "everything": np.ones((32, 32), np.bool_),
    "everything but a pixel": ~pixels((9, 9)),
    "everything but a corner": ~pixels((0, 0)),
    "a frame along the border": ~np.pad(np.ones((28, 28), np.bool_), 2),
    "a comb": np.indices((32, 32))[1] * (np.indices((32, 32))[0] > 3) % 3 == 0,
    "a line lost in a large image": pixels(*((700, column) for column in range(100, 900)), size=1024),
}


@pytest.mark.slow
@pytest.mark.parametrize("operators", ["full", "paper"])
@pytest.mark.parametrize("mask", ODD_MASKS.values(), ids=ODD_MASKS)
def test_trace__builds_something_sane_of_odd_pictures(mask: npt.NDArray[np.bool_], operators: str) -> None:
    solved(Simulator(Silhouette(mask), resolution=32, operators=operators))


@pytest.mark.slow
@given(
    st.integers(0, 999),
    st.integers(2, 72),
    st.sampled_from(("full", "paper", "edge_subdivide", "face_hole", "edge_extrude,face_delete,vertex_dissolve")),
    st.sampled_from((0, 4, 100)),
)
@settings(max_examples=40)
def test_trace__builds_something_sane_of_any_blobs(seed: int, resolution: int, operators: str, max_steps: int) -> None:
    game = Simulator(noise(seed, resolution), resolution=32, operators=operators, max_steps=max_steps)
    solution = TraceAgent(TraceConfig(prices=(0.5, 2.0))).solve(game)
    assert len(solution.sequence.steps) <= max_steps
    assert all(defects_of(mesh) == (0, 0) for mesh in solution.sequence.meshes())
