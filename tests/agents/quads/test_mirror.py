"""Outlines made symmetric: which half they come of, known answers, and what the agent builds under symmetry."""

import numpy as np
import pytest
import shapely

from agents.budget import Budget
from agents.quads.mirror import symmetric_neighbours, symmetrised
from agents.registry import make_agent
from agents.trace.outline import Outline
from agents.trace.rings import Ring, signed_area
from autopoly_env.mesh import broken_faces, images_of
from autopoly_env.simulator import Simulator
from tests.helpers.drawings import BOTTLE, FRAME, HOUSE, TWO_SQUARES, painted


def outline(*rings: list[tuple[float, float]], parents: tuple[int, ...] = (-1,)) -> Outline:
    return Outline(tuple(Ring(np.array(ring), parent) for ring, parent in zip(rings, parents, strict=True)))


def shape_of(found: Outline | None) -> shapely.Geometry:
    assert found is not None
    shape = shapely.Polygon()
    for ring in found.rings:
        polygon = shapely.Polygon(ring.points)
        shape = shape - polygon if ring.is_hole else shape | polygon
    return shape


CROOKED = [(0.2, 0.5), (0.5, 0.2), (0.8, 0.45), (0.75, 0.8), (0.25, 0.85)]


def test_each_half__decides_alone() -> None:
    right, left = (symmetrised(outline(CROOKED), 0.5, side) for side in (1, -1))
    assert sorted(map(tuple, np.round(shape_of(right).exterior.coords[:-1], 9))) == [
        (0.2, 0.45), (0.25, 0.8), (0.5, 0.2), (0.75, 0.8), (0.8, 0.45),
    ]  # fmt: skip
    assert sorted(map(tuple, np.round(shape_of(left).exterior.coords[:-1], 9))) == [
        (0.2, 0.5), (0.25, 0.85), (0.5, 0.2), (0.75, 0.85), (0.8, 0.5),
    ]  # fmt: skip


def test_ring_around_the_axis__stays_one_with_its_hole() -> None:
    box = [(0.1, 0.1), (0.9, 0.1), (0.9, 0.9), (0.1, 0.9)]
    hole = [(0.3, 0.3), (0.3, 0.7), (0.6, 0.7), (0.6, 0.3)]
    found = symmetrised(outline(box, hole, parents=(-1, 0)), 0.5, 1)
    assert found is not None and [ring.parent for ring in found.rings] == [-1, 0]
    wanted = shapely.box(0.1, 0.1, 0.9, 0.9) - shapely.box(0.4, 0.3, 0.6, 0.7)
    assert shape_of(found).symmetric_difference(wanted).area < 1e-12


def test_a_part_on_one_side__comes_twice_or_goes() -> None:
    middle = [(0.4, 0.1), (0.6, 0.1), (0.6, 0.9), (0.4, 0.9)]
    beside = [(0.7, 0.2), (0.8, 0.2), (0.8, 0.3), (0.7, 0.3)]
    both = outline(middle, beside, parents=(-1, -1))
    assert shapely.get_num_geometries(shape_of(symmetrised(both, 0.5, 1))) == 3
    assert shape_of(symmetrised(both, 0.5, -1)).equals(shapely.box(0.4, 0.1, 0.6, 0.9))
    assert symmetrised(outline(beside), 0.5, -1) is None


def test_arch__has_a_chain_for_each_stretch_between_the_crossings() -> None:
    arch = [(0.1, 0.1), (0.9, 0.1), (0.9, 0.9), (0.7, 0.9), (0.7, 0.3), (0.3, 0.3), (0.3, 0.9), (0.1, 0.9)]
    found = symmetrised(outline(arch), 0.5, 1)
    assert found is not None and len(found.rings) == 1 and len(found.rings[0].points) == 8
    assert shape_of(found).symmetric_difference(shapely.Polygon(arch)).area < 1e-12
    assert signed_area(found.rings[0].points) == pytest.approx(signed_area(np.array(arch)))


def test_neighbours__are_those_of_the_right_half_once() -> None:
    before = outline([(0.2, 0.2), (0.8, 0.2), (0.8, 0.8), (0.2, 0.8)])
    right = outline([(0.2, 0.2), (0.8, 0.2), (0.9, 0.5), (0.8, 0.8), (0.2, 0.8)])
    left = outline([(0.2, 0.2), (0.8, 0.2), (0.8, 0.8), (0.2, 0.8), (0.1, 0.5)])
    [found] = symmetric_neighbours([right, left, right], before, 0.5)
    assert len(found.loops.vertices) == 6 and images_of(found.loops, 0.5) is not None


@pytest.mark.slow
@pytest.mark.parametrize("shape", [HOUSE, BOTTLE, FRAME, TWO_SQUARES])
def test_agent__builds_left_and_right_alike_under_the_rule(shape: shapely.Geometry) -> None:
    game = Simulator(painted(shape), resolution=64, operators="modeller", faces="quads", symmetry="auto")
    assert game.guidance.axis == 0.5
    solution = make_agent("quads").solve(game, Budget(120))
    assert images_of(solution.mesh, 0.5) is not None and broken_faces(solution.mesh, "quads") == []
    assert solution.score.iou > 0.93 and len(solution.sequence.steps) > 0
    assert solution.sequence.final() == solution.mesh


@pytest.mark.slow
def test_agent__meets_no_outline_that_lies_doubled_in_one_place() -> None:
    bars = painted(shapely.box(10 / 64, 0.125, 24 / 64, 0.875) | shapely.box(40 / 64, 0.125, 54 / 64, 0.875), 64)
    game = Simulator(bars, operators="modeller", faces="quads", symmetry=0.5)
    assert make_agent("quads").solve(game).score.total == pytest.approx(100.0 - 0.3 * 18)
