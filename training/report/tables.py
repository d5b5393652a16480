"""The headline table as HTML, Markdown, CSV and plain records."""

import csv
import io
import math
from collections.abc import Sequence
from html import escape
from typing import Any

from training.report.axes import number
from training.report.charts import colour_class, marker
from training.report.comparison import MEANS, Row
from training.report.statistics import Interval

FORMATS = {"r_sm": ".4f", "r_sc": ".1f", "r_si": ".2f", "r_all": ".2f", "refits": ",.0f", "seconds": ".2f"}
LOW_IS_GOOD = ("r_sc", "r_si", "refits", "seconds")
BAR = (100, 18)  # user units of the drawing of an interval


def html_table(rows: Sequence[Row], baseline: int) -> str:
    """The table, the highest r_all first, to be sorted by its heads; `data-v` of a cell is what it is sorted by."""
    columns = [("agent", ""), ("r_all", "r_all"), ("", "")]
    columns += [(name, name) for name in FORMATS if name != "r_all"]
    columns += [(f"against {rows[baseline].label}", "lead"), ("targets", "n")]
    heads = "".join(_head(escape(text), key) for text, key in columns)
    best = {name: _best(rows, name) for name in FORMATS}
    order = sorted(range(len(rows)), key=lambda i: _order(rows[i]))
    body = "\n".join(_html_row(rows[i], i, rows, best) for i in order)
    return f'<table id="headline"><thead><tr>{heads}</tr></thead>\n<tbody>\n{body}\n</tbody></table>'


def markdown_table(rows: Sequence[Row], baseline: int, notes: Sequence[str]) -> str:
    """The table as Markdown, the notes below it."""
    heads = ["agent", "targets", "failed", *FORMATS, "wins–ties–losses", "lead"]
    lines = [heads, ["---", *("---:" for _ in heads[1:])]]
    lines += [
        [
            _cell(row.label),
            str(row.n_targets),
            str(row.n_failed),
            *(plain(row.means[name], form) for name, form in FORMATS.items()),
            "baseline" if row.is_baseline else duel(row),
            "" if row.lead is None else plain(row.lead, "+.2f"),
        ]
        for row in rows
    ]
    table = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    explained = (
        "Means over targets with 95 % bootstrap intervals. Wins, ties, losses and lead (of r_all) are against "
        f"{_cell(rows[baseline].label)}, on the targets of both."
    )
    return "\n\n".join([table, explained, *(f"Warning: {_cell(note)}." for note in notes)]) + "\n"


def csv_table(rows: Sequence[Row]) -> str:
    """The table as CSV, with all digits."""
    records = [as_record(row) for row in rows]
    stream = io.StringIO()
    writer = csv.DictWriter(stream, list(records[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(records)
    return stream.getvalue()


def as_record(row: Row) -> dict[str, Any]:
    """The row as plain values; what is not known is None."""
    record: dict[str, Any] = {"agent": row.label, "targets": row.n_targets, "failed": row.n_failed}
    for name in MEANS:
        for end, value in zip(("", "_low", "_high"), row.means[name], strict=True):
            record[name + end] = _known(value)
    record |= {"wins": row.wins, "ties": row.ties, "losses": row.losses}
    lead = row.lead or Interval(math.nan, math.nan, math.nan)
    for end, value in zip(("", "_low", "_high"), lead, strict=True):
        record["lead" + end] = _known(value)
    return record


def plain(mean: Interval, form: str) -> str:
    """The mean and its interval in brackets."""
    if not math.isfinite(mean.mean):
        return "–"
    return f"{_signed(mean.mean, form)} [{_signed(mean.low, form)}, {_signed(mean.high, form)}]"


def duel(row: Row) -> str:
    """Wins, ties and losses against the baseline."""
    return f"{row.wins}–{row.ties}–{row.losses}"


def _order(row: Row) -> float:
    """By r_all, the highest first; rows without one last."""
    mean = row.means["r_all"].mean
    return -mean if math.isfinite(mean) else math.inf


def _html_row(row: Row, i: int, rows: Sequence[Row], best: dict[str, float]) -> str:
    values = {}
    for name, form in FORMATS.items():
        mean = row.means[name]
        mark = ' class="best"' if mean.mean == best[name] else ""
        values[name] = f'<td data-v="{_value(mean.mean)}"{mark}>{_stacked(mean, form)}</td>'
    failed = f"<small>{row.n_failed} failed</small>" if row.n_failed else ""
    cells = [
        f'<th scope="row">{_key(i)}{escape(row.label)}</th>',
        values.pop("r_all"),
        f'<td class="bar">{_bar(row.means["r_all"], i, rows)}</td>',
        *values.values(),
        _lead_cell(row),
        f'<td data-v="{row.n_targets}">{row.n_targets}{failed}</td>',
    ]
    return f'<tr data-s="{i}">{"".join(cells)}</tr>'


def _key(i: int) -> str:
    return (
        f'<svg class="key {colour_class(i)}" viewBox="-7 -7 14 14" aria-hidden="true"><use href="#m{marker(i)}"/></svg>'
    )


def _lead_cell(row: Row) -> str:
    """The mean lead, and how the duels went as numbers and as a bar of three parts."""
    if row.lead is None:
        return '<td data-v="0"><small>baseline</small></td>' if row.is_baseline else '<td data-v="">–</td>'
    parts = (("win", row.wins), ("tie", row.ties), ("loss", row.losses))
    split = "".join(f'<i class="{kind}" style="flex:{n}"></i>' for kind, n in parts if n)
    title = f"{row.wins} won, {row.ties} tied, {row.losses} lost"
    lead = _stacked(row.lead, "+.2f")
    return (
        f'<td data-v="{_value(row.lead.mean)}" class="duel" title="{title}"><div><span>{lead}</span>'
        f'<span>{duel(row)}<span class="split">{split}</span></span></div></td>'
    )


def _bar(mean: Interval, i: int, rows: Sequence[Row]) -> str:
    """The interval of r_all as a line with the mean as a dot, on one scale for all rows."""
    ends = [end for row in rows for end in row.means["r_all"] if math.isfinite(end)]
    if not math.isfinite(mean.mean):
        return ""
    low, high = min(ends), max(ends)
    span = max(high - low, 1e-9)
    width, height = BAR
    low_x, at, high_x = (number(6 + (width - 12) * (v - low) / span) for v in (mean.low, mean.mean, mean.high))
    y = number(height / 2)
    return (
        f'<svg viewBox="0 0 {width} {height}" class="{colour_class(i)}" aria-hidden="true">'
        f'<path class="rail" d="M0 {y}H{width}"/><path class="whisker" d="M{low_x} {y}H{high_x}"/>'
        f'<use href="#m{marker(i)}" x="{at}" y="{y}"/></svg>'
    )


def _head(text: str, key: str) -> str:
    """The head of a column: its key, and whether a first click sorts it upwards."""
    if not key:
        return f'<th scope="col">{text}</th>'
    now = ' aria-sort="descending"' if key == "r_all" else ""
    up = int(key in LOW_IS_GOOD)
    return f'<th scope="col" data-key="{key}" data-up="{up}"{now}><button type="button">{text}</button></th>'


def _best(rows: Sequence[Row], name: str) -> float:
    """The best mean of a column; NaN, which no mean equals, where all are the same."""
    means = {row.means[name].mean for row in rows if math.isfinite(row.means[name].mean)}
    if len(means) < 2:
        return math.nan
    return min(means) if name in LOW_IS_GOOD else max(means)


def _stacked(mean: Interval, form: str) -> str:
    """The mean above its interval."""
    if not math.isfinite(mean.mean):
        return "–"
    return f"{_signed(mean.mean, form)}<small>{_signed(mean.low, form)} … {_signed(mean.high, form)}</small>"


def _signed(value: float, form: str) -> str:
    """The number with a true minus."""
    return format(value + 0.0, form).replace("-", "−")


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _value(value: float) -> str:
    return repr(value) if math.isfinite(value) else ""


def _cell(text: str) -> str:
    """Text that neither ends a cell of Markdown nor is taken for markup."""
    plain = " ".join(text.split())
    return "".join(f"\\{letter}" if letter in "\\|`*_<>[]&" else letter for letter in plain)
