"""The parts of a tree search, by hand: backup, values, formulas, halving; and which arm of a bandit is visited."""

from typing import Any

import numpy as np
import pytest

from agents.search.backup import back_up
from agents.search.selection import best_half, halving_schedule, puct, uct
from agents.search.simulation import value_of
from agents.search.tree import Node, ValueRange
from agents.solution import Track
from tests.helpers.searches import Game, grown, name_of, visits

# --- the parts ---


def test_back_up__counts_at_the_node_and_at_all_above_it() -> None:
    game = Game({"r": 0.0, "a": 0.0, "b": 0.0}, {})
    root = Node(Track(game.states["r"]))
    middle = Node(Track(game.states["a"]), root)
    leaf, seen = Node(Track(game.states["b"]), middle), ValueRange()
    back_up(leaf, 8.0, seen, discount=0.5)
    back_up(middle, -2.0, seen, discount=0.5)
    counted = [(node.n_visits, node.value_sum, node.best_value) for node in (leaf, middle, root)]
    assert counted == [(1, 8.0, 8.0), (2, 2.0, 4.0), (2, 1.0, 2.0)]
    assert (seen.low, seen.high) == (-2.0, 8.0)


def test_value_range__brings_values_to_0_to_1() -> None:
    seen = ValueRange()
    seen.add(3.0)
    assert seen.normalised(np.array([3.0, 3.0])).tolist() == [0.5, 0.5]
    seen.add(7.0)
    assert seen.normalised(np.array([3.0, 4.0, 7.0])).tolist() == [0.0, 0.25, 1.0]


def test_node__unvisited_is_worth_what_its_parent_is() -> None:
    game = Game({"r": 4.0, "a": 0.0}, {})
    root = Node(Track(game.states["r"]))
    child, seen = Node(Track(game.states["a"]), root), ValueRange()
    assert child.value("mean") == child.value("max") == 4.0
    back_up(root, 4.0, seen)
    back_up(root, 8.0, seen)
    assert (child.value("mean"), child.value("max")) == (6.0, 8.0)


def test_formulas__match_values_computed_by_hand() -> None:
    values, n, priors = np.array([0.5, 0.2]), np.array([4.0, 1.0]), np.array([0.9, 0.1])
    # 0.5 + sqrt(ln 5 / 4), 0.2 + sqrt(ln 5);  0.5 + 0.9 sqrt(5) / 5, 0.2 + 0.1 sqrt(5) / 2
    assert uct(values, n, priors, 5, 1.0) == pytest.approx([1.134318, 1.468636], abs=1e-6)
    assert puct(values, n, priors, 5, 1.0) == pytest.approx([0.902492, 0.311803], abs=1e-6)
    assert uct(values, np.array([3.0, 0.0]), priors, 3, 1.0)[1] == np.inf


@pytest.mark.parametrize(
    ("kind", "discount", "value"), [("final", 0.5, 4.0), ("best", 0.5, 5.0), ("discounted", 0.5, 6.5)]
)
def test_value_of__a_roll_out(kind: str, discount: float, value: float) -> None:
    assert value_of([3.0, 5.0, 4.0], kind, discount) == value


@pytest.mark.parametrize(
    ("n_candidates", "n_simulations", "schedule"),
    [(4, 16, [2, 4]), (8, 24, [1, 2, 4]), (5, 30, [2, 3, 5]), (1, 7, [7]), (4, 1, [1, 1])],
)
def test_halving_schedule__shares_the_simulations_out(
    n_candidates: int, n_simulations: int, schedule: list[int]
) -> None:
    assert halving_schedule(n_candidates, n_simulations) == schedule


def test_best_half__keeps_the_first_of_equals_and_the_odd_one() -> None:
    game = Game(dict.fromkeys("rabc", 0.0), {})
    nodes = [Node(Track(game.states[name])) for name in "rabc"]
    for node, value in zip(nodes, (1.0, 3.0, 2.0, 2.0), strict=True):
        back_up(node, value, ValueRange())
    assert best_half(nodes, "mean") == [nodes[1], nodes[2]]
    assert best_half(nodes[:3], "max") == [nodes[1], nodes[2]]
    assert best_half(nodes[:1], "mean") == nodes[:1]


# --- tiny bandits: which arm each simulation goes to ---

TWO_ARMS = ({"r": 0.0, "a": 100.0, "b": 0.0}, {"r": "ab"})


def arms(n: int, **options: Any) -> str:
    """The arm that each of n simulations went to."""
    counts = [visits(grown(Game(*TWO_ARMS), n_simulations=k, **options)) for k in range(1, n + 1)]
    before = [{"a": 0, "b": 0}, *counts]
    return "".join(
        arm for old, new in zip(before, counts, strict=False) for arm in "ab" if new.get(arm, 0) > old.get(arm, 0)
    )


@pytest.mark.parametrize(
    ("formula", "exploration", "expected"),
    [
        ("uct", 0.0, "abaaaa"),
        ("uct", 2.0, "abaaba"),  # the fifth: 1 + 2 sqrt(ln 5 / 3) = 2.465 < 0 + 2 sqrt(ln 5 / 1) = 2.537
        ("puct", 2.0, "abaaaaab"),  # the eighth: 1 + 2/2 sqrt(8) / 7 = 1.404 < 2/2 sqrt(8) / 2 = 1.414
        ("puct", 0.0, "abaaaaaa"),
    ],
)
def test_formula_and_exploration__decide_who_is_visited(formula: str, exploration: float, expected: str) -> None:
    assert arms(len(expected), formula=formula, exploration=exploration) == expected


def test_halving__visits_the_better_half_more() -> None:
    game = Game({"r": 0.0, "a": 30.0, "b": 10.0, "c": 40.0, "d": 20.0}, {"r": "abcd"})
    tree = grown(game, halving=True, n_expanded=4, n_simulations=16)
    assert visits(tree) == {"r": 1 + 4 + 8 + 8, "a": 7, "b": 3, "c": 7, "d": 3}
    chosen = tree.committed()
    assert chosen is not None and name_of(chosen.track.state) == "c"
    assert max(visits(grown(game, n_expanded=4, n_simulations=16, exploration=0.0)).values()) == 1 + 4 + 15


def test_halving__of_nothing_is_nothing() -> None:
    tree = grown(Game({"r": 1.0}, {}), halving=True)
    assert tree.committed() is None and tree.policy() == {}
