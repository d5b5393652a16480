"""Decimation: the way down is complete, limits are kept, and no trace is lost."""

from itertools import pairwise

import numpy as np
import pytest

from agents.budget import Budget, Meter, Progress
from agents.climb.decimate import DecimateAgent, DecimateConfig, _coarser, _spanned, n_vertices
from agents.climb.hill import Hill
from agents.registry import make_agent
from agents.trace.outline import Outline
from agents.trace.reach import Reach
from agents.trace.rings import Ring
from autopoly_env.errors import ConfigError
from autopoly_env.operators import STOP
from autopoly_env.score import ScoreWeights
from autopoly_env.simulator import Simulator
from tests.helpers.drawings import FRAME, HOUSE, L_SHAPE, SQUARE, painted
from tests.helpers.solving import assert_consistent, interrupt_at, simulator

BOX = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
DENTED = np.insert(BOX, 1, (0.5, 0.1), axis=0)  # a pentagon: the vertex in its top edge spans the least area
HOLE = 0.5 + 0.1 * np.array([(0.0, 1.0), (1.0, 0.0), (0.0, -1.0)])


def test_spanned__is_the_area_of_a_vertex_and_its_neighbours() -> None:
    assert _spanned(DENTED) == pytest.approx([0.25, 0.05, 0.25, 0.5, 0.5])
    assert _spanned(BOX).tolist() == [0.5] * 4


def test_coarser__takes_the_least_visible_vertices_and_whole_rings() -> None:
    reach = Reach(more_than_quads=True, holes=True, parts=True, triangles=False, n_steps=100)
    outline = Outline((Ring(DENTED, -1), Ring(HOLE, 0)))
    first, second, third = _coarser(outline, reach, 2)
    assert first.rings[0].points.tolist() == BOX.tolist()
    assert [len(o.rings) for o in (first, second, third)] == [2, 2, 1]
    assert [n_vertices(o) for o in _coarser(outline, reach, 9)] == [7] * 5 + [5]
    box = Outline((Ring(BOX, -1), Ring(HOLE, 0)))
    assert [n_vertices(o) for o in _coarser(box, reach, 9)] == [4]  # neither ring may have fewer vertices
    assert list(_coarser(Outline((Ring(BOX, -1),)), reach, 9)) == []
    triangles = reach._replace(triangles=True)
    assert [n_vertices(o) for o in _coarser(Outline((Ring(BOX, -1),)), triangles, 9)] == [3] * 4


@pytest.mark.parametrize(("operators", "least"), [("full", 3), ("paper", 4)])
def test_outlines__go_down_one_by_one_to_the_coarsest(operators: str, least: int) -> None:
    game = simulator("house", operators=operators)
    agent = DecimateAgent(DecimateConfig(prices=(0.2,)))
    counts = [n_vertices(place.outline) for place in agent.places(Hill(game), Meter.unlimited())]
    way_down = counts[counts.index(max(counts)) + 2 :]
    assert way_down[-1] == least
    assert all(later - earlier in (-1, 0) for earlier, later in pairwise(way_down))


@pytest.mark.parametrize(
    ("shape", "n_elements"), [(SQUARE, (4, 4, 1)), (HOUSE, (5, 5, 1)), (L_SHAPE, (6, 6, 1)), (FRAME, (8, 10, 2))]
)
def test_decimate__finds_simple_shapes_perfectly(shape: object, n_elements: tuple[int, int, int]) -> None:
    solution = make_agent("decimate").solve(Simulator(painted(shape), resolution=64))
    assert (solution.mesh.counts, round(solution.score.iou, 6)) == (n_elements, 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("w_sc", [0.1, 1.0])
@pytest.mark.parametrize("n", [4, 7, 12])
def test_max_vertices__is_kept_at_any_price(n: int, w_sc: float) -> None:
    game = simulator("blobs", weights=ScoreWeights(w_sc=w_sc))
    solution = make_agent("decimate", max_vertices=n).solve(game)
    assert_consistent(solution, game)
    assert len(solution.mesh.vertices) <= n


@pytest.mark.slow
def test_max_vertices__buys_more_where_vertices_are_cheap() -> None:
    game = simulator("blobs", weights=ScoreWeights(w_sc=0.1))
    totals = [make_agent("decimate", max_vertices=n).solve(game).score.total for n in (4, 8, None)]
    assert totals == sorted(totals) and totals[0] < totals[-1]


@pytest.mark.slow
def test_budget__is_overrun_by_one_step_at_most() -> None:
    game = simulator("blobs")
    for refits in (0, 1, 5, 30):
        reports: list[Progress] = []
        solution = make_agent("decimate").solve(game, Budget(refits=refits), reports.append)
        assert_consistent(solution, game)
        assert all(report.n_refits < refits for report in reports[:-1])
        assert solution.stats.stopped_by == "refits"
    assert make_agent("decimate").solve(game, Budget(refits=0)).mesh == game.polish(game.initial().mesh)


@pytest.mark.slow
@pytest.mark.parametrize("call", [1, 2, 4])
def test_interrupt__returns_the_best_so_far(call: int) -> None:
    game = simulator("blobs")
    solution = make_agent("decimate").solve(game, on_progress=interrupt_at(call))
    assert solution.stats.stopped_by == "interrupted"
    assert_consistent(solution, game)


def test_act__stops() -> None:
    game = simulator()
    assert make_agent("decimate").act(game, game.initial()).action == STOP


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"max_vertices": 3}, "max_vertices 3: expected at least 4"),
        ({"n_candidates": 0}, "n_candidates 0: expected at least 1"),
        ({"prices": (2.0, 1.0)}, "prices"),
    ],
)
def test_config__says_in_one_line_what_is_wrong(options: dict[str, object], complaint: str) -> None:
    with pytest.raises(ConfigError, match=complaint) as caught:
        make_agent("decimate", **options)
    assert "\n" not in str(caught.value)
