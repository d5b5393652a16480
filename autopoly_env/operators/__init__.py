"""The topological operators, the actions that apply them, and how actions are numbered."""

from autopoly_env.operators.actions import CAPACITY_PER_VERTEX, STOP, Action, ActionCodec, describe, legal_actions
from autopoly_env.operators.edits import HOLE_SIDES, Choice
from autopoly_env.operators.holes import HoleChoice, plan_hole
from autopoly_env.operators.registry import OPERATORS, PRESETS, Operator, n_elements, preset

__all__ = [
    "CAPACITY_PER_VERTEX",
    "HOLE_SIDES",
    "OPERATORS",
    "PRESETS",
    "STOP",
    "Action",
    "ActionCodec",
    "Choice",
    "HoleChoice",
    "Operator",
    "describe",
    "legal_actions",
    "n_elements",
    "plan_hole",
    "preset",
]
