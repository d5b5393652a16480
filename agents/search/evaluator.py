"""`Evaluator`: what the search is told about states - which actions are promising, and how they are carried out."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from autopoly_env.arrays import FloatArray
from autopoly_env.operators import HOLE_SIDES, Action
from autopoly_env.placement import Disagreement
from autopoly_env.placement.blame_kernels import AREA, MASS
from autopoly_env.simulator import Simulator, State


class Evaluator(Protocol):
    """Priors and geometry; a network's or, without one, what the picture itself says."""

    def prior(self, simulator: Simulator, state: State, actions: Sequence[Action]) -> FloatArray:
        """Probabilities (A,) of the actions; they sum to 1."""
        ...

    def expand(self, simulator: Simulator, state: State, actions: Sequence[Action]) -> list[State]:
        """The states after the actions, in their order; those without room left out."""
        ...


class UniformEvaluator:
    """The paper's search without learning: all actions alike, exact refits."""

    def prior(self, simulator: Simulator, state: State, actions: Sequence[Action]) -> FloatArray:
        return np.full(len(actions), 1.0 / len(actions))

    def expand(self, simulator: Simulator, state: State, actions: Sequence[Action]) -> list[State]:
        return simulator.transition_all(state, actions)


class ResidualEvaluator(UniformEvaluator):
    """Prior from the disagreement of rendering and target: what an edge is to blame for is what changing it can gain.

    An action that adds vertices to an edge is as likely as the area the edge answers for; a hole as the excess in its
    face, as far as no edge answers for it; what removes elements has a small constant share, for nothing can be known
    of it before the refit. Whatever else is legal keeps a share above 0.
    """

    _REMOVAL_SHARE = 0.02  # of the largest blame
    _RIM_SHARE = 0.1  # of an excess that an edge answers for, left to a hole
    _FLOOR = 1e-3  # of the likeliest action, for all

    def prior(self, simulator: Simulator, state: State, actions: Sequence[Action]) -> FloatArray:
        return self.prior_by(Disagreement(state.mesh, simulator.silhouette), actions)

    def prior_by(self, disagreement: Disagreement, actions: Sequence[Action]) -> FloatArray:
        """The prior, where the disagreement is known already."""
        promise = np.array([self._promise(disagreement, action) for action in actions])
        promise += self._FLOOR * max(float(promise.max()), 1e-9)
        normalised: FloatArray = promise / promise.sum()
        return normalised

    def _promise(self, disagreement: Disagreement, action: Action) -> float:
        """The area (unit square) that the action may put right."""
        missing, excess = disagreement.blame[:, 0, MASS], disagreement.blame[:, 1, MASS]
        row = disagreement.row_of_edge.get(action.element, -1)  # of the edge, where the action has one
        match action.operator:
            case "edge_subdivide":
                return float(max(missing[row], excess[row])) if row >= 0 else 0.0
            case "edge_extrude":
                return float(missing[row])
            case "face_hole":
                region = disagreement.excess_in(action.element // len(HOLE_SIDES))
                area = 0.0 if region is None else -float(region[AREA])
                return max(area - float(excess.max()), self._RIM_SHARE * area)
            case "face_split":
                return 0.0
            case _:
                return self._REMOVAL_SHARE * float(max(missing.max(), excess.max()))
