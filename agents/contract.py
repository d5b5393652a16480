"""Holding agents to their word where their results are used: in commands, in evaluations, as seeds of a search."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from agents.base import Agent, full_name
from agents.budget import Budget, Progress
from agents.solution import OVER_BUDGET, Solution, Stats
from autopoly_env import outside
from autopoly_env.errors import ConformanceError
from autopoly_env.mesh import PolyMesh
from autopoly_env.score import Score
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.simulator import Simulator

_AT_THE_START = 2  # refits of the rectangle that a game begins with, which are nobody's
_PARTS = {"sequence": ConstructionSequence, "mesh": PolyMesh, "score": Score, "stats": Stats}


def solved(
    agent: Agent,
    simulator: Simulator,
    budget: Budget | None = None,
    on_progress: Callable[[Progress], None] | None = None,
) -> Solution:
    """What `agent.solve` returns, if that is a solution; its refits are those that the simulator has counted.

    Raises ConformanceError, in one line that names the agent's module, if it is none, and if an agent from outside this
    package raises an exception: with the line of its module. Ours raise what they raise.
    """
    n_before = simulator.n_refits
    try:
        solution = agent.solve(simulator, budget, on_progress)
    except ConformanceError:
        raise
    except (Exception, SystemExit) as error:
        module = type(agent).__module__
        if module.split(".")[0] == __package__:
            raise
        what = outside.described(error, module)
        raise ConformanceError(f"{what}, from {full_name(agent)}; expected a Solution from its solve") from error
    _check(solution, full_name(agent))
    return _counted(solution, simulator.n_refits - n_before, budget)


def _counted(solution: Solution, n_refits: int, budget: Budget | None) -> Solution:
    """The solution with the refits that the simulator has counted, where these are more than the agent has."""
    stats = solution.stats
    if n_refits <= max(stats.n_refits, _AT_THE_START):
        return solution
    limit = None if budget is None else budget.refits
    is_over = limit is not None and n_refits > limit
    reason = OVER_BUDGET if is_over and stats.stopped_by != "interrupted" else stats.stopped_by
    return replace(solution, stats=replace(stats, n_refits=n_refits, stopped_by=reason))


def _check(solution: Any, who: str) -> None:
    if not isinstance(solution, Solution):
        raise ConformanceError(f"{who}: solve returned {solution!r:.60}; expected a Solution")
    for name, kind in _PARTS.items():
        part = getattr(solution, name)
        if not isinstance(part, kind):
            raise ConformanceError(f"{who}: the {name} of its Solution is {part!r:.60}; expected a {kind.__name__}")
