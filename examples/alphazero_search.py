"""AlphaZero's search on the public API: `python -m examples.alphazero_search examples/mug.png`.

A round walks down the tree `batch` times, each walk as if those before it had lost (a virtual loss), makes the states
that it came to with one `Simulator.step_many`, asks an evaluator for priors and values, and backs these up (Silver et
al. 2017). The evaluator here needs no network: all actions are as likely, and a shape is worth its r_all.
"""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from autopoly_env.operators import Action
from autopoly_env.silhouette import load_silhouette
from autopoly_env.simulator import Simulator, State

C = 1.0  # how much priors weigh against values
Evaluator = Callable[[Simulator, Sequence[State]], list[tuple[dict[Action, float], float]]]  # priors, value


@dataclass
class Node:
    """A state that was reached, or an action that nobody has taken yet."""

    prior: float
    state: State | None = None
    children: dict[Action, "Node"] = field(default_factory=dict)
    n_visits: int = 0
    n_virtual: int = 0  # walks that are under way
    total: float = 0.0  # of the values backed up


def by_score(simulator: Simulator, states: Sequence[State]) -> list[tuple[dict[Action, float], float]]:
    """Every action as likely; r_all as the value."""
    pairs = zip(simulator.legal_many(states), states, strict=True)
    return [({action: 1.0 / len(legal) for action in legal}, state.score.total) for legal, state in pairs]


def select(node: Node, low: float, high: float) -> Action:
    """The action with the highest Q + C P sqrt(N) / (1 + n); one that was not taken yet has its parent's Q."""

    def score(child: Node) -> float:
        n = child.n_visits + child.n_virtual
        mean = (child.total + low * child.n_virtual) / n if n else node.total / max(node.n_visits, 1)
        worth = (mean - low) / (high - low) if high > low else 0.0
        return worth + C * child.prior * node.n_visits**0.5 / (1 + n)

    return max(node.children, key=lambda action: score(node.children[action]))


def search(
    simulator: Simulator, n_simulations: int, evaluate: Evaluator = by_score, batch: int = 8
) -> tuple[State, list[Action]]:
    """The best state that was seen, and the actions that lead to it."""
    root = Node(1.0, simulator.initial())
    ((priors, low),) = evaluate(simulator, [root.state])
    root.children = {action: Node(prior) for action, prior in priors.items()}
    high, best = low, (root.state, [])
    for _ in range(-(-n_simulations // batch)):
        leaves: dict[int, tuple[list[Node], list[Action]]] = {}
        for _ in range(batch):
            node, path, actions = root, [root], []
            while node.children:
                actions.append(select(node, low, high))
                node = node.children[actions[-1]]
                path.append(node)
            for node in path:
                node.n_virtual += 1
            leaves.setdefault(id(node), (path, actions))
        paths = list(leaves.values())
        fresh = [pair for pair in paths if pair[0][-1].state is None]
        made = simulator.step_many([path[-2].state for path, _ in fresh], [actions[-1] for _, actions in fresh])
        for (path, actions), state in zip(fresh, made, strict=True):
            path[-1].state = state
            if state is None:  # there is no room for it after all
                del path[-2].children[actions[-1]]
        paths = [pair for pair in paths if pair[0][-1].state is not None]
        told = evaluate(simulator, [path[-1].state for path, _ in paths])
        for (path, actions), (priors, value) in zip(paths, told, strict=True):
            low, high = min(low, value), max(high, value)
            path[-1].children = {action: Node(prior) for action, prior in priors.items()}
            if value > best[0].score.total:
                best = path[-1].state, actions
            for node in path:
                node.n_visits, node.total = node.n_visits + 1, node.total + value
        reset(root)
    return best


def reset(node: Node) -> None:
    node.n_virtual = 0  # no walk is under way any more
    for child in node.children.values():
        if child.n_virtual:
            reset(child)


if __name__ == "__main__":
    simulator = Simulator(load_silhouette(sys.argv[1]), max_steps=20)
    state, actions = search(simulator, 400)
    print(f"r_all {simulator.initial().score.total:.1f} before, {state.score.total:.1f} after:")
    print(*(f"{action.operator} {action.element}" for action in actions), sep="\n")
