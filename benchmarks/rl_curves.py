"""Learning curves: a panel for each kind of target, a line and its range over the seeds for each training."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.curves import Curve, Panel, draw_panels


@dataclass(frozen=True)
class LearningCurve(Curve):
    """r_all over the minutes of training: median, lowest and highest of the seeds."""

    start: float  # r_all of the refitted rectangle


LearningCurves = dict[str, dict[str, LearningCurve]]  # by kind of target, then by training


def learning_curves(groups: Mapping[str, Sequence[Sequence[Mapping[str, float]]]]) -> LearningCurves:
    """From the evaluations in the logs of each training's seeds; the n-th ones of the seeds belong together."""
    curves: LearningCurves = {}
    for name, runs in groups.items():
        n = min((len(run) for run in runs), default=0)
        if not n:
            continue
        kinds = [key[len("eval/") : -len("_final")] for key in runs[0][0] if key.endswith("_final")]
        for kind in kinds:
            values = np.array([[line[f"eval/{kind}_final"] for line in run[:n]] for run in runs])
            minutes = np.median([[line["eval/minutes"] for line in run[:n]] for run in runs], axis=0)
            middle, low, high = np.median(values, axis=0), values.min(axis=0), values.max(axis=0)
            start = float(runs[0][0][f"eval/{kind}_start"])
            curve = LearningCurve(minutes.tolist(), middle.tolist(), low.tolist(), high.tolist(), start)
            curves.setdefault(kind, {})[name] = curve
    return curves


def draw_learning(curves: LearningCurves) -> str:
    """The picture as an SVG. Raises ConfigError where matplotlib is not installed."""
    panels = [Panel(kind, lines, {"rectangle": next(iter(lines.values())).start}) for kind, lines in curves.items()]
    title = "Mean r_all of unseen targets against minutes of training"
    return draw_panels(panels, title, "minutes of training", "mean r_all")
