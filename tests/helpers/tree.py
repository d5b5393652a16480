"""Games drawn by hand as trees, for agents that search."""

from typing import Any

from agents.baselines.beam import BeamAgent, BeamConfig
from agents.budget import Budget, Meter
from agents.solution import Track
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import Action
from autopoly_env.score import Score, ScoreWeights
from autopoly_env.simulator import State


class Tree:
    """A game drawn by hand: totals and children by name. `visited` are the nodes whose children were asked for."""

    weights = ScoreWeights(w_sc=1.0)

    n_refits = 0  # that are counted: its states say themselves what they took

    def __init__(self, totals: dict[str, float], children: dict[str, str], twins: str = "", rich: str = "") -> None:
        self.children = children
        self.twins = twins  # nodes that are one shape
        self.rich = rich  # nodes of complexity 15, the others have 9
        self.states = {name: self._state(name, total) for name, total in totals.items()}
        self.visited: list[str] = []

    def _state(self, name: str, total: float) -> State:
        place = 1 / (1 + "rabcdef".index(self.twins[0] if name in self.twins else name))
        mesh = PolyMesh.rectangle(0.0, 0.0, place, place)
        complexity = 15 if name in self.rich else 9
        return State(mesh, Score(total / 100, complexity, 0, total), n_refits=1, action=Action(name, 0))

    def name(self, state: State) -> str:
        assert state.action is not None
        return state.action.operator

    def transition_all(self, state: State) -> list[State]:
        self.visited.append(self.name(state))
        return [self.states[child] for child in self.children.get(self.name(state), "")]

    def is_sound(self, _mesh: PolyMesh) -> bool:
        return True

    def standing(self, state: State) -> float:
        return state.score.total

    def search(self, budget: Budget | None = None, **options: Any) -> tuple[str, str]:
        """(the nodes visited, the best node) of a beam search from node r."""
        agent, root = BeamAgent(BeamConfig(**options)), Track(self.states["r"])
        found = [root, *agent._search(self, root, Meter(budget or Budget()))]  # type: ignore[arg-type]
        best = max(found, key=lambda track: track.state.score.total)
        assert self.name(best.states()[0]) == "r"
        return "".join(self.visited), self.name(best.state)


#            r 10
#       a 20      b 15      c 5
#       d 12      e 30      f 90
VALLEY = {"r": 10.0, "a": 20.0, "b": 15.0, "c": 5.0, "d": 12.0, "e": 30.0, "f": 90.0}
VALLEY_CHILDREN = {"r": "cab", "a": "d", "b": "e", "c": "f"}
