"""How good a policy is: r_all of what it builds of unseen targets, in one greedy episode each.

All episodes run at the same time, so that the network looks at many states at once.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from agents.rl.config import TaskSpec
from agents.rl.network import NEVER, MeshNet
from agents.rl.player import Player
from autopoly_env.arrays import IntArray
from autopoly_env.compute import Routine, run_all
from autopoly_env.errors import IllegalActionError
from autopoly_env.operators import STOP, Action
from autopoly_env.score import ScoreWeights
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator, State
from autopoly_env.targets import HELD_OUT
from training.policies.config import EnvConfig

_BATCH = 64  # episodes at once


@dataclass(frozen=True)
class Evaluation:
    """Targets of one kind, and the price that they are built for."""

    name: str
    simulators: tuple[Simulator, ...]

    @classmethod
    def of(
        cls, name: str, silhouettes: Sequence[Silhouette], task: TaskSpec, operators: Sequence[str], resolution: int
    ) -> "Evaluation":
        """An evaluation on these targets, at a resolution in pixels a side; prices of a range are taken in turn."""
        names, n = ",".join(operators), len(silhouettes)
        prices = [task.price_at((k + 0.5) / n) for k in range(n)]
        return cls(
            name,
            tuple(
                Simulator(
                    one, operators=names, resolution=resolution, weights=ScoreWeights(w_sc=w_sc), faces=task.faces
                )
                for one, w_sc in zip(silhouettes, prices, strict=True)
            ),
        )

    def run(self, player: Player) -> "Metrics":
        """One greedy episode on each target."""
        episodes = [
            states
            for begin in range(0, len(self.simulators), _BATCH)
            for states in play_all(player, self.simulators[begin : begin + _BATCH])
        ]
        return Metrics(
            start=float(np.mean([states[0].score.total for states in episodes])),
            final=float(np.mean([states[-1].score.total for states in episodes])),
            best=float(np.mean([max(state.score.total for state in states) for states in episodes])),
            steps=float(np.mean([len(states) - 1 for states in episodes])),
            elements=float(np.mean([states[-1].score.complexity for states in episodes])),
            refits=float(np.mean([sum(state.n_refits for state in states) for states in episodes])),
        )


@dataclass(frozen=True)
class Metrics:
    """Means over the targets."""

    start: float  # r_all of the rectangle
    final: float  # r_all of the shape at the end
    best: float  # r_all of the best shape on the way, which is what an agent returns
    steps: float
    elements: float  # V + E + F
    refits: float


def play_all(player: Player, simulators: Sequence[Simulator]) -> list[list[State]]:
    """The states of a greedy episode, always taking the likeliest action, in each simulator."""
    episodes = [[state] for state in run_all(simulator.initial_routine() for simulator in simulators)]
    going = [k for k, states in enumerate(episodes) if not states[-1].done]
    for _ in range(player.spec.max_steps):
        if not going:
            break
        logits = player.logits([simulators[k] for k in going], [episodes[k][-1] for k in going], exact=False)
        orders = [np.argsort(-row, kind="stable")[: int((row > 0.5 * NEVER).sum())] for row in logits]
        steps = (_step(player, simulators[k], episodes[k][-1], order) for k, order in zip(going, orders, strict=True))
        made = run_all(steps)
        still = []
        for k, state in zip(going, made, strict=True):
            if state is not None:
                episodes[k].append(state)
                still += [] if state.done else [k]
        going = still
    return episodes


def _step(player: Player, simulator: Simulator, state: State, order: IntArray) -> Routine[State | None]:
    """The state after the first action in order that there is room for; None where that is STOP."""
    for index in order:
        action: Action = player.codec.decode(int(index))
        if action == STOP:
            return None
        try:
            return (yield from simulator.transition_routine(state, action))
        except IllegalActionError:
            continue
    return None


def evaluations_of(env: EnvConfig, n: int, resolution: int) -> tuple[Evaluation, ...]:
    """An evaluation on `n` held-out targets for each task; those of a folder of images have been seen."""
    spec = env.spec()
    evaluations: list[Evaluation] = []
    for number, task in enumerate(env.tasks()):
        source = task.source()
        silhouettes = [source.sample(seed) for seed in HELD_OUT[:n]]
        name = task.targets if task.targets in ("construction", "objects") else "images"
        if name in [known.name for known in evaluations]:
            name = f"{name}{number}"
        evaluations.append(Evaluation.of(name, silhouettes, task, task.operators_of(spec), resolution))
    return tuple(evaluations)


def evaluate(evaluations: Sequence[Evaluation], net: MeshNet) -> dict[str, Metrics]:
    """The metrics of a network in each evaluation."""
    player = Player(net)
    return {evaluation.name: evaluation.run(player) for evaluation in evaluations}


def mean_final(metrics: Mapping[str, Metrics]) -> float:
    """The mean r_all at the end, each evaluation weighing the same."""
    return float(np.mean([one.final for one in metrics.values()]))


def mean_start(metrics: Mapping[str, Metrics]) -> float:
    """The mean r_all of the rectangles, each evaluation weighing the same."""
    return float(np.mean([one.start for one in metrics.values()]))


def flat(metrics: Mapping[str, Metrics]) -> dict[str, float]:
    """The metrics by the names EVALUATION_METRIC, as logs and weights keep them."""
    return {f"{name}_{key}": value for name, one in metrics.items() for key, value in vars(one).items()}


def summary(metrics: Mapping[str, Metrics]) -> str:
    """The metrics in words."""
    return "; ".join(
        f"{name} r_all {one.final:.2f} (rectangle {one.start:.2f}) in {one.steps:.1f} steps"
        for name, one in metrics.items()
    )
