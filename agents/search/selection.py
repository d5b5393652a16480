"""The tree policy: which child to go to. Values are normalised to 0..1 before they are weighed against visits.

Letters: C children of a node.
"""

from collections.abc import Callable, Sequence

import numpy as np

from agents.search.tree import Node, ValueRange
from autopoly_env.arrays import FloatArray

# (values (C,) 0..1, visits (C,), priors (C,), visits of the parent, exploration constant) -> scores (C,)
Formula = Callable[[FloatArray, FloatArray, FloatArray, int, float], FloatArray]


def uct(values: FloatArray, visits: FloatArray, _priors: FloatArray, n_parent: int, c: float) -> FloatArray:
    """Q + c sqrt(ln N / n) (Kocsis and Szepesvari 2006); an unvisited child comes first."""
    bonus = np.sqrt(np.log(max(n_parent, 1)) / np.maximum(visits, 1.0))
    return np.where(visits > 0, values + c * bonus, np.inf)


def puct(values: FloatArray, visits: FloatArray, priors: FloatArray, n_parent: int, c: float) -> FloatArray:
    """Q + c P sqrt(N) / (1 + n) (Silver et al. 2017)."""
    return values + c * priors * np.sqrt(max(n_parent, 1)) / (1.0 + visits)


FORMULAS: dict[str, Formula] = {"uct": uct, "puct": puct}


def select_child(node: Node, formula: Formula, c: float, backup: str, seen: ValueRange) -> Node:
    """The child with the highest score; of equals the first."""
    values = seen.normalised(np.array([child.value(backup) for child in node.children]))
    visits = np.array([child.n_visits for child in node.children], float)
    priors = np.array([child.prior for child in node.children])
    return node.children[int(np.argmax(formula(values, visits, priors, node.n_visits, c)))]


def halving_schedule(n_candidates: int, n_simulations: int) -> list[int]:
    """Simulations of each candidate that is left, for every round of sequential halving (Karnin et al. 2013).

    At least one each, so many candidates may take more than `n_simulations` in all.

    >>> halving_schedule(4, 16)
    [2, 4]
    """
    n_rounds = max(1, (n_candidates - 1).bit_length())
    left = [-(-n_candidates // 2**k) for k in range(n_rounds)]
    return [max(1, n_simulations // (n_rounds * n)) for n in left]


def best_half(nodes: Sequence[Node], backup: str) -> list[Node]:
    """The better half of some nodes, the odd one included; of equals the first."""
    return sorted(nodes, key=lambda node: -node.value(backup))[: (len(nodes) + 1) // 2]
