"""Backpropagation: carry what a simulation was worth to all nodes it passed through."""

from agents.search.tree import Node, ValueRange


def back_up(node: Node, value: float, seen: ValueRange, discount: float = 1.0) -> None:
    """Count a visit and add `value` at the node and at all above it, times `discount` per level."""
    step: Node | None = node
    while step is not None:
        step.n_visits += 1
        step.value_sum += value
        step.best_value = max(step.best_value, value)
        seen.add(value)
        value *= discount
        step = step.parent
