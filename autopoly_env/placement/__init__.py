"""Where an action's new vertices start: what rendering and target disagree about, and what an action makes of it."""

from autopoly_env.placement.disagreement import Disagreement
from autopoly_env.placement.trial import Trial, tried

__all__ = ["Disagreement", "Trial", "tried"]
