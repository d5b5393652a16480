"""Curves of r_all against refits: a panel for each weight, a line with its 95 % band for each agent."""

from collections.abc import Mapping

import numpy as np

from benchmarks.curves import Curve, Panel, draw_panels
from training.report import Interval


def draw_curves(totals: Mapping[tuple[str, float, int], Interval]) -> str:
    """The picture as an SVG; `totals`: (agent, w_sc, refits) -> mean r_all, NaN where there is none.

    Raises ConfigError where matplotlib is not installed.
    """
    weights = list(dict.fromkeys(w_sc for _, w_sc, _ in totals))
    agents = list(dict.fromkeys(agent for agent, _, _ in totals))
    panels = []
    for w_sc in weights:
        curves = {agent: _curve(totals, agent, w_sc) for agent in agents}
        panels.append(Panel(f"w_sc = {w_sc:g}", {agent: curve for agent, curve in curves.items() if curve.x}))
    title = "Mean r_all against refits, a panel for each weight of complexity"
    budgets = sorted({refits for _, _, refits in totals})
    return draw_panels(panels, title, "refits (log scale)", "mean r_all", ticks=budgets)


def _curve(totals: Mapping[tuple[str, float, int], Interval], agent: str, w_sc: float) -> Curve:
    """What is known of an agent at a weight, by refits."""
    known = {refits: mean for (name, weight, refits), mean in totals.items() if (name, weight) == (agent, w_sc)}
    refits = sorted(n for n, mean in known.items() if np.isfinite(mean.mean))
    middle, low, high = ([known[n][k] for n in refits] for k in range(3))
    return Curve(refits, middle, low, high)
