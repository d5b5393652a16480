"""The search tree: nodes that hold states, and the statistics of the ways between them."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from agents.solution import Track
from autopoly_env.arrays import FloatArray
from autopoly_env.operators import Action


@dataclass(eq=False)
class Node:
    """A state in the tree. `value_sum` and `best_value` are of the values that were backed up through it."""

    track: Track
    parent: "Node | None" = None
    prior: float = 1.0  # of the action that led here
    n_visits: int = 0
    value_sum: float = 0.0
    best_value: float = float("-inf")
    children: list["Node"] = field(default_factory=list)
    untried: list[tuple[Action, float]] | None = None  # actions without a child and their priors, the likeliest first

    @property
    def total(self) -> float:
        """r_all of the node's own state."""
        return self.track.state.score.total

    def value(self, backup: str) -> float:
        """The best ("max") or the mean of what was backed up; an unvisited node is worth what its parent is."""
        if self.n_visits == 0:
            return self.total if self.parent is None else self.parent.value(backup)
        return self.best_value if backup == "max" else self.value_sum / self.n_visits

    def walk(self) -> Iterator["Node"]:
        """This node and all below it."""
        stack = [self]
        while stack:
            node = stack.pop()
            yield node
            stack.extend(node.children)


@dataclass
class ValueRange:
    """The least and the largest value seen in a tree, by which values are brought to 0..1 before they meet priors."""

    low: float = float("inf")
    high: float = float("-inf")

    def add(self, value: float) -> None:
        """Widen the range to hold `value`."""
        self.low, self.high = min(self.low, value), max(self.high, value)

    def normalised(self, values: FloatArray) -> FloatArray:
        """Values on a scale from 0, the least seen, to 1, the largest; all 0.5 while there is only one."""
        if not self.high > self.low:
            return np.full_like(values, 0.5)
        return (values - self.low) / (self.high - self.low)
