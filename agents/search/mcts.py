"""The `mcts` agents: the paper's search, and the same search as good as we could measure it to be.

After `n_simulations` of a `Search` the best child of the root is taken, and the search goes on from there. With `seeds`
it begins at the best shape that other agents have found, and again at the rectangle when that leads no further.
"""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from agents.base import Agent, Budget, Decision, Meter, Progress, Solution, Track, finish
from agents.search.config import MctsConfig
from agents.search.evaluator import Evaluator, ResidualEvaluator, UniformEvaluator
from agents.search.incumbents import play, track_of
from agents.search.search import Search
from agents.search.tree import Node
from autopoly_env.actions import STOP
from autopoly_env.simulator import Simulator, State

_EVALUATORS: dict[str, type[UniformEvaluator]] = {"residual": ResidualEvaluator, "uniform": UniformEvaluator}


class MctsAgent(Agent):
    """Monte Carlo tree search over whole transitions.

    `incumbents` are the agents that `config.seeds` names; `evaluator` replaces the one that `config.prior` names.
    """

    name = "mcts"

    def __init__(
        self, config: MctsConfig, incumbents: Sequence[Agent] = (), evaluator: Evaluator | None = None
    ) -> None:
        self._config = config
        self._incumbents = incumbents
        self._evaluator = evaluator or _EVALUATORS[config.prior]()

    def act(self, simulator: Simulator, state: State) -> Decision:
        """Search a tree of its own from `state`; STOP where nothing in it is better. No incumbents are asked."""
        rng = np.random.default_rng((self._config.seed, state.step))
        search = Search(simulator, self._evaluator, self._config, rng, Node(Track(state)))
        best_total = max((t.state.score.total for t in search.grow(Meter.unlimited())), default=state.score.total)
        chosen = search.committed()
        if chosen is None or chosen.track.state.action is None or best_total <= state.score.total:
            return Decision(STOP, value=state.score.total)
        return Decision(chosen.track.state.action, search.policy(), best_total)

    def solve(
        self,
        simulator: Simulator,
        budget: Budget | None = None,
        on_progress: Callable[[Progress], None] | None = None,
    ) -> Solution:
        """As every agent; never worse than the incumbents, whose sequences are returned as they are."""
        meter = Meter(budget or Budget(), on_progress)
        incumbents: list[Solution] = []
        initial = best = Track(simulator.initial())
        try:
            meter.add([best.state])
            for solution in play(self._incumbents, simulator, meter):
                incumbents.append(solution)
                best = _better(best, track_of(simulator, solution.sequence))
            for start in [best] if best is initial else [best, initial]:
                for track in self._search(simulator, start, meter):
                    best = _better(best, track)
        except KeyboardInterrupt:
            meter.stopped_by = "interrupted"
        found = [*incumbents, finish(simulator, best.states(), meter)]
        chosen = max(found, key=lambda solution: solution.score.total)
        return Solution(chosen.sequence, chosen.mesh, chosen.score, meter.stats())

    def _search(self, simulator: Simulator, track: Track, meter: Meter) -> Iterator[Track]:
        """Search, commit, and so on; yield every track that is the best so far."""
        rng = np.random.default_rng(self._config.seed)
        root, best_total, failures = Node(track), track.state.score.total, 0
        while not root.track.state.done and failures < self._config.patience and not meter.spent():
            search = Search(simulator, self._evaluator, self._config, rng, root)
            failures += 1
            for found in search.grow(meter):
                if found.state.score.total > best_total:
                    best_total, failures = found.state.score.total, 0
                    yield found
            chosen = search.committed()
            if chosen is None:
                return
            chosen.parent = None
            root = chosen if self._config.reuse_tree else Node(chosen.track)


def _better(first: Track, second: Track) -> Track:
    """The track to the better shape; of equals the first."""
    return second if second.state.score.total > first.state.score.total else first


class PaperMctsAgent(MctsAgent):
    """The paper's search by default."""

    name = "mcts_paper"
