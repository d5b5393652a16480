"""Where labelled constructions come from: the random construction simulator, a teacher who tries everything, search.

- "simulator", the paper's: the random sequence that made a target. The action that was taken is the label.
- "teacher": from the rectangle or a traced outline, or a few random steps after it, every legal action is refitted and
  scored; all of the outcomes are the label, and the construction goes on with an action drawn from them.
- "search": the sequence that an agent found for a target. The action that was taken is the label.

Trajectory number i depends on (settings, i) alone.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from agents.budget import Budget
from agents.registry import make_agent
from agents.search.evaluator import ResidualEvaluator
from autopoly_env.arguments import above, at_least
from autopoly_env.arrays import Float32Array, FloatArray
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh, is_sane
from autopoly_env.operators import Action, preset
from autopoly_env.score import Score, ScoreWeights
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.sequence.ids import decoded
from autopoly_env.shown import short
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator, State
from autopoly_env.targets import HELD_OUT, LEARNING, ConstructionTargets, ObjectTargets
from training.networks.prices import drawn_price, prices_of
from training.networks.trajectories import STOPPED, Labelled, Trajectory

_TRACED_PRICES = (0.5, 4.0)  # of complexity, in units of the one that counts, that traced outlines are made for
_TRACED_REFITS = 50  # of each, which only meshes of quads need


@dataclass(frozen=True)
class SourceConfig:
    """What is built, and by whom."""

    source: Literal["teacher", "simulator", "search"] = "teacher"
    targets: Literal["both", "construction", "objects"] = (
        "both"  # "both": in turn; "simulator" knows constructions only
    )
    difficulty: tuple[int, int] = (1, 8)  # of the constructions
    resolution: int = 128  # pixels a side of targets and scores
    operators: str = "full"
    faces: Literal["any", "quads"] = "any"  # rule that every state keeps; quads goes with operators=modeller
    w_sc: float | tuple[float, float] = 0.3  # by which teacher and search judge; of two: drawn, evenly in its logarithm
    n_steps: int = 16  # of the teacher at most, from the rectangle
    n_traced: int = 5  # the same, from a traced outline
    traced: float = 0.4  # share of the teacher's constructions that begin at one
    n_random: int = 2  # random steps before the teacher begins, at most
    play_temperature: float = 0.5  # r_all points: how freely the teacher draws its next action
    agent: str = "greedy"  # who searches
    refits: int = 600  # for each target of the search
    seed: int = 0

    def __post_init__(self) -> None:
        if not 64 <= self.resolution <= 512:
            raise ConfigError(f"resolution {self.resolution}: expected 64 to 512 pixels a side")
        at_least(1, n_steps=self.n_steps, n_traced=self.n_traced, refits=self.refits)
        at_least(0, n_random=self.n_random, seed=self.seed)
        if not 0.0 <= self.traced <= 1.0:
            raise ConfigError(f"traced = {self.traced}: expected a share, 0 to 1")
        above(0, play_temperature=self.play_temperature)
        low, high = prices_of(self.w_sc)
        if not 0.0 < low <= high < math.inf:
            raise ConfigError(f"w_sc = {short(self.w_sc)}: expected one price above 0, or two, the lower first")
        preset(self.operators)
        if self.faces != "any" and self.source == "simulator":
            raise ConfigError(f"source=simulator builds meshes of any faces, not of {self.faces}: give source=teacher")


def build_trajectory(config: SourceConfig, number: int, held_out: bool = False) -> Trajectory:
    """The labelled construction of this number; held-out ones are of other targets."""
    rng = np.random.default_rng((config.seed, number, int(held_out)))
    seeds = HELD_OUT if held_out else LEARNING
    seed = seeds[int(rng.integers(len(seeds)))]
    if config.source == "simulator":
        targets = _constructions(config)
        return _from_sequence(config, targets.sample(seed), targets.sample_sequence(seed))
    silhouette = _target(config, seed, number)
    simulator = _simulator(config, silhouette, drawn_price(rng, *prices_of(config.w_sc)))
    if config.source == "search":
        found = make_agent(config.agent).solve(simulator, Budget(refits=config.refits))
        return _from_sequence(config, silhouette, found.sequence)
    return _taught(config, simulator, rng)


def _simulator(config: SourceConfig, silhouette: Silhouette, w_sc: float) -> Simulator:
    weights = ScoreWeights(w_sc=w_sc)
    return Simulator(
        silhouette, operators=config.operators, resolution=config.resolution, weights=weights, faces=config.faces
    )


def _constructions(config: SourceConfig) -> ConstructionTargets:
    operators = config.operators if config.faces == "any" else "full"  # targets are the same under every rule
    return ConstructionTargets(config.difficulty, operators, config.resolution)


def _target(config: SourceConfig, seed: int, number: int) -> Silhouette:
    if config.targets == "construction" or (config.targets == "both" and number % 2 == 0):
        return _constructions(config).sample(seed)
    return ObjectTargets(resolution=config.resolution).sample(seed)


def _taught(config: SourceConfig, simulator: Simulator, rng: np.random.Generator) -> Trajectory:
    """A start, random steps, then the teacher's."""
    traced = bool(rng.random() < config.traced)
    n_steps = config.n_traced if traced else config.n_steps
    state = simulator.initial(_traced_mesh(config, simulator, rng) if traced else None)
    for _ in range(int(rng.integers(config.n_random + 1))):
        actions = simulator.legal_actions(state)[1:]
        made = simulator.transition_all(state, [actions[int(rng.integers(len(actions)))]]) if actions else []
        if made and is_sane(made[0].mesh, config.faces):
            state = made[0]
    states: list[Labelled] = []
    while len(states) < n_steps and not state.done:
        labelled, following = _teach(config, simulator, state, rng)
        states.append(labelled)
        if following is None:
            return Trajectory(simulator.silhouette.mask, tuple(states), ended=True, faces=config.faces)
        state = following
    states.append(Labelled(state.mesh, _parts(state.score), (), *_unknown(0), STOPPED))
    return Trajectory(simulator.silhouette.mask, tuple(states), ended=bool(state.done), faces=config.faces)


def _traced_mesh(config: SourceConfig, simulator: Simulator, rng: np.random.Generator) -> PolyMesh:
    """The best outline, or mesh of quads, for a price of complexity near the one that counts."""
    w_sc = simulator.weights.w_sc * drawn_price(rng, *_TRACED_PRICES)
    agent = make_agent("trace" if config.faces == "any" else "quads")
    return agent.solve(_simulator(config, simulator.silhouette, w_sc), Budget(refits=_TRACED_REFITS)).mesh


def _teach(
    config: SourceConfig, simulator: Simulator, state: State, rng: np.random.Generator
) -> tuple[Labelled, State | None]:
    """All outcomes in a state, and the state that the teacher goes on to; None where it stops."""
    actions = simulator.legal_actions(state)[1:]
    rows = {action: row for row, action in enumerate(actions)}
    outcomes, log_residual = _unknown(len(actions))
    children = [child for child in simulator.transition_all(state, actions) if is_sane(child.mesh, config.faces)]
    for child in children:
        outcomes[_row(rows, child)] = _parts(child.score)
    gains = np.array([0.0, *(child.score.total - state.score.total for child in children)])
    probabilities = np.exp((gains - gains.max()) / config.play_temperature)
    drawn = int(rng.choice(len(gains), p=probabilities / probabilities.sum())) - 1
    following = children[drawn] if drawn >= 0 else None
    chosen = STOPPED if following is None else _row(rows, following)
    log_residual[:] = _log_residual(simulator, state, actions)
    return Labelled(state.mesh, _parts(state.score), tuple(actions), outcomes, log_residual, chosen), following


def _row(rows: dict[Action, int], child: State) -> int:
    assert child.action is not None  # it came from a transition
    return rows[child.action]


def _from_sequence(config: SourceConfig, silhouette: Silhouette, sequence: ConstructionSequence) -> Trajectory:
    """The states that a sequence goes through, with the action taken as their label; after the last one, stop."""
    simulator = _simulator(config, silhouette, prices_of(config.w_sc)[0])
    states = []
    for mesh, step in zip(sequence.meshes(), (*sequence.steps, None), strict=True):
        taken = None
        if step is not None:
            _, element, _ = decoded(mesh, step)
            taken = Action(step.operator, element)
        states.append(_hard(simulator, mesh, taken))
    return Trajectory(silhouette.mask, tuple(states), ended=True, faces=config.faces)


def _hard(simulator: Simulator, mesh: PolyMesh, taken: Action | None) -> Labelled:
    state = State(mesh, simulator.score(mesh))
    actions = simulator.legal_actions(state)[1:]
    chosen = STOPPED if taken is None else actions.index(taken)
    outcomes, log_residual = _unknown(len(actions))
    log_residual[:] = _log_residual(simulator, state, actions)
    return Labelled(mesh, _parts(state.score), tuple(actions), outcomes, log_residual, chosen)


def _log_residual(simulator: Simulator, state: State, actions: Sequence[Action]) -> FloatArray:
    return np.log(ResidualEvaluator().prior(simulator, state, actions))


def _parts(score: Score) -> Float32Array:
    return np.array((score.iou, score.complexity, score.self_intersections), np.float32)


def _unknown(n: int) -> tuple[Float32Array, Float32Array]:
    return np.full((n, 3), np.nan, np.float32), np.zeros(n, np.float32)
