"""Monte Carlo tree search: the four steps on trees drawn by hand, each option, and what the agents promise."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from agents.base import Agent, Decision
from agents.budget import Budget, Meter, Progress
from agents.registry import make_agent
from agents.search.backup import back_up
from agents.search.config import PAPER, MctsConfig
from agents.search.evaluator import ResidualEvaluator, UniformEvaluator
from agents.search.incumbents import SHARE, track_of
from agents.search.mcts import MctsAgent
from agents.search.search import Search
from agents.search.selection import best_half, halving_schedule, puct, uct
from agents.search.simulation import value_of
from agents.search.tree import Node, ValueRange
from agents.solution import Solution, Track
from autopoly_env.arrays import FloatArray
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import STOP, Action
from autopoly_env.score import Score
from autopoly_env.simulator import Simulator, State
from tests.agents_helpers import TARGETS, assert_consistent, interrupt_at, quick, simulator
from tests.drawings import SQUARE, painted


class Game:
    """A game drawn by hand: totals by name, children by name. `expanded` are the children made, in order."""

    def __init__(self, totals: dict[str, float], children: dict[str, str], twins: str = "") -> None:
        self.children = children
        self.states = {name: _state(twins[0] if name in twins else name, name, t) for name, t in totals.items()}
        self.expanded = ""

    def legal_actions(self, state: State) -> list[Action]:
        return [STOP, *(Action(child, 0) for child in self.children.get(name_of(state), ""))]

    def transition_all(self, state: State, actions: Sequence[Action]) -> list[State]:
        self.expanded += "".join(action.operator for action in actions)
        return [self.states[action.operator] for action in actions]


class InOrder(UniformEvaluator):
    """Thinks of actions as they are listed, the first the likeliest by a hair, and expands them uniformly."""

    def prior(self, simulator: Simulator, state: State, actions: Sequence[Action]) -> FloatArray:
        priors = 1.0 - 1e-9 * np.arange(len(actions))
        return priors / priors.sum()


def _state(shape: str, name: str, total: float) -> State:
    side = 1 / (1 + "rabcdefgh".index(shape))
    return State(PolyMesh.rectangle(0, 0, side, side), Score(total / 100, 9, 0, total), action=Action(name, 0))


def name_of(state: State) -> str:
    assert state.action is not None
    return state.action.operator


PLAIN: dict[str, Any] = {"seeds": (), "n_expanded": 1, "widening": 1.0, "formula": "uct", "backup": "mean"}


def search(game: Game, root: Node | None = None, **options: Any) -> Search:
    config = MctsConfig(**{**PLAIN, **options})
    rng = np.random.default_rng(0)
    return Search(game, InOrder(), config, rng, root or Node(Track(game.states["r"])))  # type: ignore[arg-type]


def grown(game: Game, **options: Any) -> Search:
    tree = search(game, **options)
    for _ in tree.grow(Meter.unlimited()):
        pass
    return tree


def tree_of(node: Node) -> Any:
    """(name, visits, value sum, children)."""
    return (name_of(node.track.state), node.n_visits, node.value_sum, [tree_of(child) for child in node.children])


def visits(tree: Search) -> dict[str, int]:
    return {name_of(node.track.state): node.n_visits for node in tree.root.walk()}


def played(game: Game, budget: Budget | None = None, **options: Any) -> str:
    """The nodes that were ever the best, in order, of a whole search."""
    agent = MctsAgent(MctsConfig(**{**PLAIN, **options}), evaluator=InOrder())
    found = agent._search(game, Track(game.states["r"]), Meter(budget or Budget()))  # type: ignore[arg-type]
    return "".join(name_of(track.state) for track in found)


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


# --- the agents ---


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("name", ["mcts", "mcts_paper"])
def test_solve__is_never_worse_than_the_rectangle_it_begins_with(name: str, target: str) -> None:
    for operators in ("full", "paper"):
        game = simulator(target, operators=operators)
        assert quick(name).solve(game).score.total >= game.final_score(game.initial().mesh).total


@pytest.mark.parametrize(("name", "options"), [("mcts", {"seeds": ()}), ("mcts", {}), ("mcts_paper", {})])
def test_solve__is_the_same_for_a_seed_at_a_budget(name: str, options: dict[str, Any]) -> None:
    game, budget = simulator("island"), Budget(refits=150)
    agent = make_agent(name, **options)
    once, again = agent.solve(game, budget), agent.solve(game, budget)
    anew = make_agent(name, **options).solve(simulator("island"), budget)
    assert once.sequence.to_json() == again.sequence.to_json() == anew.sequence.to_json()
    assert once.stats.n_refits == again.stats.n_refits == anew.stats.n_refits


def test_seed__changes_the_order_of_equals() -> None:
    agents = [make_agent("mcts_paper", seed=seed, n_simulations=5) for seed in range(4)]
    assert len({agent.solve(simulator("blobs"), Budget(refits=60)).sequence.to_json() for agent in agents}) > 1


@pytest.mark.parametrize("name", ["mcts", "mcts_paper"])
def test_budget__of_nothing_returns_the_rectangle(name: str) -> None:
    game = simulator("blobs")
    for budget, reason in ((Budget(refits=0), "refits"), (Budget(seconds=0.0), "seconds")):
        solution = make_agent(name).solve(game, budget)
        assert solution.stats.stopped_by == reason
        assert solution.mesh == game.polish(game.initial().mesh) and not solution.sequence.steps


@pytest.mark.parametrize("options", [{"seeds": ()}, {}])
def test_budget__is_overrun_by_one_step_at_most(options: dict[str, Any]) -> None:
    game = simulator("blobs")
    for refits in (1, 5, 30, 200):
        reports: list[Progress] = []
        solution = make_agent("mcts", **options).solve(game, Budget(refits=refits), reports.append)
        assert_consistent(solution, game)
        assert all(report.n_refits < refits for report in reports[:-1])
        assert solution.stats.stopped_by in ("refits", "finished")
        assert reports[-1].n_refits <= solution.stats.n_refits
        totals = [report.best_total for report in reports]
        assert totals == sorted(totals)


@pytest.mark.parametrize("call", [1, 2, 4, 12])
@pytest.mark.parametrize("options", [{"seeds": ()}, {"seeds": ("greedy",)}, {}])
def test_interrupt__returns_the_best_so_far(options: dict[str, Any], call: int) -> None:
    game = Simulator(TARGETS["blobs"], resolution=40)  # the resolution of the silhouette: scores can be compared
    reports: list[Progress] = []
    interrupt = interrupt_at(call)

    def report(progress: Progress) -> None:
        reports.append(progress)
        interrupt(progress)

    solution = make_agent("mcts", **options).solve(game, on_progress=report)
    assert len(reports) == call
    assert solution.stats.stopped_by == "interrupted"
    assert_consistent(solution, game)
    if "climb" not in options.get("seeds", ("climb",)):
        assert solution.score.total >= reports[-1].best_total


def test_act__takes_what_leads_on_and_stops_where_nothing_is_better() -> None:
    game, agent = simulator("house", resolution=64), make_agent("mcts")
    state = game.initial()
    decision = agent.act(game, state)
    roof = game.transition(state, decision.action)
    assert decision == agent.act(game, state)
    assert sum(decision.policy.values()) == pytest.approx(1.0) and decision.action in decision.policy
    assert roof.done == "matched" and roof.score.total == decision.value
    assert agent.act(game, roof).action == STOP
    square = Simulator(game.silhouette, resolution=64, match_threshold=0.5)
    assert agent.act(square, square.initial()).action == STOP


# --- incumbents ---


@pytest.mark.parametrize("target", TARGETS)
def test_seeds__are_never_lost(target: str) -> None:
    game = simulator(target)
    incumbents = [make_agent(name).solve(game) for name in ("trace", "greedy")]
    agent = make_agent("mcts", seeds=("trace", "greedy"), n_simulations=2, patience=1, hop_patience=0)
    solution = agent.solve(game, Budget(refits=5000))
    assert_consistent(solution, game)
    assert solution.score.total >= max(incumbent.score.total for incumbent in incumbents)


def test_seeds__do_not_keep_the_search_from_the_rectangle() -> None:
    game = simulator("blobs")
    pure, both = (make_agent("mcts", seeds=seeds, hop_patience=0).solve(game) for seeds in ((), ("trace",)))
    assert both.score.total >= pure.score.total
    assert both.stats.n_refits >= pure.stats.n_refits + make_agent("trace").solve(game).stats.n_refits


def test_seeds__get_a_share_of_what_is_left_of_the_budget() -> None:
    game, asked = simulator("blobs"), []

    class Spy(Agent):
        def act(self, simulator: Simulator, state: State) -> Decision:
            return Decision(STOP)

        def solve(self, simulator: Simulator, budget: Budget | None = None, on_progress: Any = None) -> Solution:
            asked.append(budget)
            return make_agent("trace").solve(simulator, budget, on_progress)

    n_initial = 2
    n_traced = make_agent("trace").solve(game, Budget(refits=59)).stats.n_refits
    MctsAgent(MctsConfig(), [Spy(), Spy()]).solve(game, Budget(refits=100))
    rest = 100 - n_initial
    assert asked == [Budget(refits=round(SHARE * rest)), Budget(refits=round(SHARE * (rest - n_traced)))]


def test_target__that_the_rectangle_matches_already_ends_the_search_at_once() -> None:
    game = Simulator(painted(SQUARE), resolution=64)
    solution = make_agent("mcts").solve(game, Budget(refits=1000))
    assert solution.score.iou == 1.0 and not solution.sequence.steps
    assert solution.stats.n_refits <= 2 and solution.stats.stopped_by == "finished"


def test_seeds__that_cannot_take_guidance_are_left_out() -> None:
    game = simulator("house", symmetry=0.5)
    solution = make_agent("mcts", seeds=("climb", "decimate")).solve(game, Budget(refits=60))
    assert_consistent(solution, game)


def test_hop_patience__finds_what_the_tree_does_not() -> None:
    game = simulator("blobs")
    alone, hopping = (
        make_agent("mcts", seeds=("trace",), hop_patience=n).solve(game, Budget(refits=600)) for n in (0, 1000)
    )
    assert hopping.score.total > alone.score.total


def test_max_steps__is_kept_by_hops() -> None:
    game = simulator("blobs", operators="paper", max_steps=1)  # where an extrusion is best, and its outline two steps
    assert_consistent(quick("mcts").solve(game), game)


def test_n_refits__limits_a_search_without_a_budget() -> None:
    game = simulator("blobs")
    solution = make_agent("mcts", n_refits=100).solve(game)
    assert 100 <= solution.stats.n_refits < 150 and solution.stats.stopped_by == "refits"


def test_simulations__limit_a_search() -> None:
    game, seen = simulator("blobs"), []
    solution = make_agent("mcts", seeds=()).solve(game, Budget(simulations=3), seen.append)
    assert solution.stats.stopped_by == "simulations"
    assert 3 <= seen[-1].n_nodes <= 3 * MctsConfig().n_expanded


@pytest.mark.parametrize("target", TARGETS)
def test_track_of__goes_through_the_states_of_a_sequence(target: str) -> None:
    game = simulator(target)
    sequence = make_agent("trace").solve(game).sequence
    states = track_of(game, sequence).states()
    assert [state.mesh for state in states] == sequence.meshes()
    assert [state.step for state in states] == list(range(len(states)))
    assert [state.score for state in states] == [game.score(mesh) for mesh in sequence.meshes()]
    for before, after in pairwise(states):
        assert after.action in game.legal_actions(State(before.mesh, before.score))
    limited = Simulator(game.silhouette, resolution=32, max_steps=len(sequence.steps))
    assert track_of(limited, sequence).state.done in ("max_steps", "matched")


# --- settings ---


def test_paper__is_the_papers_search() -> None:
    assert (PAPER.seeds, PAPER.prior, PAPER.formula, PAPER.n_expanded, PAPER.n_rollout) == ((), "uniform", "uct", 1, 3)
    assert (PAPER.backup, PAPER.value, PAPER.commit, PAPER.merge, PAPER.reuse_tree) == (
        "mean", "final", "value", False, False
    )  # fmt: skip


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"n_simulations": 0}, "n_simulations = 0: expected at least 1"),
        ({"n_expanded": 0}, "n_expanded = 0: expected at least 1"),
        ({"patience": 0}, "patience = 0: expected at least 1"),
        ({"n_rollout": -1}, "n_rollout = -1: expected at least 0"),
        ({"exploration": float("nan")}, "exploration = nan: expected at least 0"),
        ({"seed": -1}, "seed = -1: expected at least 0"),
        ({"widening": 1.5}, "widening = 1.5: expected an exponent, 0 to 1"),
        ({"discount": 0.0}, "discount = 0.0: expected above 0, at most 1"),
        ({"prior": "learned"}, "agent 'mcts', option prior: .* got 'learned'"),
        ({"seeds": ("clim",)}, "agent 'clim' is unknown"),
    ],
)
def test_config__says_in_one_line_what_is_wrong(options: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ConfigError, match=complaint) as caught:
        make_agent("mcts", **options)
    assert "\n" not in str(caught.value)
