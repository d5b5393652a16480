"""The topological operators, a file each; the actions that apply them, and how actions are numbered."""

from autopoly_env.operators.action import STOP, Action, Choice, Halfway, Start
from autopoly_env.operators.codec import ActionCodec, describe, legal_actions
from autopoly_env.operators.elements import CAPACITY_PER_VERTEX, CORNER, EDGE, FACE, HOLE, VERTEX, ElementKind
from autopoly_env.operators.hole_kernels import HOLE_SIDES
from autopoly_env.operators.holes import HoleChoice, plan_hole
from autopoly_env.operators.operator import Operator
from autopoly_env.operators.registry import OPERATORS, PRESETS, operator_named, preset, register

__all__ = [
    "CAPACITY_PER_VERTEX",
    "CORNER",
    "EDGE",
    "FACE",
    "HOLE",
    "HOLE_SIDES",
    "OPERATORS",
    "PRESETS",
    "STOP",
    "VERTEX",
    "Action",
    "ActionCodec",
    "Choice",
    "ElementKind",
    "Halfway",
    "HoleChoice",
    "Operator",
    "Start",
    "describe",
    "legal_actions",
    "operator_named",
    "plan_hole",
    "preset",
    "register",
]
