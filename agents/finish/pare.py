"""Take away from a finished shape what it does not need: a last greedy search among the actions that remove."""

from collections.abc import Sequence
from dataclasses import replace

from autopoly_env.errors import IllegalActionError
from autopoly_env.operators import STOP, Action, operator_named
from autopoly_env.simulator import MANY_VERTICES, Simulator, State

_N_TRIED = 4  # removals that are refitted, those that are worth most as they are


def pare(simulator: Simulator, states: Sequence[State]) -> tuple[list[State], int, int]:
    """The states, and those of removing actions after them as long as each scores better; the numbers of refits that it
    took, and of actions that were added.

    Only actions that the simulator allows are taken, and none where nothing has been done or the steps are used up, or
    from a mesh of many vertices.
    """
    pared, n_refits, n_added = [state for state in states if state.action != STOP], 0, 0
    while len(pared) > 1 and pared[-1].step < simulator.max_steps and len(pared[-1].mesh.vertices) <= MANY_VERTICES:
        state = replace(pared[-1], done="")
        n_before = simulator.n_refits
        children = simulator.transition_all(state, _most_promising(simulator, state))
        n_refits += simulator.n_refits - n_before
        sane = (child for child in children if simulator.is_sound(child.mesh))
        best = max(sane, key=simulator.standing, default=state)
        if simulator.standing(best) <= simulator.standing(state):
            break
        pared.append(best)
        n_added += 1
    return pared, n_refits, n_added


def _most_promising(simulator: Simulator, state: State) -> list[Action]:
    """The removing actions that are worth most before any refit."""

    def worth(action: Action) -> float:
        try:
            after = operator_named(action.operator).apply(state.mesh, action.element)
        except IllegalActionError:
            return float("-inf")
        return simulator.score(after).total

    actions = [action for action in simulator.legal_actions(state)[1:] if operator_named(action.operator).removes]
    return sorted(actions, key=worth, reverse=True)[:_N_TRIED]
