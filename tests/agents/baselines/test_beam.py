"""How beam search and greedy search go about it, on trees drawn by hand."""

import numpy as np
import pytest

from agents.base import Decision
from agents.budget import Budget
from agents.registry import make_agent
from autopoly_env.operators import STOP
from autopoly_env.score import ScoreWeights
from autopoly_env.sequence import Lesson
from autopoly_env.simulator import Simulator
from tests.helpers.drawings import BOTTLE, painted
from tests.helpers.solving import TARGETS, quick, simulator
from tests.helpers.tree import VALLEY, VALLEY_CHILDREN, Tree


@pytest.mark.parametrize("target", TARGETS)
def test_greedy__is_a_beam_of_width_one(target: str) -> None:
    game = simulator(target)
    greedy, beam = make_agent("greedy").solve(game), make_agent("beam", width=1).solve(game)
    assert greedy.sequence == beam.sequence and greedy.stats.n_refits == beam.stats.n_refits


@pytest.mark.slow
@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("name", ["greedy", "beam"])
def test_search__is_never_worse_than_the_rectangle_it_begins_with(name: str, target: str) -> None:
    game = simulator(target)
    assert quick(name).solve(game).score.total >= game.final_score(game.initial().mesh).total


@pytest.mark.parametrize(("target", "n_elements"), [("house", (5, 5, 1)), ("L", (6, 6, 1)), ("frame", (8, 10, 2))])
def test_beam__builds_simple_shapes_perfectly(target: str, n_elements: tuple[int, int, int]) -> None:
    solution = make_agent("beam").solve(Simulator(TARGETS[target], resolution=64))
    assert (solution.mesh.counts, solution.score.iou) == (n_elements, 1.0)


@pytest.mark.parametrize(
    ("width", "visited", "best"), [(1, "rad", "a"), (2, "rabed", "e"), (3, "rabcfed", "f"), (9, "rabcfed", "f")]
)
def test_beam__follows_as_many_shapes_as_it_is_wide(width: int, visited: str, best: str) -> None:
    assert Tree(VALLEY, VALLEY_CHILDREN).search(width=width) == (visited, best)


@pytest.mark.parametrize(("patience", "visited", "best"), [(1, "r", "r"), (2, "ra", "r"), (3, "rabcd", "d")])
def test_beam__goes_on_for_a_while_where_nothing_improves(patience: int, visited: str, best: str) -> None:
    path = Tree({"r": 50.0, "a": 40.0, "b": 50.0, "c": 60.0, "d": 70.0}, {"r": "a", "a": "b", "b": "c", "c": "d"})
    assert path.search(width=1, patience=patience) == (visited, best)


@pytest.mark.parametrize(("discount", "visited"), [(0.0, "rab"), (0.5, "racd")])
def test_beam__counts_complexity_less_while_it_is_stuck(discount: float, visited: str) -> None:
    totals = {"r": 50.0, "a": 49.0, "b": 40.0, "c": 39.0, "d": 38.0}
    tree = Tree(totals, {"r": "a", "a": "bc", "c": "d"}, rich="c")
    assert tree.search(width=1, patience=4, stuck_discount=discount) == (visited, "r")


def test_beam__follows_shapes_that_are_the_same_once() -> None:
    tree = Tree({"r": 10.0, "a": 20.0, "b": 20.0, "c": 15.0}, {"r": "abc"}, twins="ab")
    assert tree.search(width=2) == ("rac", "a")


def test_beam__looks_at_the_budget_between_shapes() -> None:
    assert Tree(VALLEY, VALLEY_CHILDREN).search(Budget(refits=5), width=3) == ("rab", "e")


def test_beam__stops_where_nothing_can_be_done() -> None:
    assert Tree({"r": 1.0}, {}).search() == ("r", "r")


def test_search_act__takes_the_best_child_and_stops_where_none_is_better() -> None:
    agent, game = make_agent("greedy"), simulator("house", resolution=64)
    state = game.initial()
    decision = agent.act(game, state)
    roof = game.transition(state, decision.action)
    assert decision.action.operator == "edge_subdivide" and roof.score.total == decision.value
    assert roof.done == "matched" and agent.act(game, roof) == Decision(STOP, value=roof.score.total)


def test_greedy__moves_less_under_the_weight_for_little() -> None:
    silhouette = painted(BOTTLE, 128)
    free, dear = (
        make_agent("greedy").solve(Simulator(silhouette, weights=ScoreWeights(w_locality=w)), Budget(300))
        for w in (0.0, 0.5)
    )
    assert Lesson.of(dear.sequence).moved <= 0.5 * Lesson.of(free.sequence).moved
    assert dear.score.total > free.score.total - 0.3
    assert dear.score.total == pytest.approx(100 * dear.score.iou - 0.3 * dear.score.complexity)  # nothing is off
    assert np.isfinite(dear.mesh.vertices).all()
