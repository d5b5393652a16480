"""Curves of r_all against refits as an SVG: a panel for each weight, a line with its 95 % band for each agent."""

from collections.abc import Mapping, Sequence
from html import escape

import numpy as np

from training.report import Interval
from training.report.axes import Axis, number, tick_label

PANEL_WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 470, 380, 52, 96, 34, 52
COLOURS = ("#0072b2", "#d55e00", "#00875f", "#a24399", "#967100", "#69707c")
_LABEL_HEIGHT = 15.0
_STEP = 5.0  # of r_all: the lower end of the axis is a multiple of it
_STYLE = (
    ".grid{stroke:#dfe3e8;fill:none}.tick{fill:#5c6675;font-size:12px}.label{fill:#1b2230;font-size:13px}"
    ".title{fill:#1b2230;font-size:15px;font-weight:bold}.line{fill:none;stroke-width:2.2}.band{opacity:.14}"
)


def draw_curves(curves: Mapping[tuple[str, float, int], Interval]) -> str:
    """`curves`: (agent, w_sc, refits) -> mean r_all, NaN where there is none. Agents keep their colours."""
    weights = list(dict.fromkeys(w_sc for _, w_sc, _ in curves))
    agents = list(dict.fromkeys(agent for agent, _, _ in curves))
    width = PANEL_WIDTH * len(weights)
    panels = [
        f'<g transform="translate({PANEL_WIDTH * k} 0)">{_panel(curves, w_sc, agents)}</g>'
        for k, w_sc in enumerate(weights)
    ]
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {HEIGHT}" '
        'font-family="DejaVu Sans, Helvetica, Arial, sans-serif">'
    )
    ground = f'<rect width="{width}" height="{HEIGHT}" fill="#fff"/>'
    title = "<title>Mean r_all against refits, a panel for each weight of complexity</title>"
    return "\n".join([head, title, f"<style>{_STYLE}</style>", ground, *panels, "</svg>"]) + "\n"


def _panel(curves: Mapping[tuple[str, float, int], Interval], w_sc: float, agents: Sequence[str]) -> str:
    lines = {
        agent: {
            refits: mean
            for (who, weight, refits), mean in curves.items()
            if (who, weight) == (agent, w_sc) and np.isfinite(mean.mean)
        }
        for agent in agents
    }
    ends = [value for line in lines.values() for mean in line.values() for value in mean]
    budgets = sorted({refits for _, weight, refits in curves if weight == w_sc})
    right, bottom = PANEL_WIDTH - RIGHT, HEIGHT - BOTTOM
    x = Axis(budgets[0], max(budgets[-1], budgets[0] + 1), LEFT, right, is_log=True)
    low = _STEP * np.floor(min(ends, default=0.0) / _STEP)
    y = Axis(float(low), max(max(ends, default=1.0), float(low) + 1.0), bottom, TOP)
    parts = [f'<text class="title" x="{LEFT}" y="20">w_sc = {w_sc:g}</text>', _frame(x, y, budgets)]
    places = _apart({agent: y.place(line[max(line)].mean) for agent, line in lines.items() if line})
    for agent, line in lines.items():
        if line:
            parts.append(_curve(agent, line, x, y, COLOURS[agents.index(agent) % len(COLOURS)], places[agent]))
    return "".join(parts)


def _frame(x: Axis, y: Axis, budgets: Sequence[int]) -> str:
    right, bottom = PANEL_WIDTH - RIGHT, HEIGHT - BOTTOM
    lines = "".join(f"M{LEFT} {number(y.place(tick))}H{right}" for tick in y.ticks())
    lines += "".join(f"M{number(x.place(budget))} {TOP}V{bottom}" for budget in budgets)
    words = [
        f'<text class="tick" x="{LEFT - 7}" y="{number(y.place(tick) + 4)}" text-anchor="end">{tick_label(tick)}</text>'
        for tick in y.ticks()
    ]
    words += [
        f'<text class="tick" x="{number(x.place(b))}" y="{bottom + 18}" text-anchor="middle">{b}</text>'
        for b in budgets
    ]
    middle_x, middle_y = number((LEFT + right) / 2), number((TOP + bottom) / 2)
    words += [
        f'<text class="label" x="{middle_x}" y="{HEIGHT - 10}" text-anchor="middle">refits (log scale)</text>',
        f'<text class="label" transform="translate(14 {middle_y}) rotate(-90)" text-anchor="middle">mean r_all</text>',
    ]
    return f'<path class="grid" d="{lines}"/>{"".join(words)}'


def _curve(agent: str, line: Mapping[int, Interval], x: Axis, y: Axis, colour: str, label_at: float) -> str:
    """Band, line and name of one agent."""

    def path(k: int) -> list[str]:
        return [f"{number(x.place(refits))} {number(y.place(mean[k]))}" for refits, mean in line.items()]

    band = "L".join(path(1) + path(2)[::-1])
    dots = "".join(
        f'<circle r="2.8" cx="{number(x.place(refits))}" cy="{number(y.place(mean.mean))}" fill="{colour}"/>'
        for refits, mean in line.items()
    )
    name = f'<text class="tick" x="{x.end + 8}" y="{number(label_at + 4)}" style="fill:{colour}">{escape(agent)}</text>'
    return (
        f'<path class="band" d="M{band}Z" fill="{colour}"/>'
        f'<path class="line" d="M{"L".join(path(0))}" stroke="{colour}"/>{dots}{name}'
    )


def _apart(places: Mapping[str, float]) -> dict[str, float]:
    """Heights of the names, from the top, none on another."""
    apart: dict[str, float] = {}
    last = -np.inf
    for agent, place in sorted(places.items(), key=lambda item: item[1]):
        last = max(place, last + _LABEL_HEIGHT)
        apart[agent] = float(last)
    return apart
