"""From outlines to actions: vertices peeled off one by one, and put back as a construction."""

from collections.abc import Sequence

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from agents.trace.construct import UnbuildableError, construct
from agents.trace.outline import Outline, nested, outline_of_mesh
from agents.trace.peel_kernels import peel
from agents.trace.rings import Ring
from autopoly_env.arrays import FloatArray
from autopoly_env.mesh import PolyMesh
from autopoly_env.simulator import Simulator, State
from tests.helpers.drawings import SQUARE, painted
from tests.helpers.rings import (
    BOX,
    GAME,
    NO_WALLS,
    PAPER_GAME,
    TRIANGLE,
    assert_sane,
    hole,
    random_rings,
    regular,
    small,
)
from tests.helpers.shapes import star

# --- peeling ---


def stages(points: FloatArray, order: Sequence[int]) -> list[FloatArray]:
    """The polygon before and after every vertex that is dropped."""
    return [points[sorted({*range(len(points))} - {*order[:k]})] for k in range(len(order) + 1)]


@given(st.integers(0, 2**32 - 1), st.integers(5, 40), st.integers(3, 5))
def test_peel__keeps_a_polygon_simple_all_the_way(seed: int, n: int, n_keep: int) -> None:
    points = star(seed, n)
    order = peel(points, NO_WALLS, np.zeros(n, np.bool_), n_keep).tolist()
    assert len(order) == len(set(order)) == n - n_keep  # there is always an ear
    assert all(shapely.LinearRing(ring).is_simple for ring in stages(points, order))


def test_peel__drops_the_least_visible_first() -> None:
    points = np.array([(0.2, 0.2), (0.5, 0.21), (0.8, 0.2), (0.81, 0.5), (0.8, 0.8), (0.5, 0.9), (0.2, 0.8)])
    assert peel(points, NO_WALLS, np.zeros(7, np.bool_), 4).tolist() == [1, 3, 5]


def test_peel__leaves_locked_vertices() -> None:
    points = star(3, 12)
    locked = np.arange(12) % 2 == 0
    order = peel(points, NO_WALLS, locked, 4)
    assert (order % 2 == 1).all()
    assert all(shapely.LinearRing(ring).is_simple for ring in stages(points, order.tolist()))


@given(st.integers(0, 2**32 - 1), st.integers(5, 20))
def test_peel__never_touches_nor_swallows_a_wall(seed: int, n: int) -> None:
    points = star(seed, n)
    rim = shapely.LinearRing(points)
    starts = np.random.default_rng(seed).random((30, 2))
    walls = np.hstack((starts, starts + np.random.default_rng(seed + 1).normal(0.0, 0.03, (30, 2))))
    lines = shapely.linestrings(walls.reshape(-1, 2, 2))
    walls, lines = walls[~rim.intersects(lines)], lines[~rim.intersects(lines)]
    was_inside = shapely.Polygon(points).contains(lines)
    order = peel(points, walls, np.zeros(n, np.bool_), 4).tolist()
    for ring in stages(points, order):
        assert shapely.LinearRing(ring).is_simple
        assert not shapely.LinearRing(ring).intersects(lines).any()
        np.testing.assert_array_equal(shapely.Polygon(ring).contains(lines), was_inside)


def test_peel__may_go_past_a_wall_that_ends_in_a_vertex() -> None:
    """A bridge holds its vertex, but not the ones beside it."""
    points = regular(8)
    bridge = np.array([[*points[0], 0.99, 0.5]])
    locked = np.arange(8) == 0
    assert len(peel(points, bridge, locked, 4)) == 4


# --- construction ---


def cycles(rings: Sequence[FloatArray]) -> set[tuple[tuple[float, float], ...]]:
    """Rings as sets of cycles, wherever they begin."""
    found = set()
    for ring in rings:
        points = [(float(x), float(y)) for x, y in ring]
        first = points.index(min(points))
        found.add((*points[first:], *points[:first]))
    return found


def rings_of(mesh: PolyMesh) -> set[tuple[tuple[float, float], ...]]:
    return cycles([mesh.vertices[loop] for loop in mesh.topology.boundary_loops])


def assert_built(states: Sequence[State], rings: Sequence[Ring]) -> None:
    """The last state has exactly these rings, and costs what an outline of them says."""
    assert_sane(states)
    mesh, outline = states[-1].mesh, Outline(tuple(rings))
    assert rings_of(mesh) == cycles([ring.points for ring in rings])
    assert mesh.topology.n_holes == sum(ring.is_hole for ring in rings)
    assert mesh.complexity == outline.complexity
    assert len(states) - 1 == outline.n_steps
    read = outline_of_mesh(mesh)
    assert read is not None and cycles([r.points for r in read.rings]) == rings_of(mesh)


@pytest.mark.parametrize("seed", range(40))
def test_construct__builds_a_blob_with_holes_and_further_parts(seed: int) -> None:
    rings = random_rings(seed)
    assert_built(construct(GAME, rings), rings)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30)
def test_construct__builds_any_star(seed: int) -> None:
    rings = [Ring(star(seed, 4 + seed % 30), -1)]
    assert_built(construct(GAME, rings), rings)
    assert_built(construct(PAPER_GAME, rings), rings)


def test_construct__builds_an_island_in_a_hole_in_an_island() -> None:
    rings = [Ring(small(BOX, 0.5, 0.5, s), -1) for s in (1.4, 0.8, 0.3)]
    rings += [hole(small(BOX, 0.5, 0.5, 1.1), 0), hole(small(BOX, 0.5, 0.5, 0.5), 1)]
    assert_built(construct(GAME, rings), rings)


def test_construct__ties_a_hole_past_the_holes_that_are_still_to_come() -> None:
    later = [hole(small(BOX, 0.5 + x, 0.5 + y, 0.1)) for x in (-0.2, 0.2) for y in (-0.2, 0.2)]  # before the corners
    rings = [Ring(BOX, -1), hole(small(BOX, 0.5, 0.5, 0.25)), *later]
    assert_built(construct(GAME, rings), rings)


def test_construct__builds_a_part_that_holds_a_corner_of_another() -> None:
    notched = np.array([(0.82, 0.7), (1.0, 0.7), (1.0, 1.0), (0.7, 1.0), (0.7, 0.82), (0.82, 0.82)])
    rings = [Ring(BOX, -1), Ring(notched, -1)]  # its quad must not have the corner of the box in it
    assert_built(construct(GAME, rings), rings)


def test_construct__grows_a_part_that_can_be_seen_where_it_will_be() -> None:
    left, right = small(BOX, 0.25, 0.5, 0.4), small(BOX, 0.75, 0.5, 0.4)
    *_, before, after = construct(GAME, [Ring(left, -1), Ring(right, -1)])
    assert after.action is not None and after.action.operator == "face_delete"
    assert {*map(tuple, right.tolist())} <= {*map(tuple, before.mesh.vertices.tolist())}


def test_construct__builds_triangles() -> None:
    assert_built(construct(GAME, [Ring(TRIANGLE, -1)]), [Ring(TRIANGLE, -1)])
    part, cut = Ring(small(TRIANGLE, 0.9, 0.9), -1), hole(small(TRIANGLE, 0.5, 0.5))
    assert_built(construct(GAME, [Ring(BOX, -1), part, cut]), [Ring(BOX, -1), part, cut])


def test_construct__makes_quads_of_triangles_where_no_vertex_can_be_dissolved() -> None:
    (state,) = construct(PAPER_GAME, [Ring(TRIANGLE, -1)])
    assert state.mesh.counts == (4, 4, 1)
    assert shapely.Polygon(state.mesh.vertices).symmetric_difference(shapely.Polygon(TRIANGLE)).area < 1e-12
    assert_built(construct(PAPER_GAME, [Ring(BOX, -1), Ring(small(TRIANGLE, 0.9, 0.9), -1)]), [Ring(BOX, -1)])


@pytest.mark.parametrize("seed", range(10))
def test_construct__leaves_holes_out_and_builds_parts_with_the_papers_operators(seed: int) -> None:
    rings = random_rings(seed)
    states = construct(PAPER_GAME, rings)
    assert {state.action.operator for state in states[1:] if state.action} <= set(PAPER_GAME.operators)
    assert_built(states, [ring for ring in rings if not ring.is_hole and (len(ring.points) > 3)])


def test_construct__builds_the_main_ring_only_where_it_can_only_subdivide() -> None:
    game = Simulator(painted(SQUARE), resolution=16, operators="edge_subdivide")
    rings = random_rings(7)
    assert len(rings) > 3
    assert_built(construct(game, rings), rings[:1])


@pytest.mark.parametrize(
    "bad",
    [
        hole(small(BOX, 0.2, 0.5)),  # across the outline
        hole(small(BOX, 0.95, 0.95, 0.05)),  # outside
        hole(small(BOX, 0.3, 0.5, 1 / 3)),  # touches the outline
        hole(BOX),  # all of it
        hole(small(BOX[[0, 2, 1, 3]], 0.5, 0.5)),  # crosses itself
        hole(small(BOX[::-1], 0.5, 0.5)),  # wound the wrong way
        Ring(small(BOX, 0.2, 0.5), -1),  # a part across the outline
        Ring(small(BOX[[0, 2, 1, 3]], 0.9, 0.9), -1),
        Ring(small(BOX[::-1], 0.9, 0.9), -1),
    ],
)
def test_construct__leaves_out_what_cannot_be_built(bad: Ring) -> None:
    good = hole(small(BOX, 0.65, 0.65, 0.1))
    assert_built(construct(GAME, [Ring(BOX, -1), bad, good]), [Ring(BOX, -1), good])


def test_construct__leaves_out_the_holes_of_a_part_that_is_left_out() -> None:
    rings = [Ring(BOX, -1), Ring(small(BOX, 0.2, 0.5), -1), hole(small(BOX, 0.2, 0.5, 0.1), 1)]
    assert_built(construct(GAME, rings), rings[:1])


@pytest.mark.parametrize("main", [BOX[[0, 2, 1, 3]], BOX[::-1], np.insert(BOX, 2, (0.1, 0.5), axis=0)[[0, 2, 1, 3, 4]]])
def test_construct__refuses_a_main_ring_that_is_not_sane(main: FloatArray) -> None:
    with pytest.raises(UnbuildableError):
        construct(GAME, [Ring(main, -1)])


def test_nested__finds_a_hole_in_the_part_around_it_and_not_in_its_island() -> None:
    def square(half: float) -> np.ndarray:
        return 0.5 + half * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])

    rings = [square(half) for half in (0.1, 0.4, 0.2)], [square(half)[::-1] for half in (0.3, 0.15)]
    loops = [loop for group in rings for loop in group]
    outline = nested(loops)
    assert outline is not None
    sizes = [round(float(np.ptp(ring.points)), 3) for ring in outline.rings]
    assert sizes == [0.8, 0.4, 0.2, 0.6, 0.3]
    assert [ring.parent for ring in outline.rings] == [-1, -1, -1, 0, 1]
