"""`BatchedEvaluator`: what a network says of states, remembered, and said of several states in one batch.

A search asks for one state at a time, yet a network takes sixteen hardly longer than one. So the states that the search
has just made wait, and are evaluated along with the next one that it asks for.
"""

from abc import ABC, abstractmethod
from collections import OrderedDict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from agents.search.evaluator import UniformEvaluator
from autopoly_env.mesh import FaceRule, PolyMesh
from autopoly_env.operators import Action
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator, State

BATCH = 16  # states that are evaluated at once at most

Said = TypeVar("Said")


class BatchedEvaluator(UniformEvaluator, ABC, Generic[Said]):
    """Exact refits; a subclass has the network (`_evaluate`), and makes priors of what it says (`_said_of`)."""

    def __init__(self, n_remembered: int) -> None:
        """Keep what is said of the `n_remembered` states that were asked for last."""
        self._n_remembered = n_remembered
        self._about: _About | None = None  # what the following two are about
        self._said: OrderedDict[PolyMesh, Said] = OrderedDict()
        self._waiting: list[State] = []

    def expand(self, simulator: Simulator, state: State, actions: Sequence[Action]) -> list[State]:
        return self._noted(simulator, super().expand(simulator, state, actions))

    @abstractmethod
    def _evaluate(self, simulator: Simulator, states: Sequence[State]) -> Iterable[Said]:
        """What the network says of each of at most BATCH states that fit."""

    def _fits(self, state: State) -> bool:
        """Whether the network can take the state."""
        return True

    def _noted(self, simulator: Simulator, states: list[State]) -> list[State]:
        """The states that were made; those that are not over wait."""
        self._turn_to(simulator)
        self._waiting = [*self._waiting, *(state for state in states if not state.done)][-(BATCH - 1) :]
        return states

    def _said_of(self, simulator: Simulator, state: State) -> Said:
        """What the network says of a state; those that wait are evaluated in the same batch."""
        self._turn_to(simulator)
        if state.mesh not in self._said:
            waiting = [other for other in self._waiting if other.mesh not in self._said and self._fits(other)]
            self._waiting = []
            states = list({one.mesh: one for one in (*waiting, state)}.values())
            self._said.update(zip((one.mesh for one in states), self._evaluate(simulator, states), strict=True))
        self._said.move_to_end(state.mesh)
        while len(self._said) > self._n_remembered:
            self._said.popitem(last=False)
        return self._said[state.mesh]

    def _turn_to(self, simulator: Simulator) -> None:
        """Forget what was said about another target, or under another rule or price."""
        about = _About(simulator.silhouette, simulator.faces, simulator.weights.w_sc)
        if about != self._about:
            self._about, self._waiting = about, []
            self._said.clear()


@dataclass(frozen=True)
class _About:
    target: Silhouette
    faces: FaceRule
    w_sc: float
