"""Learning curves as an SVG: a panel for each kind of target, a line and its range over the seeds for each training."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from benchmarks.curve_picture import BOTTOM, COLOURS, HEIGHT, LEFT, PANEL_WIDTH, RIGHT, TOP
from training.report.axes import Axis, number, tick_label

_STYLE = (
    ".grid{stroke:#dfe3e8;fill:none}.tick{fill:#5c6675;font-size:12px}.label{fill:#1b2230;font-size:13px}"
    ".title{fill:#1b2230;font-size:15px;font-weight:bold}.line{fill:none;stroke-width:2.2}.band{opacity:.14}"
    ".start{stroke:#69707c;stroke-dasharray:4 4;fill:none}"
)
_LABEL_HEIGHT = 15.0


@dataclass(frozen=True)
class Curve:
    """r_all over the minutes of training: median, lowest and highest of the seeds."""

    minutes: list[float]
    middle: list[float]
    low: list[float]
    high: list[float]
    start: float  # r_all of the refitted rectangle


Curves = dict[str, dict[str, Curve]]  # by kind of target, then by training


def learning_curves(groups: Mapping[str, Sequence[Sequence[Mapping[str, float]]]]) -> Curves:
    """From the evaluations in the logs of each training's seeds; the n-th ones of the seeds belong together."""
    curves: Curves = {}
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
            curve = Curve(minutes.tolist(), middle.tolist(), low.tolist(), high.tolist(), start)
            curves.setdefault(kind, {})[name] = curve
    return curves


def draw_learning(curves: Curves) -> str:
    """The picture."""
    names = list(dict.fromkeys(name for lines in curves.values() for name in lines))
    width = PANEL_WIDTH * max(1, len(curves))
    panels = [
        f'<g transform="translate({PANEL_WIDTH * k} 0)">{_panel(kind, lines, names)}</g>'
        for k, (kind, lines) in enumerate(curves.items())
    ]
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {HEIGHT}" '
        'font-family="DejaVu Sans, Helvetica, Arial, sans-serif">'
    )
    title = "<title>Mean r_all of unseen targets against minutes of training</title>"
    ground = f'<rect width="{width}" height="{HEIGHT}" fill="#fff"/>'
    return "\n".join([head, title, f"<style>{_STYLE}</style>", ground, *panels, "</svg>"]) + "\n"


def _panel(kind: str, lines: Mapping[str, Curve], names: Sequence[str]) -> str:
    right, bottom = PANEL_WIDTH - RIGHT, HEIGHT - BOTTOM
    values = [value for curve in lines.values() for value in (*curve.low, *curve.high, curve.start)]
    low, high = min(values), max(values)
    x = Axis(0.0, max(1e-6, *(curve.minutes[-1] for curve in lines.values())), LEFT, right)
    y = Axis(low - 0.05 * (high - low) - 0.5, high + 0.05 * (high - low) + 0.5, bottom, TOP)
    parts = [f'<text class="title" x="{LEFT}" y="20">{escape(kind)}</text>', _frame(x, y)]
    start = number(y.place(next(iter(lines.values())).start))
    parts.append(f'<path class="start" d="M{LEFT} {start}H{right}"/>')
    parts.append(f'<text class="tick" x="{right + 8}" y="{start}">rectangle</text>')
    last = -np.inf
    for name, curve in sorted(lines.items(), key=lambda item: y.place(item[1].middle[-1])):
        last = max(last + _LABEL_HEIGHT, y.place(curve.middle[-1]))
        parts.append(_curve(name, curve, x, y, COLOURS[names.index(name) % len(COLOURS)], float(last)))
    return "".join(parts)


def _frame(x: Axis, y: Axis) -> str:
    right, bottom = PANEL_WIDTH - RIGHT, HEIGHT - BOTTOM
    grid = "".join(f"M{LEFT} {number(y.place(tick))}H{right}" for tick in y.ticks())
    grid += "".join(f"M{number(x.place(tick))} {TOP}V{bottom}" for tick in x.ticks())
    words = [
        f'<text class="tick" x="{LEFT - 7}" y="{number(y.place(tick) + 4)}" text-anchor="end">{tick_label(tick)}</text>'
        for tick in y.ticks()
    ]
    for tick in x.ticks():
        at = f'x="{number(x.place(tick))}" y="{bottom + 18}"'
        words.append(f'<text class="tick" {at} text-anchor="middle">{tick_label(tick)}</text>')
    across, down = number((LEFT + right) / 2), number((TOP + bottom) / 2)
    words += [
        f'<text class="label" x="{across}" y="{HEIGHT - 10}" text-anchor="middle">minutes of training</text>',
        f'<text class="label" transform="translate(14 {down}) rotate(-90)" text-anchor="middle">mean r_all</text>',
    ]
    return f'<path class="grid" d="{grid}"/>{"".join(words)}'


def _curve(name: str, curve: Curve, x: Axis, y: Axis, colour: str, label_at: float) -> str:
    def points(values: Sequence[float]) -> list[str]:
        return [f"{number(x.place(m))} {number(y.place(v))}" for m, v in zip(curve.minutes, values, strict=True)]

    band = "L".join(points(curve.low) + points(curve.high)[::-1])
    label = f'<text class="tick" x="{x.end + 8}" y="{number(label_at + 4)}" style="fill:{colour}">{escape(name)}</text>'
    return (
        f'<path class="band" d="M{band}Z" fill="{colour}"/>'
        f'<path class="line" d="M{"L".join(points(curve.middle))}" stroke="{colour}"/>{label}'
    )
