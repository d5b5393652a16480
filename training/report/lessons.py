"""How constructions read (docs/lessons.md), agent by agent: the table beside the headline table."""

import math
from collections.abc import Sequence

from training.report.comparison import Row
from training.report.table import LESSON_FORMATS, Cell, Line, as_markdown, mean_cell

HEADS = ("agent", *LESSON_FORMATS)
EXPLAINED = (
    "How the constructions read, means over targets: `valid`, share of sound meshes; `blocking_in`, mean r_sm on the "
    "way; `moved`, share of old vertices that a step moves; `quads`, share of the faces; `ngons` and `concave`, faces; "
    "`effort`, seconds to follow it by hand; `returns`, steps back to a part that was left."
)


def is_told(row: Row) -> bool:
    """Whether more is known than the number of actions, which is all that the oldest records tell."""
    return any(math.isfinite(row.means[name].mean) for name in LESSON_FORMATS if name != "actions")


def lessons_markdown(rows: Sequence[Row]) -> str:
    """The table as Markdown, below its explanation; empty where nothing is known."""
    lines = [
        Line([Cell(row.label), *(mean_cell(row.means[name], form, None) for name, form in LESSON_FORMATS.items())])
        for row in rows
        if is_told(row)
    ]
    return f"{EXPLAINED}\n\n{as_markdown(HEADS, lines)}" if lines else ""
