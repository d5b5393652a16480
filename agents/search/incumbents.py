"""Other agents' solutions as the shape that the search goes on from."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from agents.base import Agent
from agents.budget import Budget, Meter, Progress
from agents.contract import solved
from agents.solution import Solution, Track
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import Action, Halfway
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.sequence.ids import decoded
from autopoly_env.simulator import Simulator, State

SHARE = 0.6  # of what is left of the budget, that an incumbent may use
_MOST_AT_ONCE = 2  # steps of a sequence that are one of the simulator's: an action and its mirror image


def play(agents: Sequence[Agent], simulator: Simulator, meter: Meter) -> Iterator[Solution]:
    """The agents' solutions, as far as the budget goes. Raises KeyboardInterrupt after one that was interrupted.

    Each has a share of what is left of the budget; where that has no limits, it has none.

    Agents that do not suit the simulator, by its guidance, rule of faces or operators, are left out.
    """
    for agent in agents:
        if meter.spent():
            return
        if not agent.suits(simulator):
            continue
        solution = _solve_within(agent, simulator, meter, meter.rest().share(SHARE))
        yield solution
        if solution.stats.stopped_by == "interrupted":
            raise KeyboardInterrupt


def _solve_within(agent: Agent, simulator: Simulator, meter: Meter, budget: Budget) -> Solution:
    """What the agent finds within the budget; its work is counted and reported as it goes."""
    n_counted = 0

    def report(progress: Progress) -> None:
        nonlocal n_counted
        n_new, n_counted = progress.n_refits - n_counted, progress.n_refits
        meter.count(n_new, progress.best_total, progress.best)

    solution = solved(agent, simulator, replace(budget, simulations=None), report)
    meter.add_refits(solution.stats.n_refits - n_counted)
    return solution


def track_of(simulator: Simulator, sequence: ConstructionSequence) -> Track:
    """The states that a solution's sequence goes through, scored as the simulator scores; the last may have ended.

    Under symmetry an action and its mirror image make one state, and the track ends where the steps cannot be told so.
    Steps of an earlier sequence that the simulator goes on from are no part of it.
    """
    earlier = simulator.guidance.earlier
    n_earlier = 0 if earlier is None else len(earlier.steps)
    meshes = sequence.meshes()[n_earlier:]
    track = Track(simulator.initial(meshes[0]))
    taken: list[Halfway] = []  # steps since the last state, each with the mesh before it
    for step, before, after in zip(sequence.steps[n_earlier:], meshes, meshes[1:], strict=False):
        _, element, choice = decoded(before, step)
        taken.append(Halfway(before, Action(step.operator, element), choice))
        if simulator.guidance.is_symmetric(after):
            track = Track(_reached(simulator, taken, after, track.state.step + 1), track)
            taken = []
        elif len(taken) == _MOST_AT_ONCE:
            break
    return track


def _reached(simulator: Simulator, taken: Sequence[Halfway], after: PolyMesh, number: int) -> State:
    """State `number` with the mesh `after` one action, or after one and its mirror image."""
    first, *image = taken
    state = simulator.initial(after)
    over = state.done or ("max_steps" if number >= simulator.max_steps else "")
    halfway = image[0] if image else None
    return replace(state, step=number, done=over, action=first.action, choice=first.choice, halfway=halfway)
