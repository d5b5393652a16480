"""`ChoiceEvaluator`: ChoiceNet's priors and values for the tree search; exact refits.

A = actions, S = states. Actions of operators that the weights do not know keep no share but the floor of the others;
rules and prices that they were not trained for are refused.
"""

from collections.abc import Sequence

import numpy as np

from agents.choice.features import look, look_at_whole
from agents.choice.network import batch_of, choose, gains
from agents.choice.weights import ChoiceWeights
from agents.search.evaluator import UniformEvaluator
from autopoly_env.arrays import FloatArray
from autopoly_env.errors import ConfigError
from autopoly_env.operators import Action, operator_named
from autopoly_env.simulator import Simulator, State

_FLOOR = 1e-4  # of the likeliest action, for all


class ChoiceEvaluator(UniformEvaluator):
    """What a search has taught, in NumPy."""

    def __init__(self, weights: ChoiceWeights, temperature: float = 1.0) -> None:
        self._config, self._tensors, self._temperature = weights.config, weights.tensors, temperature

    def check(self, simulator: Simulator) -> None:
        """Raise ConfigError where the weights know nothing of the simulator's rule, price or any of its operators."""
        low, high = self._config.w_sc
        if simulator.faces not in self._config.rules:
            known = ", ".join(self._config.rules)
            raise ConfigError(f"these weights know faces={known}, not {simulator.faces}: give one of them, or others")
        if not low <= simulator.weights.w_sc <= high:
            raise ConfigError(
                f"these weights know w_sc {low:g} to {high:g}, not {simulator.weights.w_sc:g}: give others"
            )
        if len(self.unknown(simulator)) == len(simulator.operators):
            raise ConfigError(
                f"these weights know {', '.join(self._config.classes)}, none of which is an operator here: give others"
            )

    def unknown(self, simulator: Simulator) -> list[str]:
        """The simulator's operators that the weights do not know: their actions come last."""
        return [
            name for name in simulator.operators if not set(operator_named(name).classes) & set(self._config.classes)
        ]

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
