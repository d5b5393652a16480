"""What every agent promises, and how beam search goes about it, on trees drawn by hand."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from agents.base import Decision
from agents.baselines.random_agent import RandomAgent, RandomConfig
from agents.budget import Budget, Meter, Progress
from agents.finish import finish
from agents.registry import AGENTS, make_agent
from autopoly_env.errors import ConfigError
from autopoly_env.operators import OPERATORS, STOP, Action
from autopoly_env.simulator import Simulator, State
from tests.agents_helpers import (
    TARGETS,
    VALLEY,
    VALLEY_CHILDREN,
    Tree,
    assert_consistent,
    interrupt_at,
    quick,
    simulator,
)
from tests.drawings import SQUARE, noise, painted

NAMES = ("random", "greedy", "beam", "trace", "climb")


# --- every agent ---


@pytest.mark.parametrize("name", NAMES)
def test_solve__takes_a_square_for_what_it_is(name: str) -> None:
    solution = quick(name).solve(Simulator(painted(SQUARE), resolution=64))
    assert (solution.mesh.counts, solution.score.iou, len(solution.sequence.steps)) == ((4, 4, 1), 1.0, 0)
    assert solution.stats.stopped_by == "finished"


@pytest.mark.parametrize("name", NAMES)
def test_progress__never_goes_back(name: str) -> None:
    reports: list[Progress] = []
    solution = quick(name).solve(simulator("blobs"), on_progress=reports.append)
    assert reports[-1].n_refits <= solution.stats.n_refits  # the finish has no progress to report
    for earlier, later in pairwise(reports):
        assert later.best_total >= earlier.best_total
        assert (later.n_steps, later.n_refits) >= (earlier.n_steps + 1, earlier.n_refits)


@pytest.mark.parametrize("name", ["random", "greedy", "beam"])
def test_budget__of_nothing_returns_the_rectangle(name: str) -> None:
    game = simulator("blobs")
    for budget, reason in ((Budget(refits=0), "refits"), (Budget(seconds=0.0), "seconds")):
        solution = quick(name).solve(game, budget)
        assert solution.stats.stopped_by == reason
        assert solution.mesh == game.polish(game.initial().mesh) and not solution.sequence.steps


@pytest.mark.parametrize("name", NAMES)
def test_budget__is_overrun_by_one_step_at_most(name: str) -> None:
    game = simulator("blobs")
    for refits in (1, 5, 30):
        reports: list[Progress] = []
        solution = quick(name).solve(game, Budget(refits=refits), reports.append)
        assert_consistent(solution, game)
        assert all(report.n_refits < refits for report in reports[:-1])
        assert solution.stats.stopped_by in ("refits", "finished")
        assert solution.stats.stopped_by == "refits" or solution.stats.n_refits < refits


@pytest.mark.parametrize("budget", [{"refits": -1}, {"seconds": -0.5}, {"seconds": float("nan")}])
def test_budget__refuses_less_than_nothing(budget: dict[str, Any]) -> None:
    with pytest.raises(ConfigError, match="budget"):
        Budget(**budget)


@pytest.mark.parametrize("call", [1, 2, 4])
@pytest.mark.parametrize("name", NAMES)
def test_interrupt__returns_the_best_so_far(name: str, call: int) -> None:
    game = simulator("blobs")
    reports: list[Progress] = []
    interrupt = interrupt_at(call)

    def report(progress: Progress) -> None:
        reports.append(progress)
        interrupt(progress)

    solution = quick(name).solve(game, on_progress=report)
    assert len(reports) == call
    assert solution.stats.stopped_by == "interrupted"
    assert_consistent(solution, game)


@pytest.mark.parametrize("name", ["greedy", "beam"])
def test_interrupt__loses_nothing_that_was_reported(name: str) -> None:
    game = Simulator(TARGETS["blobs"], resolution=40)  # the resolution of the silhouette: scores can be compared
    reports: list[Progress] = []
    quick(name).solve(game, on_progress=reports.append)
    for call in range(1, len(reports) + 1, len(reports) // 6):
        solution = quick(name).solve(game, on_progress=interrupt_at(call))
        assert solution.score.total >= reports[call - 1].best_total


class Impatient(Simulator):
    """Somebody presses Ctrl-C while the second shape is being looked at."""

    n_calls = 0

    def transition_all(self, state: State, actions: Sequence[Action] | None = None) -> list[State]:
        self.n_calls += 1
        if self.n_calls == 2:
            raise KeyboardInterrupt
        return super().transition_all(state, actions)


@pytest.mark.parametrize("name", ["greedy", "beam"])
def test_interrupt__inside_a_step_returns_the_best_before_it(name: str) -> None:
    game = Impatient(TARGETS["frame"], resolution=32)
    solution = quick(name).solve(game)
    assert solution.stats.stopped_by == "interrupted" and len(solution.sequence.steps) == 1
    assert_consistent(solution, game)


# --- search ---


@pytest.mark.parametrize("target", TARGETS)
def test_greedy__is_a_beam_of_width_one(target: str) -> None:
    game = simulator(target)
    greedy, beam = make_agent("greedy").solve(game), make_agent("beam", width=1).solve(game)
    assert greedy.sequence == beam.sequence and greedy.stats.n_refits == beam.stats.n_refits


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


# --- random ---


def test_random__depends_on_its_seed_only() -> None:
    game = simulator("blobs")
    plays = [make_agent("random", seed=seed, n_steps=5).solve(game).stats.n_refits for seed in (1, 2, 3, 4, 5, 6)]
    again = [make_agent("random", seed=seed, n_steps=5).solve(game).stats.n_refits for seed in (1, 2, 3, 4, 5, 6)]
    assert plays == again and len(set(plays)) > 1


def test_random__plays_legal_actions_for_so_many_steps() -> None:
    game, agent = simulator("blobs", operators="paper"), RandomAgent(RandomConfig(seed=3, n_steps=6))
    state, played = game.initial(), set()
    for _ in range(6):
        decision = agent.act(game, state)
        assert decision.action in game.legal_actions(state)[1:]
        assert set(decision.policy) == set(game.legal_actions(state)[1:])
        assert sum(decision.policy.values()) == pytest.approx(1.0)
        by_operator = {a.operator: 0.0 for a in decision.policy}
        for action, share in decision.policy.items():
            by_operator[action.operator] += share
        assert np.ptp(list(by_operator.values())) < 1e-12
        played.add(decision.action.operator)
        state = game.transition(state, decision.action)
    assert len(played) > 1
    assert agent.act(game, state) == Decision(STOP)
    assert len({agent.act(game, replace(state, step=step)).action for step in range(6)}) > 1


def test_random__stops_where_it_is_over() -> None:
    game = simulator()
    assert make_agent("random").act(game, game.transition(game.initial(), STOP)) == Decision(STOP)


# --- the end of a solve ---


def test_finish__cuts_the_sequence_at_its_best() -> None:
    game = Simulator(TARGETS["house"], resolution=64)
    roof = max(game.transition_all(game.initial()), key=lambda child: child.score.total)
    split = OPERATORS["face_split"].apply(roof.mesh, 0)
    worse = State(split, game.score(split), 2, "", Action("face_split", 0))
    solution = finish(game, [game.initial(), roof, worse], Meter(Budget()))
    (inner,) = np.flatnonzero(~split.topology.is_boundary_edge).tolist()
    joined = OPERATORS["edge_dissolve"].apply(split, inner)
    no_better = State(joined, roof.score, 3, "", Action("edge_dissolve", inner))
    assert finish(game, [game.initial(), roof, worse, no_better], Meter(Budget())).sequence == solution.sequence
    assert [step.operator for step in solution.sequence.steps] == ["edge_subdivide"]
    assert solution.score.iou == 1.0
    assert_consistent(solution, game)


def test_finish__polishes_the_last_mesh_at_the_silhouettes_resolution() -> None:
    game = Simulator(noise(6, 64), resolution=16)
    state = game.initial()
    solution = finish(game, [state], Meter(Budget()))
    assert solution.mesh == game.polish(state.mesh)
    assert solution.score.total >= game.final_score(state.mesh).total


# --- the registry ---


def test_registry__names_agents_after_themselves() -> None:
    assert {*NAMES} <= {*AGENTS}
    for name in AGENTS:
        try:
            assert make_agent(name).name == name
        except ConfigError as error:
            assert "comes without weights" in str(error) and "weights=PATH" in str(error)


@pytest.mark.parametrize(
    ("name", "options", "complaint"),
    [
        ("bean", {}, r"agent 'bean' is unknown; give one of .*\bbeam\b"),
        ("beam", {"witdh": 4}, r"agent 'beam' has no option 'witdh'; its options are width, "),
        ("beam", {"width": "wide"}, r"agent 'beam', option width: .* got 'wide'"),
        ("beam", {"width": 2.5}, r"agent 'beam', option width: .* got 2.5"),
        ("beam", {"width": 0}, "a width and a patience of at least 1"),
        ("beam", {"patience": 0}, "a width and a patience of at least 1"),
        ("beam", {"merge_grid": float("nan")}, "a positive merge_grid"),
        ("random", {"seed": -1}, "seed -1: expected at least 0"),
        ("trace", {"prices": ()}, "prices"),
        ("trace", {"prices": (2.0, 1.0)}, "prices"),
        ("trace", {"prices": (0.0,)}, "prices"),
        ("trace", {"prices": ("dear",)}, r"agent 'trace', option prices.0: .* got 'dear'"),
        ("trace", {"n_constructed": 0}, "n_constructed 0: expected at least 1"),
    ],
)
def test_registry__says_in_one_line_what_is_wrong(name: str, options: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ConfigError, match=complaint) as caught:
        make_agent(name, **options)
    assert "\n" not in str(caught.value)


def test_registry__reads_options_as_a_command_line_gives_them() -> None:
    game = simulator()
    as_text, as_number = make_agent("beam", width="2", patience="1"), make_agent("beam", width=2, patience=1)
    assert as_text.solve(game).sequence == as_number.solve(game).sequence
