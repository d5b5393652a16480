"""Other agents' solutions as the shape that the search goes on from."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from agents.base import Agent
from agents.budget import Budget, Meter, Progress
from agents.contract import solved
from agents.solution import Solution, Track
from autopoly_env.operators import Action
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.sequence.ids import decoded
from autopoly_env.simulator import Simulator

SHARE = 0.6  # of what is left of the budget, that an incumbent may use


def play(agents: Sequence[Agent], simulator: Simulator, meter: Meter, n_most: int | None = None) -> Iterator[Solution]:
    """The agents' solutions, as far as the budget goes. Raises KeyboardInterrupt after one that was interrupted.

    Each has a share of what is left of the budget; where that has no limits, `n_most` refits.

    Agents that cannot take the simulator's guidance are left out.
    """
    for agent in agents:
        if meter.spent():
            return
        if simulator.guidance.names and not agent.takes_guidance:
            continue
        budget = meter.rest().share(SHARE)
        solution = _solve_within(agent, simulator, meter, budget if n_most is None else Budget(n_most))
        yield solution
        if solution.stats.stopped_by == "interrupted":
            raise KeyboardInterrupt


def _solve_within(agent: Agent, simulator: Simulator, meter: Meter, budget: Budget) -> Solution:
    """What the agent finds within the budget; its work is counted and reported as it goes."""
    n_counted = 0

    def report(progress: Progress) -> None:
        nonlocal n_counted
        n_new, n_counted = progress.n_refits - n_counted, progress.n_refits
        meter.count(n_new, progress.best_total)

    solution = solved(agent, simulator, replace(budget, simulations=None), report)
    meter.add_refits(solution.stats.n_refits - n_counted)
    return solution


def track_of(simulator: Simulator, sequence: ConstructionSequence) -> Track:
    """The states that a sequence goes through, scored as the simulator scores; the last may have ended."""
    meshes = sequence.meshes()
    track = Track(simulator.initial(sequence.start))
    for number, (step, before, after) in enumerate(zip(sequence.steps, meshes, meshes[1:], strict=False), 1):
        _, element, choice = decoded(before, step)
        state = simulator.initial(after)
        over = state.done or ("max_steps" if number >= simulator.max_steps else "")
        track = Track(
            replace(state, step=number, done=over, action=Action(step.operator, element), choice=choice), track
        )
    return track
