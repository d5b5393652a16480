"""Two priors in one: where both hold an action to be likely it is, for each errs elsewhere."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from agents.knowing import Known
from agents.search.evaluator import Evaluator, UniformEvaluator
from autopoly_env.arrays import FloatArray
from autopoly_env.operators import Action
from autopoly_env.simulator import Simulator, State


class KnowingEvaluator(Evaluator, Protocol):
    """A network's evaluator, which says what its weights know."""

    @property
    def known(self) -> Known:
        """What the weights may be asked about."""
        ...


class JointEvaluator(UniformEvaluator):
    """The geometric mean of the priors of two evaluators; states are made as the first one makes them."""

    def __init__(self, first: KnowingEvaluator, second: KnowingEvaluator) -> None:
        self._first, self._second = first, second

    @property
    def known(self) -> Known:
        """What both know, and the actions that either does."""
        return self._first.known.shared_with(self._second.known)

    def prior(self, simulator: Simulator, state: State, actions: Sequence[Action]) -> FloatArray:
        first, second = (one.prior(simulator, state, actions) for one in (self._first, self._second))
        mean: FloatArray = np.sqrt(first * second)
        return mean / mean.sum() if mean.any() else first

    def expand(self, simulator: Simulator, state: State, actions: Sequence[Action]) -> list[State]:
        return self._first.expand(simulator, state, actions)
