"""The page of a report: everything in one HTML file that asks for nothing from elsewhere."""

import json
from collections.abc import Sequence
from html import escape
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from training.report.axes import BOTTOM, HEIGHT, LEFT, RIGHT, TOP, WIDTH
from training.report.charts import (
    Curves,
    anytime,
    colour_class,
    curves_of,
    marker,
    marker_symbols,
    scatter,
    scatter_points,
)
from training.report.comparison import MEANS, Comparison, Row
from training.report.gallery import Card, gallery_html, worst_cards
from training.report.tables import html_table

HERE = Path(__file__).parent
WORK = ("refits", "seconds")


def page_html(comparison: Comparison, rows: Sequence[Row], n_cards: int, title: str) -> str:
    """The report as HTML text; the gallery has the `n_cards` worst targets."""
    cards = worst_cards(comparison, n_cards)
    labels = [series.label for series in comparison.series]
    curves = {work: curves_of(comparison, column) for column, work in enumerate(WORK)}
    return Template(_read("page.html")).substitute(
        title=escape(title),
        style=_read("style.css"),
        script=_read("script.js"),
        symbols=marker_symbols(),
        summary=escape(_summary(comparison)),
        notes=_notes_html(comparison.notes),
        chips="".join(_chip(label, i) for i, label in enumerate(labels)),
        baseline=escape(labels[comparison.baseline]),
        table=html_table(rows, comparison.baseline),
        scatters="".join(
            f'<figure class="scatter" data-value="{value}">{scatter(comparison, value)}</figure>'
            for value in ("r_sc", "r_si")
        ),
        curves="".join(
            f'<figure class="anytime" data-work="{work}">{anytime(curves[work], labels, work)}</figure>'
            for work in WORK
        ),
        scatter_note=_scatter_note(comparison),
        gallery_note=escape(_gallery_note(len(cards), len(comparison.targets))),
        options="".join(f'<option value="{i}">{escape(label)}</option>' for i, label in enumerate(labels)),
        n_series=len(labels),
        gallery=gallery_html(comparison, cards),
        runs="".join(_run_html(run.name, str(run.folder), run.suite) for run in comparison.runs),
        data=script_json(_data(comparison, labels, cards, curves)),
    )


def script_json(value: Any) -> str:
    """JSON that may stand in a `<script>`, whatever text is in it."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _read(name: str) -> str:
    return (HERE / name).read_text(encoding="utf-8")


def _summary(comparison: Comparison) -> str:
    n_targets = len(comparison.targets)
    counts = ((len(comparison.series), "agent"), (n_targets, "target"), (len(comparison.runs), "run"))
    return ", ".join(f"{n} {word}{'' if n == 1 else 's'}" for n, word in counts)


def _scatter_note(comparison: Comparison) -> str:
    n_shown, n = len(scatter_points(comparison)), sum(len(series.outcomes) for series in comparison.series)
    return "" if n_shown == n else f" {n_shown} of {n} small marks are drawn."


def _gallery_note(n_cards: int, n_targets: int) -> str:
    if n_cards == n_targets:
        return "Every agent’s mesh of each target: over the target, and how it differs from it."
    return (
        f"The {n_cards} worst of {n_targets} targets, in turn those of all agents together and of each of them: every "
        "agent’s mesh over the target, and how it differs from it."
    )


def _notes_html(notes: Sequence[str]) -> str:
    return f'<ul class="notes">{"".join(f"<li>{escape(note)}</li>" for note in notes)}</ul>' if notes else ""


def _chip(label: str, i: int) -> str:
    return (
        f'<button type="button" data-chip="{i}" aria-pressed="true" class="{colour_class(i)}">'
        f'<svg class="key" viewBox="-7 -7 14 14" aria-hidden="true"><use href="#m{marker(i)}"/></svg>'
        f"<span>{escape(label)}</span></button>"
    )


def _run_html(name: str, folder: str, suite: dict[str, Any]) -> str:
    settings = json.dumps(suite, indent=2, ensure_ascii=False)
    where = f"<small>{escape(folder)}</small>"
    return f"<details><summary><b>{escape(name)}</b> {where}</summary><pre>{escape(settings)}</pre></details>\n"


def _data(
    comparison: Comparison, labels: Sequence[str], cards: Sequence[Card], curves: dict[str, Curves]
) -> dict[str, Any]:
    """What the page's script works with."""
    points = scatter_points(comparison)
    matches = [series.by_target(MEANS["r_sm"]) for series in comparison.series]
    return {
        "labels": list(labels),
        "targets": comparison.targets,
        "baseline": comparison.baseline,
        "cards": [
            {
                "name": card.target,
                "all": [_known(total) for total in card.totals],
                "sm": [_known(of_series.get(card.target)) for of_series in matches],
                "failed": [record is not None and record.outcome is None for record in card.records],
            }
            for card in cards
        ],
        "points": {
            value: [(getattr(outcome, value), _known(outcome.r_sm)) for *_, outcome in points]
            for value in ("r_sc", "r_si")
        },
        "curves": {
            work: {
                "grid": [float(f"{at:.4g}") for at in those.grid],
                "means": [[_known(value) for value in line] for line in those.means.tolist()],
                "box": (LEFT, TOP, WIDTH - RIGHT, HEIGHT - BOTTOM),
                "width": WIDTH,
            }
            for work, those in curves.items()
        },
    }


def _known(value: float | None) -> float | None:
    return round(float(value), 4) if value is not None and np.isfinite(value) else None
