"""Holding agents to their word where their results are used: in commands, in evaluations, as seeds of a search."""

from collections.abc import Callable
from typing import Any

from agents.base import Agent, full_name
from agents.budget import Budget, Progress
from agents.solution import Solution, Stats
from autopoly_env import outside
from autopoly_env.errors import ConformanceError
from autopoly_env.mesh import PolyMesh
from autopoly_env.score import Score
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.simulator import Simulator

_PARTS = {"sequence": ConstructionSequence, "mesh": PolyMesh, "score": Score, "stats": Stats}


def solved(
    agent: Agent,
    simulator: Simulator,
    budget: Budget | None = None,
    on_progress: Callable[[Progress], None] | None = None,
) -> Solution:
    """What `agent.solve` returns, if that is a solution.

    Raises ConformanceError, in one line that names the agent's module, if it is none, and if an agent from outside this
    package raises an exception: with the line of its module. Ours raise what they raise.
    """
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
    return solution


def _check(solution: Any, who: str) -> None:
    if not isinstance(solution, Solution):
        raise ConformanceError(f"{who}: solve returned {solution!r:.60}; expected a Solution")
    for name, kind in _PARTS.items():
        part = getattr(solution, name)
        if not isinstance(part, kind):
            raise ConformanceError(f"{who}: the {name} of its Solution is {part!r:.60}; expected a {kind.__name__}")
