"""`RlEvaluator`: a policy's probabilities as the priors of the tree search; exact refits."""

from collections.abc import Iterable, Sequence

import numpy as np

from agents.rl.player import Player
from agents.search.batched import BatchedEvaluator
from autopoly_env.arrays import FloatArray
from autopoly_env.errors import IllegalActionError
from autopoly_env.operators import Action
from autopoly_env.simulator import Simulator, State

_FLOOR = 1e-4  # of the likeliest action, for all
_REMEMBERED = 512  # states whose logits are kept


class RlEvaluator(BatchedEvaluator[FloatArray]):
    """Priors (A,) are the softmax of the policy's logits; an action that its padding has no room for gets the floor.

    Where there is no room for the mesh itself, all actions are alike.
    """

    def __init__(self, player: Player, temperature: float = 1.0) -> None:
        super().__init__(_REMEMBERED)
        self._player, self._temperature = player, temperature

    def prior(self, simulator: Simulator, state: State, actions: Sequence[Action]) -> FloatArray:
        if not self._fits(state):
            return super().prior(simulator, state, actions)
        logits = self._said_of(simulator, state)
        said = np.array([self._logit(logits, action) for action in actions])
        odds = np.exp((said - max(float(said.max()), -1e6)) / self._temperature) + _FLOOR
        normalised: FloatArray = odds / odds.sum()
        return normalised

    def _logit(self, logits: FloatArray, action: Action) -> float:
        try:
            return float(logits[self._player.codec.encode(action)])
        except IllegalActionError:
            return -np.inf

    def _evaluate(self, simulator: Simulator, states: Sequence[State]) -> Iterable[FloatArray]:
        return self._player.logits([simulator] * len(states), states, exact=False)

    def _fits(self, state: State) -> bool:
        return self._player.fits(state)
