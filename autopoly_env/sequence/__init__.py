"""Construction sequences: how a mesh was built, step by step; replayed, edited, taken again, judged as lessons."""

from autopoly_env.sequence.file import Step
from autopoly_env.sequence.lesson import LESSON_FIELDS, Lesson
from autopoly_env.sequence.parts import Parts, parts_of
from autopoly_env.sequence.sequence import ConstructionSequence

__all__ = ["LESSON_FIELDS", "ConstructionSequence", "Lesson", "Parts", "Step", "parts_of"]
