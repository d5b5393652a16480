"""The search as a whole: the tree worked out by hand, and each option."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from agents.budget import Budget, Meter
from agents.registry import make_agent
from agents.search.backup import back_up
from agents.search.config import MctsConfig
from agents.search.evaluator import ResidualEvaluator, UniformEvaluator
from agents.search.mcts import MctsAgent
from agents.search.search import Search
from agents.search.tree import Node, ValueRange
from agents.solution import Track
from autopoly_env.operators import Action
from autopoly_env.simulator import Simulator, State
from tests.helpers.searches import Game, grown, name_of, played, search, tree_of, visits
from tests.helpers.solving import simulator

# --- golden tree ---

#            r 10
#       c 5       a 20      b 15
#       f 90      d 12      e 30
VALLEY = {"r": 10.0, "a": 20.0, "b": 15.0, "c": 5.0, "d": 12.0, "e": 30.0, "f": 90.0}
VALLEY_CHILDREN = {"r": "cab", "a": "d", "b": "e", "c": "f"}


def test_search__grows_the_tree_worked_out_by_hand() -> None:
    # c, a, b in the order of their priors. Then by the mean alone: a (20) makes d, and is worth (20 + 12) / 2 = 16;
    # a again, whose only child d has nothing below it and counts 12 once more: 44 / 3 = 14.67; then b (15) makes e.
    tree = grown(Game(VALLEY, VALLEY_CHILDREN), n_simulations=6, exploration=0.0)
    assert tree_of(tree.root) == (
        "r",
        7,
        10.0 + 5.0 + 20.0 + 15.0 + 12.0 + 12.0 + 30.0,
        [("c", 1, 5.0, []), ("a", 3, 44.0, [("d", 2, 24.0, [])]), ("b", 2, 45.0, [("e", 1, 30.0, [])])],
    )
    assert {action.operator: share for action, share in tree.policy().items()} == {"c": 1 / 6, "a": 3 / 6, "b": 2 / 6}
    chosen = tree.committed()
    assert chosen is not None and name_of(chosen.track.state) == "b"


def test_search__finds_what_lies_behind_a_valley_in_time() -> None:
    assert played(Game(VALLEY, VALLEY_CHILDREN), n_simulations=30, exploration=1.0) == "aef"
    assert played(Game(VALLEY, VALLEY_CHILDREN), n_simulations=6, exploration=0.0) == "ae"


# --- options ---


@pytest.mark.parametrize(("n_expanded", "made"), [(1, "c"), (2, "ca"), (3, "cab"), (9, "cab")])
def test_n_expanded__is_how_many_children_a_simulation_makes(n_expanded: int, made: str) -> None:
    game = Game(VALLEY, VALLEY_CHILDREN)
    grown(game, n_expanded=n_expanded, n_simulations=1)
    assert game.expanded == made


@pytest.mark.parametrize(("widening", "n_children"), [(0.0, 1), (0.5, 2), (1.0, 4)])
def test_widening__is_how_many_children_so_many_visits_earn(widening: float, n_children: int) -> None:
    # 4 simulations with 1, 2, 3, 4 visits before: one child more where visits ** widening exceeds their number
    game = Game(dict.fromkeys("rabcdefgh", 1.0), {"r": "abcd", "a": "e", "b": "f", "e": "g", "g": "h"})
    assert len(grown(game, widening=widening, n_simulations=4).root.children) == n_children


CHAIN = ({"r": 10.0, "a": 20.0, "b": 60.0, "c": 40.0}, {"r": "a", "a": "b", "b": "c"})


@pytest.mark.parametrize(
    ("n_rollout", "value", "discount", "worth"),
    [
        (0, "final", 1.0, 20.0),
        (1, "final", 1.0, 60.0),
        (2, "final", 1.0, 40.0),
        (9, "final", 1.0, 40.0),
        (2, "best", 1.0, 60.0),
        (2, "discounted", 1.0, 120.0),
        (2, "discounted", 0.5, 20.0 + 30.0 + 10.0),
    ],
)
def test_n_rollout_and_value__are_what_a_new_child_is_worth(
    n_rollout: int, value: str, discount: float, worth: float
) -> None:
    tree = grown(Game(*CHAIN), n_simulations=1, n_rollout=n_rollout, value=value, discount=discount)
    assert tree_of(tree.root) == ("r", 2, 10.0 + discount * worth, [("a", 1, worth, [])])


def test_n_rollout__yields_what_it_comes_across() -> None:
    assert played(Game(*CHAIN), n_simulations=1, n_rollout=2, patience=1) == "ab"
    assert played(Game(*CHAIN), n_simulations=1, patience=1) == "ab"  # one commit a simulation
    assert played(Game(*CHAIN), Budget(refits=1), n_simulations=1) == "a"


def _uneven() -> Node:
    """Child a: values 90, 0, 0. Child b: values 60, 60."""
    game = Game({"r": 0.0, "a": 0.0, "b": 0.0}, {"r": "ab"})
    root = Node(Track(game.states["r"]))
    root.children = [Node(Track(game.states[name], root.track), root) for name in "ab"]
    for child, value in ((0, 90.0), (0, 0.0), (0, 0.0), (1, 60.0), (1, 60.0)):
        back_up(root.children[child], value, ValueRange())
    return root


@pytest.mark.parametrize(
    ("backup", "commit", "expected"),
    [("max", "value", "a"), ("mean", "value", "b"), ("max", "visits", "a"), ("mean", "visits", "a")],
)
def test_backup_and_commit__decide_which_child_is_taken(backup: str, commit: str, expected: str) -> None:
    chosen = search(Game({"r": 0.0}, {}), _uneven(), backup=backup, commit=commit).committed()
    assert chosen is not None and name_of(chosen.track.state) == expected


def test_backup__max_stays_with_the_best_that_was_seen() -> None:
    tree = grown(Game(VALLEY, VALLEY_CHILDREN), n_simulations=9, exploration=0.0, backup="max")
    assert visits(tree) == {"r": 10, "c": 1, "a": 7, "b": 1, "d": 6}


@pytest.mark.parametrize(("reuse", "made"), [(True, "abc"), (False, "abbcc")])
def test_reuse_tree__makes_no_child_twice(reuse: bool, made: str) -> None:
    game = Game({"r": 10.0, "a": 20.0, "b": 30.0, "c": 40.0}, {"r": "a", "a": "b", "b": "c"})
    assert played(game, n_simulations=2, reuse_tree=reuse, patience=1) == "abc"
    assert game.expanded == made


def test_reuse_tree__keeps_the_counts() -> None:
    tree = grown(Game(VALLEY, VALLEY_CHILDREN), n_simulations=6, exploration=0.0)
    kept = tree.committed()
    assert kept is not None
    kept.parent = None
    again = grown_from(Game(VALLEY, VALLEY_CHILDREN), kept, n_simulations=1)
    assert tree_of(again.root) == ("b", 3, 75.0, [("e", 2, 60.0, [])])


def grown_from(game: Game, root: Node, **options: Any) -> Search:
    tree = search(game, root, **options)
    for _ in tree.grow(Meter.unlimited()):
        pass
    return tree


@pytest.mark.parametrize(("merge", "names"), [(True, "rac"), (False, "rabc")])
def test_merge__keeps_one_of_two_ways_to_a_shape(merge: bool, names: str) -> None:
    game = Game({"r": 1.0, "a": 2.0, "b": 2.0, "c": 3.0}, {"r": "abc"}, twins="ab")
    meter = Meter(Budget())
    tree = search(game, n_expanded=3, n_simulations=1, merge=merge)
    found = list(tree.grow(meter))
    assert "".join(sorted(visits(tree))) == "".join(sorted(names)) and len(found) == len(names) - 1
    assert meter.stats().n_refits == 3  # those of twins were made, too


def test_merge__never_goes_back_to_where_it_came_from() -> None:
    game = Game({"r": 10.0, "a": 9.0, "b": 10.0, "c": 11.0}, {"r": "a", "a": "bc"}, twins="rb")
    assert played(game, n_simulations=1, n_expanded=2, patience=3) == "c"
    assert "b" not in visits(grown(game, n_simulations=4))
    assert "b" in visits(grown(game, n_simulations=4, merge=False))


@pytest.mark.parametrize(("patience", "best"), [(1, ""), (2, ""), (3, "cd"), (9, "cd")])
def test_patience__is_how_many_steps_in_a_row_may_fail(patience: int, best: str) -> None:
    path = Game({"r": 50.0, "a": 40.0, "b": 50.0, "c": 60.0, "d": 70.0}, {"r": "a", "a": "b", "b": "c", "c": "d"})
    assert played(path, n_simulations=1, patience=patience) == best


def test_search__stops_at_the_budget_and_where_nothing_can_be_done() -> None:
    assert played(Game(VALLEY, VALLEY_CHILDREN), Budget(refits=3), n_simulations=50, exploration=1.0) == "a"
    assert played(Game({"r": 1.0}, {})) == ""


@pytest.mark.slow
def test_prior__residual_begins_with_the_edge_to_blame() -> None:
    game = simulator("house", resolution=64)
    state = game.initial()
    actions = game.legal_actions(state)[1:]
    residual, uniform = (e.prior(game, state, actions) for e in (ResidualEvaluator(), UniformEvaluator()))
    assert residual.sum() == pytest.approx(1.0) and uniform.sum() == pytest.approx(1.0)
    assert np.ptp(uniform) == 0.0 and residual.min() > 0.0
    likeliest = game.transition(state, actions[int(residual.argmax())])
    assert likeliest.score.iou == 1.0  # the roof
    once = {"seeds": (), "n_simulations": 1, "n_expanded": 1, "patience": 1}
    assert make_agent("mcts", **once).solve(game).score.iou == 1.0


def test_evaluator__is_asked_for_priors_and_geometry() -> None:
    game, asked = simulator("house", resolution=64), []

    class Nosy(ResidualEvaluator):
        def expand(self, simulator: Simulator, state: State, actions: Sequence[Action]) -> list[State]:
            asked.extend(actions)
            return super().expand(simulator, state, actions)[:1]

    config = MctsConfig(seeds=(), n_simulations=1, n_expanded=3, patience=1)
    assert MctsAgent(config, evaluator=Nosy()).solve(game).score.iou == 1.0
    assert len(asked) == 3
