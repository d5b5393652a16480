"""What a player sees of a mesh and its target, as arrays whose sizes never change."""

from autopoly_env.observation.observer import PADDING, POSITION_RANGE, Field, Observation, Observer, as_bytes

__all__ = ["PADDING", "POSITION_RANGE", "Field", "Observation", "Observer", "as_bytes"]
