"""Upper bounds for what learning may add: a prior that has been told the best steps that a long search has found.

What such an oracle does not reach in the place of the networks, no prior reaches there.
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

from agents.budget import Budget, Meter
from agents.guided.config import NfapPriorConfig
from agents.registry import make_agent
from agents.search.config import MctsConfig
from agents.search.evaluator import ResidualEvaluator
from agents.search.mcts import MctsAgent
from agents.solution import Solution, Track
from autopoly_env.arrays import FloatArray
from autopoly_env.mesh import Face
from autopoly_env.operators import Action
from autopoly_env.simulator import Simulator, State

TREE_ALONE: dict[str, Any] = {"seeds": [], "hop_patience": 0}
ONE_BY_ONE: dict[str, Any] = TREE_ALONE | {"n_expanded": 1, "n_simulations": 4}
_ALONE = MctsConfig(seeds=(), hop_patience=0)
_LONG = (_ALONE, replace(_ALONE, n_expanded=16), replace(_ALONE, exploration=0.2))  # trees whose best is foretold
_DOUBT = 1e-3  # of the prior is left to all other actions


class ForetoldEvaluator(ResidualEvaluator):
    """All trust in the step that was told for a mesh of these faces; elsewhere the residual prior."""

    def __init__(self, states: Sequence[State]) -> None:
        """`states`: a construction, from its first state on."""
        self._next: dict[tuple[Face, ...], Action | None] = {
            before.mesh.faces: after.action for before, after in pairwise(states)
        }

    def prior(self, simulator: Simulator, state: State, actions: Sequence[Action]) -> FloatArray:
        prior = super().prior(simulator, state, actions)
        foretold = self._next.get(state.mesh.faces)
        if foretold is not None and foretold in actions:
            prior = _DOUBT * prior
            prior[actions.index(foretold)] += 1.0 - _DOUBT
        return prior


class _Telling(MctsAgent):
    """Remembers the way to its best state."""

    best: Track | None = None

    def _search(self, simulator: Simulator, track: Track, meter: Meter) -> Iterator[Track]:
        self.best = track
        for found in super()._search(simulator, track, meter):
            self.best = found
            yield found


def told(simulator: Simulator, n_refits: int) -> list[State]:
    """The best construction that long searches of the tree have found; kept for the next budget."""
    rules = json.dumps(simulator.settings(), sort_keys=True)
    if (rules, n_refits) not in _known:
        found = []
        for config in _LONG:
            agent = _Telling(config)
            agent.solve(simulator, Budget(n_refits))
            found.append(agent.best or Track(simulator.initial()))
        _known[rules, n_refits] = max(found, key=lambda track: track.state.score.total).states()
    return _known[rules, n_refits]


_known: dict[tuple[str, int], list[State]] = {}  # by rules and refits, of this process


def solve_foretold(simulator: Simulator, budget: Budget, options: dict[str, Any]) -> tuple[Solution, int]:
    """Straight along what trees of `long` refits have found; `whole`: after a trace, and hops follow.

    A step that leads on is committed at once, also where it is worth nothing yet.
    """
    states = told(simulator, int(options["long"]))
    config = NfapPriorConfig() if options.get("whole") else _ALONE
    trusting = replace(config, n_expanded=1, n_simulations=1, patience=config.patience + len(states))
    agent = MctsAgent(trusting, [make_agent(name) for name in config.seeds], ForetoldEvaluator(states))
    solution = agent.solve(simulator, budget)
    return solution, solution.stats.n_refits
