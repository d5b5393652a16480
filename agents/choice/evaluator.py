"""`ChoiceEvaluator`: ChoiceNet's priors and values for the tree search; exact refits.

A = actions, S = states. Actions of operators that the weights do not know keep no share but the floor of the others;
rules and prices that they were not trained for are refused.
"""

from collections.abc import Sequence

import numpy as np

from agents.choice.features import look, look_at_whole
from agents.choice.network import batch_of, choose, gains
from agents.choice.weights import ChoiceWeights
from agents.knowing import Known
from agents.search.evaluator import UniformEvaluator
from autopoly_env.arrays import FloatArray
from autopoly_env.operators import Action
from autopoly_env.simulator import Simulator, State

_FLOOR = 1e-4  # of the likeliest action, for all


class ChoiceEvaluator(UniformEvaluator):
    """What a search has taught, in NumPy."""

    def __init__(self, weights: ChoiceWeights, temperature: float = 1.0) -> None:
        self._config, self._tensors, self._temperature = weights.config, weights.tensors, temperature

    @property
    def known(self) -> Known:
        """What the weights may be asked about."""
        return Known(self._config.classes, self._config.rules, self._config.w_sc)

    def prior(self, simulator: Simulator, state: State, actions: Sequence[Action]) -> FloatArray:
        return self.priors(simulator, [(state, actions)])[0]

    def priors(self, simulator: Simulator, asked: Sequence[tuple[State, Sequence[Action]]]) -> list[FloatArray]:
        """Probabilities (A,) of the actions of each of several states, evaluated in one batch."""
        seen = [look(simulator, state, actions, self._config.classes, self._config.side) for state, actions in asked]
        batch = batch_of([one for one, _ in seen])
        logits = choose(self._tensors, batch).astype(np.float64) / self._temperature
        ends = np.searchsorted(batch.owners, np.arange(len(asked) + 1))
        found = []
        for (one, residual), first, last in zip(seen, ends, ends[1:], strict=False):
            odds = np.zeros(len(one.classes))
            if first == last:
                found.append(residual)
                continue
            odds[one.classes >= 0] = np.exp(logits[first:last] - logits[first:last].max())
            odds += _FLOOR
            found.append(odds / odds.sum())
        return found

    def foresee(self, simulator: Simulator, states: Sequence[State]) -> FloatArray:
        """(S,) the r_all that the search will have found from each state on, evaluated in one batch."""
        totals = np.array([state.score.total for state in states])
        if not len(states):
            return totals
        whole, value = zip(*(look_at_whole(simulator, state) for state in states), strict=True)
        going_on = np.array([not state.done for state in states])
        foreseen: FloatArray = totals + going_on * gains(self._tensors, np.stack(whole), np.stack(value))
        return foreseen
