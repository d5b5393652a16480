"""Budgets that cannot be passed by: the simulator counts, whatever an agent does with it."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from agents.base import Agent, Decision
from agents.budget import MOST_STATES, STATES_A_REFIT, Budget, Foresight, Meter, Progress
from agents.contract import solved
from agents.registry import make_agent
from agents.solution import OVER_BUDGET, Solution
from autopoly_env.errors import ConfigError, IllegalActionError
from autopoly_env.operators import STOP, Action
from autopoly_env.simulator import Simulator, State
from tests.helpers.solving import simulator


class Curious(Agent):
    """Tries everything, and takes the best of it."""

    name = "curious"

    def act(self, game: Simulator, state: State) -> Decision:
        best = max(game.transition_all(state), key=lambda child: child.score.total, default=state)
        return Decision(best.action or STOP)


class Sly(Curious):
    """Tries everything, and says that it has tried nothing."""

    name = "sly"

    def solve(self, game: Simulator, budget: Budget | None = None, on_progress: Any = None) -> Solution:
        game.transition_all(game.initial())
        solution = super().solve(game, Budget(refits=1), on_progress)
        return replace(solution, stats=replace(solution.stats, n_refits=1))


def test_simulator__counts_the_refits_of_all_that_it_does() -> None:
    game = simulator("house")
    state = game.initial()
    assert game.n_refits == state.n_refits == 2
    children = game.transition_all(state)
    assert game.n_refits == 2 + sum(child.n_refits for child in children) > 10
    before = game.n_refits
    after = game.transition(state, game.legal_actions(state)[1])
    assert game.n_refits - before == after.n_refits


def test_what_act_tries__is_in_budget_progress_and_report() -> None:
    game, reports = simulator("blobs"), list[Progress]()
    solution = solved(Curious(), game, Budget(refits=30), reports.append)
    assert solution.stats.stopped_by == "refits"
    assert solution.stats.n_refits == reports[-1].n_refits == game.n_refits >= 30
    assert [report.n_refits for report in reports[:-1]] == [n for n in (r.n_refits for r in reports) if n < 30]


def test_refits_that_an_agent_hides__are_reported_and_it_is_marked() -> None:
    game = simulator("house")
    solution = solved(Sly(), game, Budget(refits=5))
    assert solution.stats.stopped_by == OVER_BUDGET
    assert solution.stats.n_refits == game.n_refits > 5
    unlimited = solved(Sly(), simulator("house"))
    assert unlimited.stats.stopped_by != OVER_BUDGET


@pytest.mark.parametrize("name", ["greedy", "mcts_paper", "random"])
def test_our_agents__report_what_the_simulator_has_counted(name: str) -> None:
    game = simulator("blobs")
    solution = make_agent(name).solve(game, Budget(refits=40))
    assert solution.stats.n_refits == game.n_refits


def test_step_without_room__is_idle_and_its_refits_count(monkeypatch: pytest.MonkeyPatch) -> None:
    game = simulator("blobs")
    real: Callable[[State, Action], State] = game.transition
    tried = []

    def crowded(state: State, action: Action) -> State:
        after = real(state, action)
        tried.append(action)
        if len(tried) == 1:
            raise IllegalActionError("no room")
        return after

    monkeypatch.setattr(game, "transition", crowded)
    solution = make_agent("random", n_steps=4).solve(game)
    assert sum(action != STOP for action in tried) == 4
    assert solution.stats.n_refits == game.n_refits


def test_tree__is_bounded_where_its_states_cost_no_refit() -> None:
    meter = Meter(Budget(refits=2))
    for _ in range(2 * STATES_A_REFIT - 1):
        meter.add_simulation(1)
        meter.add([])
    assert not meter.spent()
    meter.add_simulation(1)
    assert meter.spent() and meter.stopped_by == "states"


def test_tree__is_bounded_whatever_the_budget_is() -> None:
    meter = Meter.unlimited()
    meter.add_simulation(MOST_STATES)
    assert meter.spent() and meter.stopped_by == "states"


def test_foresight__counts_its_states_where_they_cost_memory_and_reports_none_of_its_shapes() -> None:
    reported: list[Progress] = []
    whole = Meter(Budget(refits=2), reported.append)
    first, second = Foresight(whole), Foresight(whole)
    for ahead in (first, second):
        ahead.add_simulation(STATES_A_REFIT)
        ahead.count(0, 1e6)
    assert second.spent() and whole.spent() and whole.stopped_by == "states"
    assert (reported, whole.stats().n_refits) == ([], 0)


@pytest.mark.parametrize("value", [1.5, -1, "3", float("nan"), -(10**400)])
def test_budget__of_refits_is_a_whole_number(value: Any) -> None:
    with pytest.raises(ConfigError, match=r"refits: expected a whole number of at least 0$"):
        Budget(refits=value)


@pytest.mark.parametrize("name", ["exploration", "temperature"])
def test_what_is_not_finite__is_refused_before_the_search(name: str) -> None:
    with pytest.raises(ConfigError, match=f"{name}.*finite"):
        make_agent("nfap-mcts", **{name: float("inf")})
