"""The table that an evaluation ends with: on the screen, as Markdown, as CSV and as plain records."""

import csv
import io
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from rich import box
from rich.table import Table
from rich.text import Text

from autopoly_env.files import write_atomically
from training.evaluation.suite import GROUND_TRUTH, Printed, Suite
from training.records import Record
from training.report.comparison import Comparison, Row, Run, Series, rows_of
from training.report.statistics import Interval

FORMATS = {"r_sm": ".4f", "r_sc": ".1f", "r_si": ".2f", "r_all": ".2f", "refits": ".0f", "seconds": ".2f"}
INTERVALS = {"r_sm": ".3f", "r_sc": ".1f", "r_si": ".2f", "r_all": ".1f"}  # formats of their ends
HEADS = ("agent", "shapes", *FORMATS, "won–tied–lost")
PRINTED_FORMATS = {"r_sm": ".3f", "r_sc": ".1f", "r_si": ".1f", "r_all": ".1f"}
ROUNDING = 0.25  # r_all points by which the sum of printed parts may miss the printed sum
NONE = "–"
GAP = "\x1f"  # in a cell: a new line on the screen, a space elsewhere


@dataclass(frozen=True)
class Line:
    """A row of the table: an agent of the suite, its means if it has records, and what was printed about it."""

    label: str
    row: Row | None
    missing: str = ""  # why there is no row
    printed: Printed | None = None


@dataclass(frozen=True)
class RunTable:
    """The table of a run; `notes` are shown below it."""

    suite: Suite
    lines: tuple[Line, ...]
    baseline: str
    n_targets: int
    notes: tuple[str, ...]


def table_of(
    suite: Suite,
    records: Iterable[Record],
    targets: Sequence[str],
    missing: Mapping[str, str],
    baseline: str | None = None,
) -> RunTable:
    """The table of some records of a suite: the ground truth first, then the agents in the suite's order.

    `targets` are those of the suite: in their order the means are taken, so that they do not depend, to the last bit,
    on that of the records. `missing`: what the rows of agents say that cannot be had. Without records of the baseline
    it is the last agent that has some.
    """
    order = {target: number for number, target in enumerate(targets)}
    by_label: dict[str, list[Record]] = {}
    for record in sorted(records, key=lambda record: (order.get(record.target, len(order)), record.seed)):
        by_label.setdefault(record.agent, []).append(record)
    labels = [GROUND_TRUTH, *(entry.label for entry in suite.agents)]
    series = [Series(label, 0, tuple(by_label[label])) for label in labels if label in by_label]
    wanted = baseline or suite.baseline or suite.agents[0].label
    place = next((k for k, one in enumerate(series) if one.label == wanted), len(series) - 1)
    rows: dict[str, Row] = {}
    if series:
        run = Run(Path(), suite.name, {})
        rows = {row.label: row for row in rows_of(Comparison((run,), tuple(series), place, ()))}
    printed = {entry.label: entry.printed for entry in suite.agents}
    lines = tuple(
        Line(label, rows.get(label), missing.get(label, ""), printed.get(label))
        for label in labels
        if label in rows or label in missing
    )
    name = series[place].label if series else wanted
    return RunTable(suite, lines, name, len(targets), (*_notes(suite, lines, name), *suite.notes))


def _notes(suite: Suite, lines: Sequence[Line], baseline: str) -> list[str]:
    notes = [f"Means over shapes with 95 % bootstrap intervals; won, tied and lost in r_all against {baseline}."]
    weights = suite.weights
    wrong = [
        f"{line.label} {line.printed.sum(weights):.1f}"
        for line in lines
        if line.printed and _is_off(line.printed, suite)
    ]
    if wrong:
        notes.append(f"† The printed parts do not add up to the printed r_all, but to: {', '.join(wrong)}.")
    return notes


def _is_off(printed: Printed, suite: Suite) -> bool:
    return abs(printed.sum(suite.weights) - printed.r_all) > ROUNDING


def write_tables(folder: Path, table: RunTable) -> None:
    """Write RUN/table.md and RUN/table.csv. Raises OutputError."""
    write_atomically(folder / "table.md", as_markdown(table))
    write_atomically(folder / "table.csv", as_csv(table))


def as_rich(table: RunTable) -> Table:
    """The table for the screen, intervals below the means."""
    drawn = Table(box=box.SIMPLE_HEAD, padding=(0, 1))
    for k, head in enumerate(HEADS):
        drawn.add_column(head, justify="right" if k else "left", no_wrap=True)
    for cells, is_printed in _rows(table):
        texts = (Text(cell.replace(GAP, "\n"), "dim italic" if is_printed else "") for cell in cells)
        drawn.add_row(*texts)
    return drawn


def as_markdown(table: RunTable) -> str:
    """The table as Markdown, with the notes."""
    grid = [list(HEADS), ["---", *("---:" for _ in HEADS[1:])]]
    grid += [[cell.replace(GAP, " ").strip().replace("|", "\\|") for cell in cells] for cells, _ in _rows(table)]
    lines = [f"| {' | '.join(cells)} |" for cells in grid]
    return "\n".join([f"# {table.suite.name}", "", *lines, "", *(f"- {note}" for note in table.notes)]) + "\n"


def _rows(table: RunTable) -> list[tuple[list[str], bool]]:
    """The cells of every row, and whether they are printed figures."""
    rows = []
    for line in table.lines:
        rows.append((_cells(line, table), False))
        if line.printed:
            mark = "†" if _is_off(line.printed, table.suite) else ""
            figures = [format(getattr(line.printed, name), form) for name, form in PRINTED_FORMATS.items()]
            figures[-1] += mark
            rows.append((["  in print", "", *figures, "", "", ""], True))
    return rows


def _cells(line: Line, table: RunTable) -> list[str]:
    row = line.row
    if row is None:
        return [f"{line.label}{GAP}({line.missing})", *(NONE for _ in HEADS[1:])]
    n_shapes = f"{row.n_targets}" + (f" of {table.n_targets}" if row.n_targets < table.n_targets else "")
    duel = "baseline" if line.label == table.baseline else f"{row.wins}–{row.ties}–{row.losses}"
    return [line.label, n_shapes, *(_cell(name, row.means[name]) for name in FORMATS), duel]


def _cell(name: str, mean: Interval) -> str:
    """A mean and, if it is of the score, its interval."""
    if not math.isfinite(mean.mean):
        return NONE
    text = format(mean.mean, FORMATS[name])
    if name not in INTERVALS:
        return text
    return f"{text}{GAP}({mean.low:{INTERVALS[name]}}…{mean.high:{INTERVALS[name]}})"


def as_records(table: RunTable) -> list[dict[str, Any]]:
    """A record a row, with all digits; what is not known is None."""
    return [_record(line) for line in table.lines]


def _record(line: Line) -> dict[str, Any]:
    row = line.row
    record: dict[str, Any] = {"agent": line.label, "note": line.missing}
    record |= {"shapes": row.n_targets, "failed": row.n_failed} if row else {"shapes": 0, "failed": 0}
    for name in FORMATS:
        for end, value in zip(("", "_low", "_high"), row.means[name] if row else (None,) * 3, strict=True):
            record[name + end] = value if value is not None and math.isfinite(value) else None
    record |= {"wins": row.wins, "ties": row.ties, "losses": row.losses} if row else dict.fromkeys(_DUEL)
    printed = asdict(line.printed) if line.printed else dict.fromkeys(PRINTED_FORMATS)
    return record | {f"printed_{name}": value for name, value in printed.items()}


_DUEL = ("wins", "ties", "losses")


def as_csv(table: RunTable) -> str:
    """The table as CSV, with all digits."""
    records = as_records(table)
    stream = io.StringIO()
    writer = csv.DictWriter(stream, list(records[0]) if records else list(HEADS), lineterminator="\n")
    writer.writeheader()
    writer.writerows(records)
    return stream.getvalue()
