"""Construction sequences: how a mesh was built, step by step; replayed, edited, taken again, judged as lessons."""

from autopoly_env.sequence.file import Step
from autopoly_env.sequence.lesson import Lesson
from autopoly_env.sequence.sequence import ConstructionSequence

__all__ = ["ConstructionSequence", "Lesson", "Step"]
