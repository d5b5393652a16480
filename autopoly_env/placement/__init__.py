"""Where an action's new vertices start: what rendering and target disagree about, and what to do about it."""

from autopoly_env.placement.starting import Disagreement, Start, hole_shapes, leaves_outline_alone, starts

__all__ = ["Disagreement", "Start", "hole_shapes", "leaves_outline_alone", "starts"]
