"""The table that an evaluation ends with: means of each agent, what is missing, and what was printed elsewhere."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from autopoly_env.files import write_atomically
from training.evaluation.suite import GROUND_TRUTH, Printed, Suite
from training.records import Record
from training.report.comparison import Comparison, Row, Run, Series, rows_of
from training.report.lessons import lessons_markdown
from training.report.table import (
    ENDS,
    FORMATS,
    LESSON_FORMATS,
    NONE,
    Cell,
    Line,
    as_csv,
    as_markdown,
    duel,
    duel_record,
    interval_record,
    mean_cell,
)

KNOWN = FORMATS | LESSON_FORMATS  # the columns that a table can show
PRINTED_FORMATS = {"r_sm": ".3f", "r_sc": ".1f", "r_si": ".1f", "r_all": ".1f"}
ROUNDING = 0.25  # r_all points by which the sum of printed parts may miss the printed sum


@dataclass(frozen=True)
class SuiteRow:
    """A row of the table: an agent of the suite, its means if it has records, and what was printed about it."""

    label: str
    means: Row | None
    missing: str = ""  # why there are none
    printed: Printed | None = None


@dataclass(frozen=True)
class RunTable:
    """The table of a run; `notes` are shown below it."""

    suite: Suite
    rows: tuple[SuiteRow, ...]
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
    measured: dict[str, Row] = {}
    if series:
        run = Run(Path(), suite.name, {})
        measured = {row.label: row for row in rows_of(Comparison((run,), tuple(series), place, ()))}
    printed = {entry.label: entry.printed for entry in suite.agents}
    rows = tuple(
        SuiteRow(label, measured.get(label), missing.get(label, ""), printed.get(label))
        for label in labels
        if label in measured or label in missing
    )
    name = series[place].label if series else wanted
    return RunTable(suite, rows, name, len(targets), (*_notes(suite, rows, name), *suite.notes))


def _notes(suite: Suite, rows: Sequence[SuiteRow], baseline: str) -> list[str]:
    notes = [f"Means over shapes with 95 % bootstrap intervals; won, tied and lost in r_all against {baseline}."]
    weights = suite.weights
    wrong = [
        f"{row.label} {row.printed.sum(weights):.1f}" for row in rows if row.printed and _is_off(row.printed, suite)
    ]
    if wrong:
        notes.append(f"† The printed parts do not add up to the printed r_all, but to: {', '.join(wrong)}.")
    return notes


def _is_off(printed: Printed, suite: Suite) -> bool:
    return abs(printed.sum(suite.weights) - printed.r_all) > ROUNDING


def write_tables(folder: Path, table: RunTable) -> None:
    """Write RUN/table.md and RUN/table.csv. Raises OutputError."""
    notes = "".join(f"- {note}\n" for note in table.notes)
    text = f"# {table.suite.name}\n\n{as_markdown(heads_of(FORMATS), lines_of(table, FORMATS))}\n{notes}"
    reading = lessons_markdown([row.means for row in table.rows if row.means])
    text += f"\n{reading}" if reading else ""
    write_atomically(folder / "table.md", text)
    write_atomically(folder / "table.csv", as_csv(records_of(table)))


def heads_of(columns: Iterable[str]) -> tuple[str, ...]:
    """What stands above the columns of a table: some of KNOWN, and what every table has."""
    return ("agent", "shapes", *columns, "won–tied–lost")


def lines_of(table: RunTable, columns: Collection[str]) -> list[Line]:
    """What the table shows, in the columns `heads_of(columns)`."""
    lines = []
    for row in table.rows:
        lines.append(Line(_cells(row, table, columns)))
        if row.printed:
            figures = {name: format(getattr(row.printed, name), form) for name, form in PRINTED_FORMATS.items()}
            figures["r_all"] += "†" if _is_off(row.printed, table.suite) else ""
            cells = [Cell(text) for text in ("  in print", "", *(figures.get(name, "") for name in columns), "")]
            lines.append(Line(cells, is_quoted=True))
    return lines


def _cells(row: SuiteRow, table: RunTable, columns: Collection[str]) -> list[Cell]:
    means = row.means
    if means is None:
        return [Cell(row.label, f"({row.missing})"), *(Cell(NONE) for _ in heads_of(columns)[1:])]
    n_shapes = f"{means.n_targets}" + (f" of {table.n_targets}" if means.n_targets < table.n_targets else "")
    numbers = [mean_cell(means.means[name], KNOWN[name], ENDS.get(name)) for name in columns]
    return [Cell(row.label), Cell(n_shapes), *numbers, Cell(duel(means))]


def records_of(table: RunTable) -> list[dict[str, Any]]:
    """A record a row, with all digits; what is not known is None."""
    return [_record(row) for row in table.rows]


def _record(row: SuiteRow) -> dict[str, Any]:
    means = row.means
    record: dict[str, Any] = {"agent": row.label, "note": row.missing}
    record |= {"shapes": means.n_targets, "failed": means.n_failed} if means else {"shapes": 0, "failed": 0}
    for name in KNOWN:
        record |= interval_record(name, means.means[name] if means else None)
    printed = asdict(row.printed) if row.printed else dict.fromkeys(PRINTED_FORMATS)
    return record | duel_record(means) | {f"printed_{name}": value for name, value in printed.items()}
