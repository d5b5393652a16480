"""Playing to learn from it: the tree search, several times on one target, and what its best tree knows.

Play number i of a round depends on (settings, round, i) and the evaluator alone.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from agents.budget import Budget
from agents.search.config import MctsConfig
from agents.search.evaluator import Evaluator
from agents.search.mcts import MctsAgent
from agents.search.tree import Node
from agents.solution import Track
from autopoly_env.arguments import at_least, share
from autopoly_env.errors import ConfigError
from autopoly_env.shown import short
from autopoly_env.simulator import Simulator
from autopoly_env.targets import HELD_OUT, LEARNING
from training.improvement.plays import Play, SearchedState, Style, simulator_of, target_of

_KINDS = ("objects", "construction")
_N_BOLDER = 4.0  # exploration of each run, in that of the one before


def check_mixture(modeller: float, w_sc: tuple[float, float]) -> None:
    """Raise ConfigError for a share of targets in the modeller's style, or a range of prices, that is none."""
    share(modeller=modeller)
    if not 0.0 < w_sc[0] <= w_sc[1] < math.inf:
        raise ConfigError(f"w_sc={short(w_sc)}: expected two prices above 0, the lower first")


@dataclass(frozen=True)
class PlayConfig:
    """How a round is played."""

    n_first: int = 360  # targets of the first round, which begins from nothing
    n_plays: int = 160  # of each later round
    modeller: float = 0.75  # share of them in the modeller's style; the others are in the paper's
    w_sc: tuple[float, float] = (0.1, 1.5)  # price of an element, evenly in its logarithm
    refits: int = 300  # of each run
    n_runs: int = 2  # on a target; the best counts
    n_states: int = 20  # kept of a play: those on the way to its best shape, then those visited most
    n_least: int = 4  # visits of a state that is kept

    def __post_init__(self) -> None:
        at_least(1, n_first=self.n_first, n_plays=self.n_plays, refits=self.refits)
        at_least(1, n_runs=self.n_runs, n_states=self.n_states, n_least=self.n_least)
        check_mixture(self.modeller, self.w_sc)

    def n_of(self, round_: int) -> int:
        """Targets of a round, from 1 on."""
        return self.n_first if round_ == 1 else self.n_plays


class _Remembering(MctsAgent):
    """The tree alone, whose trees are kept."""

    def __init__(self, config: MctsConfig, evaluator: Evaluator | None) -> None:
        super().__init__(replace(config, seeds=(), hop_patience=0), (), evaluator)
        self.roots: list[Node] = []

    def _plant(self, track: Track) -> Node:
        self.roots.append(super()._plant(track))
        return self.roots[-1]


def made_target(number: int, rng: np.random.Generator, held_out: bool) -> str:
    """The name of a target to learn from, or of one that is kept to measure with: objects and constructions in turn."""
    seeds = HELD_OUT if held_out else LEARNING
    return f"{_KINDS[number % len(_KINDS)]}:{seeds[int(rng.integers(len(seeds)))]}"


def play(config: PlayConfig, seed: int, round_: int, number: int, evaluator: Evaluator | None = None) -> Play:
    """The play of this number; without an evaluator that of `mcts` as it is."""
    rng = np.random.default_rng((seed, round_, number))
    target = made_target(number, rng, held_out=False)
    style: Style = "modeller" if rng.random() < config.modeller else "paper"
    w_sc = float(np.exp(rng.uniform(*np.log(config.w_sc))))
    silhouette = target_of(target)
    best: tuple[float, Simulator, list[Node]] | None = None
    for run in range(config.n_runs):
        simulator = simulator_of(silhouette, style, w_sc)
        exploration = MctsConfig.exploration * _N_BOLDER**run
        agent = _Remembering(MctsConfig(exploration=exploration, seed=run), evaluator)
        agent.solve(simulator, Budget(config.refits))
        total = max((_best_below(root)[root] for root in agent.roots), default=-math.inf)
        if best is None or total > best[0]:
            best = total, simulator, agent.roots
    assert best is not None
    total, simulator, roots = best
    states = [state for root in roots for state in _searched(config, simulator, root)]
    return Play(
        target, style, w_sc, config.refits, max(total, *(s.total for s in states)) if states else 0.0, tuple(states)
    )


def _best_below(root: Node) -> dict[Node, float]:
    """The best r_all of each node and all below it."""
    best: dict[Node, float] = {}
    for node in reversed(list(root.walk())):  # parents come before their children
        best[node] = max([node.total, *(best[child] for child in node.children)])
    return best


def _searched(config: PlayConfig, simulator: Simulator, root: Node) -> Iterator[SearchedState]:
    """What the tree knows of the states on the way to its best one, then of those that were visited most."""
    best = _best_below(root)
    way = set(_way_to_best(root, best.__getitem__))
    nodes = [node for node in best if node.children and (node in way or node.n_visits >= config.n_least)]
    nodes.sort(key=lambda node: (node not in way, -node.n_visits))
    for node in nodes[: config.n_states]:
        yield _state(simulator, node, best)


def _way_to_best(node: Node, value: Callable[[Node], float]) -> Iterator[Node]:
    yield node
    while node.children and value(node) > node.total:
        node = max(node.children, key=value)
        yield node


def _state(simulator: Simulator, node: Node, best: dict[Node, float]) -> SearchedState:
    mesh, actions = node.track.state.mesh, simulator.legal_actions(node.track.state)[1:]
    child_of = {child.track.state.action: child for child in node.children}
    children = [child_of.get(action) for action in actions]
    return SearchedState(
        tuple((x, y) for x, y in mesh.vertices.tolist()),
        tuple(tuple(map(int, face)) for face in mesh.faces),
        node.total,
        best[node],
        tuple((action.operator, int(action.element)) for action in actions),
        tuple(None if child is None else best[child] for child in children),
        tuple(0 if child is None else child.n_visits for child in children),
    )
