"""The end of a solve: from states to a solution that is polished, pared, told without detours and settled."""

from agents.finish.finishing import finish

__all__ = ["finish"]
