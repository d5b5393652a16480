"""Curves with their bands as an SVG, drawn by matplotlib: a panel beside the other, one legend for all."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from agents.extras import require

COLOURS = ("#0072b2", "#d55e00", "#00875f", "#a24399", "#967100", "#69707c")  # by number of the name
GREY, INK = "#dfe3e8", "#1b2230"
_STYLE: Any = {
    "svg.fonttype": "none",  # texts stay texts
    "svg.hashsalt": "autopoly",  # the same curves give the same file
    "text.parse_math": False,
    "font.size": 10,
    "axes.edgecolor": GREY,
    "axes.labelcolor": INK,
    "axes.grid": True,
    "grid.color": GREY,
    "xtick.color": INK,
    "ytick.color": INK,
}


@dataclass(frozen=True)
class Curve:
    """A line and its band over x, all of one length."""

    x: Sequence[float]
    middle: Sequence[float]
    low: Sequence[float]
    high: Sequence[float]


@dataclass(frozen=True)
class Panel:
    """Curves by name, and levels by name, which are drawn as dashed lines."""

    title: str
    curves: Mapping[str, Curve]
    levels: Mapping[str, float] = field(default_factory=dict)


def need_matplotlib() -> None:
    """Raise ConfigError where matplotlib is not installed."""
    require("bench", "a picture of curves", "matplotlib")


def draw_panels(
    panels: Sequence[Panel], title: str, x_label: str, y_label: str, ticks: Sequence[float] | None = None
) -> str:
    """The SVG. With `ticks` the x axis is logarithmic and has these; names keep their colours from panel to panel.

    Raises ConfigError where matplotlib is not installed.
    """
    need_matplotlib()
    import matplotlib
    from matplotlib.figure import Figure

    names = list(dict.fromkeys(name for panel in panels for name in panel.curves))
    stream = io.StringIO()
    with matplotlib.rc_context(_STYLE):
        figure = Figure(figsize=(4.2 * max(1, len(panels)) + 1.4, 3.8), layout="constrained")
        shown: dict[str, Any] = {}  # a line of each name
        for axes, panel in zip(np.atleast_1d(figure.subplots(1, max(1, len(panels)))), panels, strict=False):
            axes.set(title=panel.title, xlabel=x_label, ylabel=y_label)
            if ticks is not None:
                axes.set_xscale("log")
                axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
                axes.minorticks_off()
            shown |= _draw(axes, panel, names)
        figure.legend(list(shown.values()), list(shown), loc="outside right upper", frameon=False)
        figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None, "Title": title})
    return stream.getvalue()


def _draw(axes: Any, panel: Panel, names: Sequence[str]) -> dict[str, Any]:
    """Draw a panel; returns its lines by name."""
    lines = {}
    for name, curve in panel.curves.items():
        colour = COLOURS[names.index(name) % len(COLOURS)]
        axes.fill_between(curve.x, curve.low, curve.high, color=colour, alpha=0.14, linewidth=0.0)
        marker = "o" if len(curve.x) < 20 else ""
        (line,) = axes.plot(curve.x, curve.middle, color=colour, linewidth=2.0, marker=marker, markersize=4.0)
        line.set_gid(f"line {name}")
        lines[name] = line
    for name, level in panel.levels.items():
        lines[name] = axes.axhline(level, color=COLOURS[-1], linewidth=1.0, linestyle="--")
    return lines
