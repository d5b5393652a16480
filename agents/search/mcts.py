"""The `mcts` agents: the paper's search, and the same search as good as we could measure it to be.

After `n_simulations` of a `Search` the best child of the root is taken, and the search goes on from there. With `seeds`
it begins at the best shape that other agents have found, and again at the rectangle when that leads no further.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from agents.base import Agent, Decision
from agents.budget import Budget, Meter, Progress
from agents.climb.hill import Hill
from agents.climb.hop import hop
from agents.climb.tops import Tops
from agents.finish import finish
from agents.search.config import MctsConfig
from agents.search.evaluator import Evaluator, ResidualEvaluator, UniformEvaluator
from agents.search.incumbents import play, track_of
from agents.search.search import Search
from agents.search.tree import Node
from agents.solution import Solution, Track
from autopoly_env.operators import STOP
from autopoly_env.simulator import Simulator, State

_LEAST_SHARE = 0.16  # of `n_refits` for the search, however much the incumbents took
_EVALUATORS: dict[str, type[UniformEvaluator]] = {"residual": ResidualEvaluator, "uniform": UniformEvaluator}


class MctsAgent(Agent):
    """Monte Carlo tree search over whole transitions.

    `incumbents` are the agents that `config.seeds` names; `evaluator` replaces the one that `config.prior` names.
    """

    name = "mcts"
    runs_simulations = True

    def __init__(
        self, config: MctsConfig, incumbents: Sequence[Agent] = (), evaluator: Evaluator | None = None
    ) -> None:
        self._config = config
        self._incumbents = incumbents
        self._evaluator = evaluator or _EVALUATORS[config.prior]()

    def act(self, simulator: Simulator, state: State) -> Decision:
        """Search a tree of its own from `state`; STOP where nothing in it is better. No incumbents are asked."""
        return self.decide(simulator, state, Meter.unlimited())

    def decide(self, simulator: Simulator, state: State, meter: Meter) -> Decision:
        """`act`, as long as the meter lets it."""
        rng = np.random.default_rng((self._config.seed, state.step))
        search = Search(simulator, self._evaluator, self._config, rng, Node(Track(state)))
        best_total = max((t.state.score.total for t in search.grow(meter)), default=state.score.total)
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
        """As every agent; never worse than the incumbents.

        Without a budget each incumbent runs to its end, as it does alone; the search has what they leave of
        `config.n_refits`, or a share of it where they leave less.
        """
        meter = Meter(budget or Budget(), on_progress)
        finds = _Finds(Track(simulator.initial()), Tops(Hill(simulator)) if self._hops(simulator) else None)
        try:
            meter.add([finds.best.state])
            if finds.best.state.done in ("", "matched"):  # a rectangle that matches may have a corner too many
                self._run_stages(simulator, finds, meter, is_free=budget is None or budget == Budget())
        except KeyboardInterrupt:
            meter.stopped_by = "interrupted"
        return finds.solution(simulator, meter)

    def _run_stages(self, simulator: Simulator, finds: "_Finds", meter: Meter, *, is_free: bool) -> None:
        """Seeds; a tree from the best shape and one from the rectangle; hops from outline to outline."""
        initial = finds.best
        for solution in play(self._incumbents, simulator, meter):
            finds.incumbents.append(solution)
            finds.offer(simulator, track_of(simulator, solution.sequence))
        if initial.state.done:
            return
        if is_free:
            n_most = self._config.n_refits
            n_left = max(n_most - meter.stats().n_refits, round(_LEAST_SHARE * n_most))
            search = Meter(Budget(n_left), whole=meter)
            self._search_all(simulator, finds, search, initial)
            meter.stopped_by = search.stopped_by
        else:
            self._search_all(simulator, finds, meter, initial)

    def _search_all(self, simulator: Simulator, finds: "_Finds", meter: Meter, initial: Track) -> None:
        for start in [initial] if finds.best is initial else [finds.best, initial]:
            part = meter.part(1.0 if finds.tops is None else self._config.tree_share)
            for track in self._search(simulator, start, part):
                finds.offer(simulator, track)
        if finds.tops is not None:
            for mesh in (finds.best.state.mesh, *(solution.mesh for solution in finds.incumbents)):
                finds.tops.add_mesh(mesh)
            rng = np.random.default_rng(self._config.seed)
            for top in hop(finds.tops.hill, finds.tops.places(), self._config.hop_patience, rng, meter):
                finds.tops.add(top)

    def _hops(self, simulator: Simulator) -> bool:
        """Whether the search goes on among outlines, which heed no guidance and no rule of faces."""
        return self._config.hop_patience > 0 and not simulator.guidance.names and simulator.faces == "any"

    def _search(self, simulator: Simulator, track: Track, meter: Meter) -> Iterator[Track]:
        """Search, commit, and so on; yield every track that is the best so far."""
        rng = np.random.default_rng(self._config.seed)
        root, best_total, failures = self._plant(track), track.state.score.total, 0
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
            root = chosen if self._config.reuse_tree else self._plant(chosen.track)

    def _plant(self, track: Track) -> Node:
        """The root of a new tree."""
        return Node(track)


@dataclass
class _Finds:
    """What the stages of a search have found so far."""

    best: Track
    tops: Tops | None  # None where the search does not go on among outlines
    incumbents: list[Solution] = field(default_factory=list)

    def offer(self, simulator: Simulator, track: Track) -> None:
        """Keep the track if it leads to a better shape than the best so far."""
        if simulator.standing(track.state) > simulator.standing(self.best.state):
            self.best = track

    def solution(self, simulator: Simulator, meter: Meter) -> Solution:
        """The best of everything, finished."""
        found = [*self.incumbents, finish(simulator, self.best.states(), meter)]
        if self.tops is not None and self.tops.places():
            found.append(finish(simulator, self.tops.built(), meter))
        chosen = max(found, key=lambda solution: simulator.worth(solution.mesh))
        return Solution(chosen.sequence, chosen.mesh, chosen.score, meter.stats())


class PaperMctsAgent(MctsAgent):
    """The paper's search by default."""

    name = "mcts_paper"
