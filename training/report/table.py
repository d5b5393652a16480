"""The headline table, wherever it is shown: how its numbers are written, and it for the screen, as Markdown and as CSV.

The tables of `training.evaluate` and of `training.compare` differ in their columns only.
"""

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from rich import box
from rich.cells import cell_len
from rich.table import Table
from rich.text import Text

from autopoly_env.shown import tame
from training.report.comparison import Row
from training.report.statistics import Interval

FORMATS = {"r_sm": ".4f", "r_sc": ".1f", "r_si": ".2f", "r_all": ".2f", "refits": ",.0f", "seconds": ".2f"}
LESSON_FORMATS = {  # of how a construction reads
    **{"actions": ".1f", "valid": ".2f", "blocking_in": ".3f", "moved": ".3f"},
    **{"quads": ".2f", "ngons": ".1f", "concave": ".1f", "effort": ".1f", "returns": ".2f"},
}
ENDS = {"r_sm": ".3f", "r_sc": ".1f", "r_si": ".2f", "r_all": ".1f"}  # of intervals, where there is little room
NONE = "–"


@dataclass(frozen=True)
class Cell:
    """A cell: what it says, and in small what goes with it, beneath it on the screen and behind it elsewhere."""

    text: str
    detail: str = ""


@dataclass(frozen=True)
class Line:
    """A line of the table; `is_quoted` are figures that were printed somewhere."""

    cells: Sequence[Cell]
    is_quoted: bool = False


# --- cells and records ---


def mean_cell(mean: Interval, form: str, ends: str | None) -> Cell:
    """A mean in a format such as ".2f", and its interval "[low, high]" in the format `ends`, if there is one.

    Where the mean is not known, the cell says NONE.
    """
    if not math.isfinite(mean.mean):
        return Cell(NONE)
    return Cell(signed(mean.mean, form), f"[{signed(mean.low, ends)}, {signed(mean.high, ends)}]" if ends else "")


def duel(row: Row) -> str:
    """Wins, ties and losses against the baseline."""
    return "baseline" if row.is_baseline else f"{row.wins}–{row.ties}–{row.losses}"


def signed(value: float, form: str) -> str:
    """The number with a true minus, and without one at zero."""
    return format(value + 0.0, form).replace("-", "−")


def interval_record(name: str, mean: Interval | None) -> dict[str, float | None]:
    """A mean and the ends of its interval as plain values by NAME, NAME_low, NAME_high; None where not known."""
    ends = mean or (math.nan,) * 3
    return {
        name + end: value if math.isfinite(value) else None
        for end, value in zip(("", "_low", "_high"), ends, strict=True)
    }


def duel_record(row: Row | None) -> dict[str, int | None]:
    """Wins, ties and losses as plain values."""
    return {name: getattr(row, name, None) for name in ("wins", "ties", "losses")}


# --- the whole ---


def as_rich(heads: Sequence[str], lines: Sequence[Line]) -> Table:
    """The table for the screen."""
    drawn = Table(box=box.SIMPLE_HEAD, padding=(0, 1))
    drawn.add_column(heads[0], overflow="fold")
    for head in heads[1:]:
        drawn.add_column(head, justify="right", no_wrap=True)
    for line in lines:
        style = "dim italic" if line.is_quoted else ""
        parts = (map(tame, filter(None, (cell.text, cell.detail))) for cell in line.cells)
        drawn.add_row(*(Text("\n".join(part), style) for part in parts))
    return drawn


def as_rich_parts(heads: Sequence[str], lines: Sequence[Line], width: int) -> list[Table]:
    """The table for a screen of so many letters, in parts that each begin with the first column; nothing is cut.

    The first column is folded where it takes more than a third of the screen. A part has one column more at least.
    """
    widths = [max(map(cell_len, [head, *_texts(lines, k)])) + 2 for k, head in enumerate(heads)]
    first = min(widths[0], max(12, width // 3))
    parts: list[list[int]] = []
    used = width
    for k in range(1, len(heads)):
        if not parts or used + widths[k] > width:
            parts.append([])
            used = first + 1  # with a margin
        parts[-1].append(k)
        used += widths[k]
    chosen = [[0, *part] for part in parts] or [[0]]
    return [
        as_rich([heads[k] for k in part], [Line([line.cells[k] for k in part], line.is_quoted) for line in lines])
        for part in chosen
    ]


def _texts(lines: Sequence[Line], k: int) -> list[str]:
    return [tame(text) for line in lines for text in (line.cells[k].text, line.cells[k].detail)]


def as_markdown(heads: Sequence[str], lines: Sequence[Line]) -> str:
    """The table as Markdown, each line ended. The first column has names, which are escaped."""
    grid = [list(heads), ["---", *("---:" for _ in heads[1:])]]
    for line in lines:
        name, *others = (f"{cell.text} {cell.detail}".strip() for cell in line.cells)
        grid.append([escaped(name), *others])
    return "".join(f"| {' | '.join(cells)} |\n" for cells in grid)


def as_csv(records: Sequence[dict[str, Any]]) -> str:
    """Records of the same keys as CSV, with all digits; nothing where there are none."""
    stream = io.StringIO()
    if records:
        writer = csv.DictWriter(stream, list(records[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(records)
    return stream.getvalue()


def escaped(text: str) -> str:
    """Text in one line of Markdown that neither ends a cell nor is taken for markup."""
    line = " ".join(text.split())
    return "".join(f"\\{letter}" if letter in "\\|`*_<>[]&" else letter for letter in line)
