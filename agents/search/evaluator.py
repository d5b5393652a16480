"""`Evaluator`: what the search is told about states: promising actions, how they are carried out, what may come."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from autopoly_env.arrays import FloatArray
from autopoly_env.operators import Action, operator_named
from autopoly_env.placement import Disagreement
from autopoly_env.simulator import Simulator, State


class Evaluator(Protocol):
    """Priors and geometry; a network's or, without one, what the picture itself says."""

    def prior(self, simulator: Simulator, state: State, actions: Sequence[Action]) -> FloatArray:
        """Probabilities (A,) of the actions; they sum to 1."""
        ...

    def expand(self, simulator: Simulator, state: State, actions: Sequence[Action]) -> list[State]:
        """The states after the actions, in their order; those without room left out."""
        ...

    def foresee(self, simulator: Simulator, states: Sequence[State]) -> FloatArray:
        """The r_all (S,) that is to be expected from each state on."""
        ...


class UniformEvaluator:
    """The paper's search without learning: all actions alike, exact refits."""

    def prior(self, simulator: Simulator, state: State, actions: Sequence[Action]) -> FloatArray:
        return np.full(len(actions), 1.0 / len(actions))

    def expand(self, simulator: Simulator, state: State, actions: Sequence[Action]) -> list[State]:
        return simulator.transition_all(state, actions)

    def foresee(self, simulator: Simulator, states: Sequence[State]) -> FloatArray:
        """What they are worth as they are."""
        return np.array([state.score.total for state in states], float)


class ResidualEvaluator(UniformEvaluator):
    """Prior from the disagreement of rendering and target: what an edge is to blame for is what changing it can gain.

    An action is as likely as the area that its operator says it may put right (`Operator.promise`). Whatever else is
    legal keeps a share above 0.
    """

    _FLOOR = 1e-3  # of the likeliest action, for all

    def prior(self, simulator: Simulator, state: State, actions: Sequence[Action]) -> FloatArray:
        return self.prior_by(Disagreement(state.mesh, simulator.silhouette), actions)

    def prior_by(self, disagreement: Disagreement, actions: Sequence[Action]) -> FloatArray:
        """The prior, where the disagreement is known already."""
        promise = np.array([operator_named(a.operator).promise_of(disagreement, a.element) for a in actions])
        promise += self._FLOOR * max(float(promise.max()), 1e-9)
        normalised: FloatArray = promise / promise.sum()
        return normalised
