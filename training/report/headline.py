"""The headline table of a comparison: on the page, on the screen, as Markdown, as CSV and as plain records."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from training.report.comparison import MEANS, Row
from training.report.lessons import lessons_markdown
from training.report.statistics import Interval
from training.report.table import (
    FORMATS,
    Cell,
    Line,
    as_markdown,
    duel,
    duel_record,
    escaped,
    interval_record,
    mean_cell,
)

LOW_IS_GOOD = ("r_sc", "r_si", "refits", "seconds")
BAR = (100, 18)  # user units of the drawing of an interval
SCREEN_HEADS = ("agent", "targets", *FORMATS, "won–tied–lost")


@dataclass(frozen=True)
class PageTable:
    """What the page shows: the rows, the highest r_all first, each with the number of its series."""

    rows: list[tuple[int, Row]]
    baseline: str
    best: dict[str, float]  # mean of each column; NaN, which no mean equals, where all are the same
    whiskers: list[Interval | None]  # of r_all, by series, in user units of the bar
    formats: dict[str, str] = field(default_factory=lambda: FORMATS)
    low_is_good: tuple[str, ...] = LOW_IS_GOOD
    bar_width: int = BAR[0]
    bar_height: int = BAR[1]


def page_table(rows: Sequence[Row], baseline: int) -> PageTable:
    """The table for the page."""
    order = sorted(range(len(rows)), key=lambda i: _order(rows[i]))
    best = {name: _best(rows, name) for name in FORMATS}
    return PageTable([(i, rows[i]) for i in order], rows[baseline].label, best, _whiskers(rows))


def screen_lines(rows: Sequence[Row]) -> list[Line]:
    """The table for the screen, in the columns SCREEN_HEADS."""
    lines = []
    for row in rows:
        means = [mean_cell(row.means[name], form, form if name == "r_all" else None) for name, form in FORMATS.items()]
        failed = f"{row.n_failed} failed" if row.n_failed else ""
        lines.append(Line([Cell(row.label), Cell(str(row.n_targets), failed), *means, Cell(duel(row))]))
    return lines


def markdown_report(rows: Sequence[Row], baseline: int, notes: Sequence[str]) -> str:
    """The table as Markdown, the notes below it, and how the constructions read."""
    heads = ("agent", "targets", "failed", *FORMATS, "wins–ties–losses", "lead")
    lines = []
    for row in rows:
        means = [mean_cell(row.means[name], form, form) for name, form in FORMATS.items()]
        lead = Cell("") if row.lead is None else mean_cell(row.lead, "+.2f", "+.2f")
        counts = (Cell(str(row.n_targets)), Cell(str(row.n_failed)))
        lines.append(Line([Cell(row.label), *counts, *means, Cell(duel(row)), lead]))
    explained = (
        "Means over targets with 95 % bootstrap intervals. Wins, ties, losses and lead (of r_all) are against "
        f"{escaped(rows[baseline].label)}, on the targets of both."
    )
    warnings = (f"Warning: {escaped(note)}." for note in notes)
    reading = [text.rstrip("\n")] if (text := lessons_markdown(rows)) else []
    return "\n\n".join([as_markdown(heads, lines).rstrip("\n"), explained, *warnings, *reading]) + "\n"


def record_of(row: Row) -> dict[str, Any]:
    """The row as plain values, with all digits; what is not known is None."""
    record: dict[str, Any] = {"agent": row.label, "targets": row.n_targets, "failed": row.n_failed}
    for name in MEANS:
        record |= interval_record(name, row.means[name])
    return record | duel_record(row) | interval_record("lead", row.lead)


def _order(row: Row) -> float:
    """By r_all, the highest first; rows without one last."""
    mean = row.means["r_all"].mean
    return -mean if math.isfinite(mean) else math.inf


def _best(rows: Sequence[Row], name: str) -> float:
    """The best mean of a column; NaN where all are the same."""
    means = {row.means[name].mean for row in rows if math.isfinite(row.means[name].mean)}
    if len(means) < 2:
        return math.nan
    return min(means) if name in LOW_IS_GOOD else max(means)


def _whiskers(rows: Sequence[Row]) -> list[Interval | None]:
    """The interval of r_all of each row on one scale for all; None where it is not known."""
    ends = [end for row in rows for end in row.means["r_all"] if math.isfinite(end)]
    low, span, width = min(ends, default=0.0), max(max(ends, default=0.0) - min(ends, default=0.0), 1e-9), BAR[0]
    return [
        Interval(*(6 + (width - 12) * (end - low) / span for end in row.means["r_all"]))
        if math.isfinite(row.means["r_all"].mean)
        else None
        for row in rows
    ]
