"""`RlEvaluator`: a policy's probabilities as the priors of the tree search; exact refits.

States that the tree has just made are looked at in one batch with the one that is asked for.
"""

from collections import OrderedDict
from collections.abc import Sequence

import numpy as np

from agents.rl.player import Player
from agents.search.evaluator import UniformEvaluator
from autopoly_env.arrays import FloatArray
from autopoly_env.errors import ConfigError, IllegalActionError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import Action
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator, State

_FLOOR = 1e-4  # of the likeliest action, for all
_BATCH = 16  # states that are looked at at once at most
_REMEMBERED = 512  # states whose logits are kept


class RlEvaluator(UniformEvaluator):
    """Priors (A,) are the softmax of the policy's logits; an action that its padding has no room for gets the floor.

    Where there is no room for the mesh itself, all actions are alike.
    """

    def __init__(self, player: Player, temperature: float = 1.0) -> None:
        self._player, self._temperature = player, temperature
        self._target: Silhouette | None = None  # that the following two are about
        self._said: OrderedDict[PolyMesh, FloatArray] = OrderedDict()
        self._waiting: list[State] = []

    def prior(self, simulator: Simulator, state: State, actions: Sequence[Action]) -> FloatArray:
        if not self._fits(state):
            return super().prior(simulator, state, actions)
        logits = self._logits(simulator, state)
        of_actions = np.array([self._logit(logits, action) for action in actions])
        weights = np.exp((of_actions - max(float(of_actions.max()), -1e6)) / self._temperature) + _FLOOR
        prior: FloatArray = weights / weights.sum()
        return prior

    def expand(self, simulator: Simulator, state: State, actions: Sequence[Action]) -> list[State]:
        states = super().expand(simulator, state, actions)
        self._turn_to(simulator.silhouette)
        self._waiting = [*self._waiting, *(made for made in states if not made.done)][-(_BATCH - 1) :]
        return states

    def _logit(self, logits: FloatArray, action: Action) -> float:
        try:
            return float(logits[self._player.codec.encode(action)])
        except IllegalActionError:
            return -np.inf

    def _turn_to(self, target: Silhouette) -> None:
        """Forget what was said about another target."""
        if target is not self._target:
            self._target, self._waiting = target, []
            self._said.clear()

    def _logits(self, simulator: Simulator, state: State) -> FloatArray:
        """What the policy says of a state; shapes that wait are looked at in the same batch."""
        self._turn_to(simulator.silhouette)
        if state.mesh not in self._said:
            waiting = [other for other in self._waiting if self._fits(other) and other.mesh not in self._said]
            self._waiting = []
            states = list({one.mesh: one for one in (*waiting, state)}.values())
            said = self._player.logits([simulator] * len(states), states)
            self._said.update(zip((one.mesh for one in states), said, strict=True))
        self._said.move_to_end(state.mesh)
        found = self._said[state.mesh]
        while len(self._said) > _REMEMBERED:
            self._said.popitem(last=False)
        return found

    def _fits(self, state: State) -> bool:
        """Whether the policy's padding has room for the mesh."""
        try:
            self._player.check_fits(state)
        except ConfigError:
            return False
        return True
