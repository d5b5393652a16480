"""Construction sequences for tests of what replays them: an example by hand, random walks, games in the simulator."""

from dataclasses import replace
from typing import Any

from agents.baselines.random_agent import RandomAgent, RandomConfig
from autopoly_env.errors import IllegalActionError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import OPERATORS, Action
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.simulator import Simulator
from tests.helpers.drawings import noise
from tests.helpers.strategies import random_walk

SCORE = {"iou": 0.5, "complexity": 9, "self_intersections": 0, "total": 50.0}


def gabled(name: Any = "house") -> ConstructionSequence:
    """The example of docs/sequence-format.md: a gable, a cut from it to corner 2, and the right wall extruded."""
    square = PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75)
    roof = OPERATORS["edge_subdivide"].apply(square, 0)
    gable = roof.with_vertices([*roof.vertices[:4], (0.5, 0.125)])
    halves = OPERATORS["face_split"].apply(gable, 1, 3)
    wall = halves.edge_index(1, 2)
    steps = [
        (Action("edge_subdivide", 0), None, gable, SCORE),
        (Action("face_split", 1), 3, halves, SCORE),
        (Action("edge_extrude", wall), None, OPERATORS["edge_extrude"].apply(halves, wall), SCORE),
    ]
    return ConstructionSequence.record({"target": name}, square, SCORE, steps)


def walked(seed: int, n_steps: int = 40, shake: float = 0.0, operators: str = "full") -> ConstructionSequence:
    """A random walk over the operators of a preset, wherever it leads: crossings, pinches, several parts."""
    walk = random_walk(seed, operators, n_steps, shake)
    steps = [(step.action, step.choice, step.after, SCORE) for step in walk]
    return ConstructionSequence.record({"target": f"walk {seed}"}, walk[0].before, SCORE, steps)


def played(seed: int, n_steps: int = 25) -> ConstructionSequence:
    """A game of the random agent in the simulator, every vertex refitted after each step."""
    simulator = Simulator(noise(seed), resolution=32, max_steps=n_steps)
    agent = RandomAgent(RandomConfig(seed=seed, n_steps=n_steps))
    states = [simulator.initial()]
    while not states[-1].done:
        try:
            states.append(simulator.transition(states[-1], agent.act(simulator, states[-1]).action))
        except IllegalActionError:  # it has no room
            last, idle = states[-1], simulator.idle(states[-1])
            states[-1] = replace(idle, action=last.action, choice=last.choice, halfway=last.halfway)
    steps = [(state.action, state.choice, state.mesh, SCORE) for state in states[1:] if state.action is not None]
    return ConstructionSequence.record({"target": f"noise {seed}"}, states[0].mesh, SCORE, steps)
