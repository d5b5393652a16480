"""What a benchmark yields - rows for people, records for machines - and how both are shown."""

import json
import operator
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from typing import Any, TextIO

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

_SENSES = {">=": operator.ge, "<=": operator.le}


@dataclass(frozen=True)
class Must:
    """A bound that the row's ratio, or where it has none, our own value must keep."""

    sense: str  # ">=" or "<="
    bound: float

    def __str__(self) -> str:
        return f"{self.sense} {self.bound:g}"


@dataclass(frozen=True)
class Row:
    """A line of the table."""

    name: str
    ours: float | None = None
    against: float | None = None  # the peer's value, or whatever ours is compared with
    ratio: float | None = None
    must: Must | None = None
    unit: str = ""  # of `ours` and `against`; "s" is shown as µs, ms or s
    note: str = ""

    @property
    def holds(self) -> bool | None:
        """Whether the bound is kept; None where there is no bound or no measurement."""
        value = self.ours if self.ratio is None else self.ratio
        if self.must is None or value is None:
            return None
        return bool(_SENSES[self.must.sense](value, self.must.bound))


@dataclass(frozen=True)
class Record:
    """A single result behind a row, for `--json` only."""

    label: str  # what is being measured, for the progress line
    values: dict[str, Any] = field(default_factory=dict)


def faster(name: str, ours: float, against: float, must: Must | None = None, note: str = "") -> Row:
    """A row of two times in seconds, and how many times faster ours is."""
    return Row(name, ours, against, against / ours, must, "s", note)


def not_measured(name: str, reason: str) -> Row:
    """A row that could not be measured, and why."""
    return Row(name, note=f"not measured: {reason}")


def write_json(stream: TextIO, group: str, item: Row | Record) -> None:
    """Append one row or record as a line of JSON, at once: an interrupted run keeps what it measured."""
    if isinstance(item, Row):
        must = str(item.must) if item.must else None
        values = {"kind": "row", "group": group, **asdict(item), "must": must, "holds": item.holds}
    else:
        values = {"kind": "record", "group": group, **item.values}
    stream.write(json.dumps(values) + "\n")
    stream.flush()


def show(groups: Iterable[tuple[str, list[Row]]], caption: str, console: Console) -> None:
    """Print all rows as one table."""
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1), caption=caption, caption_justify="left")
    table.add_column("", min_width=30)
    for column in ("ours", "against", "ratio", "must reach", "holds"):
        table.add_column(column, justify="right", no_wrap=True)
    table.add_column("note")
    for title, rows in groups:
        table.add_section()
        table.add_row(f"[bold]{title}[/bold]")
        for row in rows:
            table.add_row(*_cells(row))
    console.print(table)


def _cells(row: Row) -> tuple[str, ...]:
    values = (quantity(row.ours, row.unit), quantity(row.against, row.unit))
    ratio = "" if row.ratio is None else f"{row.ratio:.3g}x" if row.ratio < 100 else f"{row.ratio:,.0f}x"
    holds = {True: "[green]yes[/green]", False: "[red]no[/red]", None: "-"}[row.holds]
    return (f"  {row.name}", *values, ratio, "" if row.must is None else str(row.must), holds, escape(row.note))


def quantity(value: float | None, unit: str) -> str:
    """A value with its unit, short."""
    if value is None:
        return ""
    if unit != "s":
        return f"{value:.4g} {unit}".strip()
    factor, name = (1e6, "µs") if value < 1e-3 else (1e3, "ms") if value < 1.0 else (1.0, "s")
    return f"{value * factor:.3g} {name}"
