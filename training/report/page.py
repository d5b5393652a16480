"""The page of a report: everything in one HTML file that asks for nothing from elsewhere."""

import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from training.report.axes import BOTTOM, HEIGHT, LEFT, RIGHT, TOP, WIDTH
from training.report.charts import Curves, anytime, curves_of, scatter, scatter_points
from training.report.comparison import MEANS, Comparison, Row
from training.report.gallery import Card, gallery_of, worst_cards
from training.report.headline import page_table
from training.report.lessons import is_told
from training.report.rendering import own_text, render
from training.report.table import LESSON_FORMATS

WORK = ("refits", "seconds")
COMPLEXITY = ("r_sc", "r_si")


def page_html(comparison: Comparison, rows: Sequence[Row], n_cards: int, title: str) -> str:
    """The report as HTML text; the gallery has the `n_cards` worst targets."""
    cards = worst_cards(comparison, n_cards)
    labels = [series.label for series in comparison.series]
    table = page_table(rows, comparison.baseline)
    curves = {work: curves_of(comparison, column) for column, work in enumerate(WORK)}
    return render(
        "page.html",
        title=title,
        style=own_text("style.css"),
        script=own_text("script.js"),
        summary=_summary(comparison),
        notes=comparison.notes,
        labels=labels,
        baseline=labels[comparison.baseline],
        table=table,
        lessons=[(i, row) for i, row in table.rows if is_told(row)],
        lesson_formats=LESSON_FORMATS,
        scatters=[scatter(comparison, value) for value in COMPLEXITY],
        n_shown=len(scatter_points(comparison)),
        n_outcomes=sum(len(series.outcomes) for series in comparison.series),
        curves=[anytime(curves[work], work) for work in WORK],
        n_targets=len(comparison.targets),
        gallery=gallery_of(comparison, cards),
        runs=[
            (run.name, str(run.folder), json.dumps(run.suite, indent=2, ensure_ascii=False)) for run in comparison.runs
        ],
        data=_data(comparison, labels, cards, curves),
    )


def _summary(comparison: Comparison) -> str:
    n_targets = len(comparison.targets)
    counts = ((len(comparison.series), "agent"), (n_targets, "target"), (len(comparison.runs), "run"))
    return ", ".join(f"{n} {word}{'' if n == 1 else 's'}" for n, word in counts)


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
            value: [(getattr(outcome, value), _known(outcome.r_sm)) for *_, outcome in points] for value in COMPLEXITY
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
