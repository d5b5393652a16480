"""What tests of agents share: targets, agents that are soon done, Ctrl-C at a chosen moment, a game drawn by hand."""

from collections.abc import Callable
from typing import Any

from agents.base import Agent
from agents.baselines.beam import BeamAgent, BeamConfig
from agents.budget import Budget, Meter, Progress
from agents.registry import make_agent
from agents.solution import Solution, Track
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import Action
from autopoly_env.score import Score, ScoreWeights, score
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.simulator import Simulator, State
from tests.drawings import FRAME, HOUSE, ISLAND, L_SHAPE, TWO_SQUARES, noise, painted

TARGETS = {
    "house": painted(HOUSE),
    "L": painted(L_SHAPE),
    "frame": painted(FRAME),
    "two squares": painted(TWO_SQUARES),
    "island": painted(ISLAND),
    "blobs": noise(3, 40),
}


def simulator(target: str = "house", **settings: Any) -> Simulator:
    return Simulator(TARGETS[target], **{"resolution": 32, **settings})


QUICK: dict[str, dict[str, Any]] = {
    "beam": {"width": 2, "patience": 2},
    "random": {"n_steps": 8},
    "climb": {"n_rounds": 1},
    "mcts": {"seeds": (), "n_simulations": 4, "patience": 1},
    "mcts_paper": {"n_simulations": 4, "patience": 1, "n_rollout": 1},
    "oracle": {"width": 2, "patience": 1},
}


def quick(name: str, **options: Any) -> Agent:
    """The agent with settings that keep a test short."""
    return make_agent(name, **{**QUICK.get(name, {}), **options})


def interrupt_at(call: int) -> Callable[[Progress], None]:
    """Ctrl-C in the call-th report of progress, from 1."""
    n_calls = iter(range(1, call + 1))

    def report(_: Progress) -> None:
        if next(n_calls) == call:
            raise KeyboardInterrupt

    return report


def assert_consistent(solution: Solution, game: Simulator) -> None:
    """The sequence builds the mesh bit for bit, is cut at its best, and the score is what the mesh is worth."""
    sequence = ConstructionSequence.from_json(solution.sequence.to_json())
    assert sequence.final() == solution.mesh
    assert sequence.final().vertices.tobytes() == solution.mesh.vertices.tobytes()
    silhouette = game.silhouette
    assert solution.score == score(solution.mesh, silhouette.target(silhouette.resolution), game.weights)
    scores = [sequence.start_score, *(step.score for step in sequence.steps)]
    assert scores[-1] == solution.score.as_dict()
    assert sequence.best_prefix() == sequence
    assert [game.final_score(mesh).as_dict() for mesh in sequence.meshes()] == scores
    assert sequence.settings == {**game.settings(), "scored_at": silhouette.resolution}
    assert {step.operator for step in sequence.steps} <= set(game.operators)
    assert len(sequence.steps) <= game.max_steps


class Tree:
    """A game drawn by hand: totals and children by name. `visited` are the nodes whose children were asked for."""

    weights = ScoreWeights(w_sc=1.0)

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
