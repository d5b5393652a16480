"""How a lesson is shown in a narrow panel: rows under the names of parts, and lines that fit its width."""

import re
import textwrap
from dataclasses import dataclass

from .lesson import Lesson

LETTER = 5.6  # pixels of an average letter in Blender's panels, at a scale of 1
LEAST_LETTERS = 20
HEAD = -1  # the number of a row that is no step


@dataclass(frozen=True)
class Row:
    """A line of the list: a step, or the name of the part that the next ones work on."""

    number: int  # of the step, or HEAD
    words: str


def rows_of(lesson: Lesson) -> list[Row]:
    """The list of a lesson, steps under the names of their parts where it has several."""
    rows: list[Row] = []
    part = ""
    for number, step in enumerate(lesson.steps):
        if step.part != part:
            part = step.part
            rows.append(Row(HEAD, part[:1].upper() + part[1:]))
        rows.append(Row(number, f"{number}  {step.title}"))
    return rows


def wrapped(words: str, width: float, scale: float = 1.0) -> list[str]:
    """Words in lines that fit `width` pixels, keys in brackets."""
    n_letters = max(LEAST_LETTERS, int(width / (LETTER * scale)))
    return textwrap.wrap(plain(words), n_letters) or [""]


def plain(words: str) -> str:
    """Words with keys in brackets: `E` is [E]."""
    return re.sub(r"`([^`]*)`", r"[\1]", words)
