"""`Search`: one tree, and the steps that grow it: select a node, expand it, play on from its children, back up."""

from collections.abc import Generator, Iterator

import numpy as np

from agents.budget import Meter
from agents.search.backup import back_up
from agents.search.config import MctsConfig
from agents.search.evaluator import Evaluator
from agents.search.selection import FORMULAS, best_half, halving_schedule, select_child
from agents.search.simulation import roll_out, value_of
from agents.search.tree import Node, ValueRange
from agents.solution import Track
from autopoly_env.mesh import canonical_hash
from autopoly_env.operators import Action
from autopoly_env.simulator import Simulator, State

_MERGE_GRID = 1 / 128  # shapes that agree to this length (unit square) count as one


class Search:
    """Finds the step to take at `root`, which may have children from an earlier search already."""

    def __init__(
        self, simulator: Simulator, evaluator: Evaluator, config: MctsConfig, rng: np.random.Generator, root: Node
    ) -> None:
        self.root = root
        self._simulator, self._evaluator, self._config, self._rng = simulator, evaluator, config, rng
        self._seen = ValueRange()
        self._candidates: list[Node] | None = None  # root children that sequential halving has left
        self._shapes: set[str] = set()
        if config.merge:
            known = [*root.track.states(), *(node.track.state for node in root.walk())]
            self._shapes.update(map(_shape, known))
        for node in root.walk():
            self._seen.add(node.total)
        if root.n_visits == 0:
            back_up(root, root.total, self._seen)

    def grow(self, meter: Meter) -> Iterator[Track]:
        """Run the simulations of one committed step; yield all that is made on the way."""
        if self._config.halving:
            yield from self._halve(meter)
            return
        for _ in range(self._config.n_simulations):
            if meter.spent():
                return
            yield from self._simulate(self.root, meter)

    def committed(self) -> Node | None:
        """The root child to go on with; of equals the first."""
        children = self._candidates or self.root.children
        if self._config.commit == "visits":
            return max(children, key=lambda child: child.n_visits, default=None)
        return max(children, key=lambda child: child.value(self._config.backup), default=None)

    def policy(self) -> dict[Action, float]:
        """Share of the visits of each root child, by its action."""
        visits = {child.track.state.action: child.n_visits for child in self.root.children}
        return {action: n / sum(visits.values()) for action, n in visits.items() if action is not None}

    def _halve(self, meter: Meter) -> Iterator[Track]:
        """Sequential halving: the root's children all alike, then the better half of them, and so on."""
        if not self.root.children and not meter.spent():
            yield from self._simulate(self.root, meter)
        self._candidates = list(self.root.children)
        if not self._candidates:
            return
        for n_each in halving_schedule(len(self._candidates), self._config.n_simulations):
            for node in self._candidates:
                for _ in range(n_each):
                    if meter.spent():
                        return
                    yield from self._simulate(node, meter)
            self._candidates = best_half(self._candidates, self._config.backup)

    def _simulate(self, start: Node, meter: Meter) -> Iterator[Track]:
        node = self._select(start)
        children = yield from self._expand(node, meter)
        if not children:
            back_up(node, node.total, self._seen, self._config.discount)
        if self._config.value == "foreseen":
            foreseen = self._evaluator.foresee(self._simulator, [child.track.state for child in children])
            for child, value in zip(children, foreseen, strict=True):
                back_up(child, float(value), self._seen, self._config.discount)
            return
        for child in children:
            n_before = self._simulator.n_refits
            played = roll_out(self._simulator, self._evaluator, child.track, self._config.n_rollout, self._rng)
            n_refits = self._simulator.n_refits - n_before
            totals = [child.total, *(track.state.score.total for track in played)]
            value = value_of(totals, self._config.value, self._config.discount)
            back_up(child, value, self._seen, self._config.discount)
            if played or n_refits:
                yield from played
                meter.add([track.state for track in played], n_refits)

    def _select(self, node: Node) -> Node:
        """Down to the first node that may have more children than it has, or can have none."""
        while True:
            if node.untried is None:
                node.untried = self._promising(node.track.state)
            room = self._config.n_expanded * node.n_visits**self._config.widening - len(node.children)
            if not node.children or (node.untried and room > 0):
                return node
            formula = FORMULAS[self._config.formula]
            node = select_child(node, formula, self._config.exploration, self._config.backup, self._seen)

    def _promising(self, state: State) -> list[tuple[Action, float]]:
        """The legal actions and their priors, the likeliest first, equals in random order."""
        actions = self._simulator.legal_actions(state)[1:]
        if not actions:
            return []
        priors = self._evaluator.prior(self._simulator, state, actions)
        order = self._rng.permutation(len(actions))
        order = order[np.argsort(-priors[order], kind="stable")]
        return [(actions[k], float(priors[k])) for k in order]

    def _expand(self, node: Node, meter: Meter) -> Generator[Track, None, list[Node]]:
        """Try the next actions of a node in one batch of refits; yield what they make, return the new children."""
        untried = node.untried or []
        batch, node.untried = dict(untried[: self._config.n_expanded]), untried[self._config.n_expanded :]
        n_before = self._simulator.n_refits
        states = self._evaluator.expand(self._simulator, node.track.state, list(batch)) if batch else []
        n_refits = self._simulator.n_refits - n_before
        fresh = [s for s in states if not self._simulator.hairlines(s.mesh) and self._is_new(s)]
        made = [Node(Track(s, node.track), node, batch[s.action]) for s in fresh if s.action]
        node.children += made
        yield from (child.track for child in made)
        meter.add_simulation(len(made))
        meter.add(states, n_refits)
        return made

    def _is_new(self, state: State) -> bool:
        """Whether the tree is to hold this shape: it has it not yet, or twins are not merged."""
        if not self._config.merge:
            return True
        n_before = len(self._shapes)
        self._shapes.add(_shape(state))
        return len(self._shapes) > n_before


def _shape(state: State) -> str:
    return canonical_hash(state.mesh, _MERGE_GRID)
