"""How good a policy is: r_all of what it builds of unseen targets, in one greedy play each.

All targets are played at the same time, so that the network looks at many states at once.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from agents.rl.network import MeshNet
from agents.rl.player import Player
from autopoly_env.compute import Routine, run_all
from autopoly_env.errors import IllegalActionError
from autopoly_env.operators import STOP, Action
from autopoly_env.score import ScoreWeights
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator, State
from autopoly_env.targets import HELD_OUT, ConstructionTargets, TargetSource, make_targets
from training.policies.config import EnvConfig

_BATCH = 64  # games at once


@dataclass(frozen=True)
class Exam:
    """Targets of one kind, and the price that they are built for."""

    name: str
    simulators: tuple[Simulator, ...]

    @classmethod
    def of(
        cls, name: str, silhouettes: Iterable[Silhouette], w_sc: float, operators: Sequence[str], resolution: int
    ) -> "Exam":
        """The games, at a resolution in pixels a side."""
        rules = {"operators": ",".join(operators), "resolution": resolution, "weights": ScoreWeights(w_sc=w_sc)}
        return cls(name, tuple(Simulator(silhouette, **rules) for silhouette in silhouettes))  # type: ignore[arg-type]

    def sit(self, player: Player) -> "Marks":
        """Play all of them."""
        played = [
            path
            for begin in range(0, len(self.simulators), _BATCH)
            for path in play_all(player, self.simulators[begin : begin + _BATCH])
        ]
        return Marks(
            start=float(np.mean([path[0].score.total for path in played])),
            final=float(np.mean([path[-1].score.total for path in played])),
            best=float(np.mean([max(state.score.total for state in path) for path in played])),
            steps=float(np.mean([len(path) - 1 for path in played])),
            elements=float(np.mean([path[-1].score.complexity for path in played])),
            refits=float(np.mean([sum(state.n_refits for state in path) for path in played])),
        )


@dataclass(frozen=True)
class Marks:
    """Means over the targets."""

    start: float  # r_all of the rectangle
    final: float  # r_all of the shape at the end
    best: float  # r_all of the best shape on the way, which is what an agent returns
    steps: float
    elements: float  # V + E + F
    refits: float


def play_all(player: Player, simulators: Sequence[Simulator]) -> list[list[State]]:
    """The states that the policy, always taking the likeliest action, goes through in each game."""
    paths = [[state] for state in run_all(simulator.initial_routine() for simulator in simulators)]
    going = [k for k, path in enumerate(paths) if not path[-1].done]
    for _ in range(player.rules.max_steps):
        if not going:
            break
        logits = player.logits([simulators[k] for k in going], [paths[k][-1] for k in going])
        orders = [np.argsort(-row, kind="stable") for row in logits]
        turns = (_turn(player, simulators[k], paths[k][-1], order) for k, order in zip(going, orders, strict=True))
        made = run_all(turns)
        still = []
        for k, state in zip(going, made, strict=True):
            if state is not None:
                paths[k].append(state)
                still += [] if state.done else [k]
        going = still
    return paths


def _turn(player: Player, simulator: Simulator, state: State, order: np.ndarray) -> Routine[State | None]:
    """The state after the likeliest action that there is room for; None where that is STOP."""
    legal = player.legal_mask(simulator, state)
    for index in order[: int(legal.sum())]:
        action: Action = player.codec.decode(int(index))
        if action == STOP:
            return None
        try:
            return (yield from simulator.transition_routine(state, action))
        except IllegalActionError:
            continue
    return None


def exams_of(env: EnvConfig, n: int, resolution: int) -> tuple[Exam, ...]:
    """An exam of `n` unseen targets for each course; those of a folder of images have been seen."""
    operators = env.rules().operators
    exams: list[Exam] = []
    for number, course in enumerate(env.courses):
        if course.targets == "construction":
            source: TargetSource = ConstructionTargets(course.difficulty, course.operators)
        else:
            source = make_targets(course.targets)
        silhouettes = [source.sample(seed) for seed in HELD_OUT[:n]]
        name = course.targets if course.targets in ("construction", "objects") else "images"
        known = [exam.name for exam in exams]
        exams.append(
            Exam.of(name if name not in known else f"{name}{number}", silhouettes, course.w_sc, operators, resolution)
        )
    return tuple(exams)


def sit_all(exams: Sequence[Exam], net: MeshNet) -> dict[str, Marks]:
    """The marks of a network in each exam."""
    player = Player(net)
    return {exam.name: exam.sit(player) for exam in exams}


def mean_final(marks: Mapping[str, Marks]) -> float:
    """The mean r_all at the end, each exam weighing the same."""
    return float(np.mean([one.final for one in marks.values()]))


def told(marks: Mapping[str, Marks]) -> str:
    """In words."""
    return "; ".join(
        f"{name} r_all {one.final:.2f} (rectangle {one.start:.2f}) in {one.steps:.1f} steps"
        for name, one in marks.items()
    )
