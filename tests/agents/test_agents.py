"""What every agent promises."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import pytest

from agents.budget import Budget, Progress
from autopoly_env.errors import ConfigError
from autopoly_env.operators import Action
from autopoly_env.simulator import Simulator, State
from tests.helpers.drawings import SQUARE, painted
from tests.helpers.solving import TARGETS, assert_consistent, interrupt_at, quick, simulator

NAMES = ("random", "greedy", "beam", "trace", "climb")


@pytest.mark.parametrize("name", NAMES)
def test_solve__takes_a_square_for_what_it_is(name: str) -> None:
    solution = quick(name).solve(Simulator(painted(SQUARE), resolution=64))
    assert (solution.mesh.counts, solution.score.iou, len(solution.sequence.steps)) == ((4, 4, 1), 1.0, 0)
    assert solution.stats.stopped_by == "finished"


@pytest.mark.slow
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


@pytest.mark.slow
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


@pytest.mark.slow
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
