"""Tree search over games drawn by hand: searches, and what became of their trees."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from agents.budget import Budget, Meter
from agents.search.config import MctsConfig
from agents.search.evaluator import UniformEvaluator
from agents.search.mcts import MctsAgent
from agents.search.search import Search
from agents.search.tree import Node
from agents.solution import Track
from autopoly_env.arrays import FloatArray
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import STOP, Action
from autopoly_env.score import Score
from autopoly_env.simulator import Simulator, State


class Game:
    """A game drawn by hand: totals by name, children by name. `expanded` are the children made, in order."""

    n_refits = 0  # that are counted: its states say themselves what they took

    def __init__(self, totals: dict[str, float], children: dict[str, str], twins: str = "") -> None:
        self.children = children
        self.states = {name: _state(twins[0] if name in twins else name, name, t) for name, t in totals.items()}
        self.expanded = ""

    def legal_actions(self, state: State) -> list[Action]:
        return [STOP, *(Action(child, 0) for child in self.children.get(name_of(state), ""))]

    def transition_all(self, state: State, actions: Sequence[Action]) -> list[State]:
        self.expanded += "".join(action.operator for action in actions)
        return [self.states[action.operator] for action in actions]

    def hairlines(self, _mesh: PolyMesh) -> int:
        return 0


class InOrder(UniformEvaluator):
    """Thinks of actions as they are listed, the first the likeliest by a hair, and expands them uniformly."""

    def prior(self, simulator: Simulator, state: State, actions: Sequence[Action]) -> FloatArray:
        priors = 1.0 - 1e-9 * np.arange(len(actions))
        return priors / priors.sum()


def _state(shape: str, name: str, total: float) -> State:
    side = 1 / (1 + "rabcdefgh".index(shape))
    return State(PolyMesh.rectangle(0, 0, side, side), Score(total / 100, 9, 0, total), action=Action(name, 0))


def name_of(state: State) -> str:
    assert state.action is not None
    return state.action.operator


PLAIN: dict[str, Any] = {"seeds": (), "n_expanded": 1, "widening": 1.0, "formula": "uct", "backup": "mean"}


def search(game: Game, root: Node | None = None, **options: Any) -> Search:
    config = MctsConfig(**{**PLAIN, **options})
    rng = np.random.default_rng(0)
    return Search(game, InOrder(), config, rng, root or Node(Track(game.states["r"])))  # type: ignore[arg-type]


def grown(game: Game, **options: Any) -> Search:
    tree = search(game, **options)
    for _ in tree.grow(Meter.unlimited()):
        pass
    return tree


def tree_of(node: Node) -> Any:
    """(name, visits, value sum, children)."""
    return (name_of(node.track.state), node.n_visits, node.value_sum, [tree_of(child) for child in node.children])


def visits(tree: Search) -> dict[str, int]:
    return {name_of(node.track.state): node.n_visits for node in tree.root.walk()}


def played(game: Game, budget: Budget | None = None, **options: Any) -> str:
    """The nodes that were ever the best, in order, of a whole search."""
    agent = MctsAgent(MctsConfig(**{**PLAIN, **options}), evaluator=InOrder())
    found = agent._search(game, Track(game.states["r"]), Meter(budget or Budget()))  # type: ignore[arg-type]
    return "".join(name_of(track.state) for track in found)
