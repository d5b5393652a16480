"""Games that agents are tested on, agents that are quick, and what a solution has to be."""

from collections.abc import Callable
from typing import Any

from agents.base import Agent
from agents.budget import Progress
from agents.registry import make_agent
from agents.solution import Solution
from autopoly_env.score import score
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.simulator import Simulator
from tests.helpers.drawings import FRAME, HOUSE, ISLAND, L_SHAPE, TWO_SQUARES, noise, painted

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
    "quads": {"patience": 3, "n_polished": 2, "n_refits": 60},
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
