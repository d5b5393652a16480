"""The gallery of a report: every agent's mesh of the worst targets, over the target and as a difference from it.

A picture of a difference needs no pixels of its own: the mesh in the colour of excess, then the target's mask in that
of what is missing, then the mesh again, through the mask, in that of a match. Both are in the page once.
"""

import base64
import io
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from itertools import zip_longest
from pathlib import Path

import numpy as np
from PIL import Image

from autopoly_env.arrays import BoolArray
from autopoly_env.errors import AutoPolyError, SilhouetteError
from autopoly_env.silhouette import Silhouette
from training.records import Outcome, Record
from training.report.axes import number
from training.report.charts import colour_class, marker
from training.report.comparison import MEANS, Comparison, Series

SIZE = 100  # user units a side of the unit square
MOST_PIXELS = 256  # a side of a target's picture in the page
MOST_READ = 8192  # of a picture that is read at all
MOST_CORNERS = 4000  # of all meshes of a card; no picture shows more
MARGIN = 5


@dataclass(frozen=True)
class Card:
    """One target: for every series the record to show, the worst of its seeds, or None where it has none."""

    target: str
    records: tuple[Record | None, ...]
    totals: tuple[float | None, ...]  # r_all, mean over the seeds

    @property
    def mean(self) -> float:
        """Mean r_all over the series; a failure counts as none."""
        known = [total for total in self.totals if total is not None]
        return float(np.mean(known)) if known else -np.inf


def worst_cards(comparison: Comparison, n: int) -> list[Card]:
    """The n targets that are worst in turn for all series together and for each of them; the worst mean first."""
    totals = [series.by_target(MEANS["r_all"]) for series in comparison.series]
    shown = [_worst_records(series) for series in comparison.series]
    cards = [
        Card(target, tuple(r.get(target) for r in shown), tuple(t.get(target) for t in totals))
        for target in comparison.targets
    ]
    order = sorted(cards, key=lambda card: card.mean)
    own = [sorted((c for c in cards if c.records[i]), key=lambda c: _badness(c, i)) for i in range(len(shown))]
    in_turn = [card.target for turn in zip_longest(order, *own) for card in turn if card is not None]
    chosen = set(list(dict.fromkeys(in_turn))[:n])
    return [card for card in order if card.target in chosen]


def gallery_html(comparison: Comparison, cards: Sequence[Card]) -> str:
    """The cards as HTML; their pictures of targets are masks #t0, #t1, ..."""
    return "\n".join(_card_html(comparison, card, i) for i, card in enumerate(cards))


def _badness(card: Card, i: int) -> float:
    total = card.totals[i]
    return -np.inf if total is None else total


def _worst_records(series: Series) -> dict[str, Record]:
    """The record of each target that failed or else has the lowest r_all."""
    worst: dict[str, Record] = {}
    for record in series.records:
        if record.target not in worst or _total(record) < _total(worst[record.target]):
            worst[record.target] = record
    return worst


def _total(record: Record) -> float:
    return -np.inf if record.outcome is None else record.outcome.r_all


def _card_html(comparison: Comparison, card: Card, i: int) -> str:
    picture = _target_png(comparison, card)
    mask = "" if picture is None else f'<image width="{SIZE}" height="{SIZE}" href="data:image/png;base64,{picture}"/>'
    best = max((total for total in card.totals if total is not None), default=None)
    figures = [
        _figure_html(series, record, i, k, is_best=total is not None and total == best)
        for k, (series, record, total) in enumerate(zip(comparison.series, card.records, card.totals, strict=True))
        if record is not None
    ]
    lost = "" if picture else '<p class="note">the picture of this target is missing</p>'
    return (
        f'<article class="card" data-i="{i}"><header><svg viewBox="{_view()}" aria-hidden="true"><defs>'
        f'<mask id="t{i}" style="mask-type:luminance">{mask}</mask></defs>'
        f"{_around()}"
        f'<rect class="target" width="{SIZE}" height="{SIZE}" mask="url(#t{i})"/></svg>'
        f"<h3>{escape(card.target)}</h3>{lost}</header>"
        f'<div class="figures">{"".join(figures)}</div></article>'
    )


def _figure_html(series: Series, record: Record, i: int, k: int, *, is_best: bool) -> str:
    head = (
        f'<figcaption class="{colour_class(k)}"><svg class="key" viewBox="-7 -7 14 14" aria-hidden="true">'
        f'<use href="#m{marker(k)}"/></svg><b>{escape(series.label)}</b>'
        f"{'<i>best</i>' if is_best else ''}{_seed_note(series, record)}</figcaption>"
    )
    outcome = record.outcome
    if outcome is None:
        return f'<figure data-s="{k}">{head}<p class="failed">{escape(record.error or "failed")}</p></figure>'
    numbers = (
        f"<dl><div><dt>r_all</dt><dd>{outcome.r_all:.2f}</dd></div><div><dt>r_sm</dt><dd>{outcome.r_sm:.4f}</dd></div>"
        f"<div><dt>r_sc</dt><dd>{outcome.r_sc}</dd></div><div><dt>r_si</dt><dd>{outcome.r_si}</dd></div></dl>"
    )
    return f'<figure data-s="{k}">{head}{_pictures(outcome, i, k)}{numbers}</figure>'


def _seed_note(series: Series, record: Record) -> str:
    n_seeds = sum(other.target == record.target for other in series.records)
    return "" if n_seeds == 1 else f"<small>worst of {n_seeds} seeds: {record.seed}</small>"


def _pictures(outcome: Outcome, i: int, k: int) -> str:
    """The mesh over its target, and the difference between the two."""
    try:
        mesh = outcome.mesh.polymesh()
    except AutoPolyError as error:
        return f'<p class="failed">{escape(str(error))}</p>'
    if len(mesh.topology.half_edges) > MOST_CORNERS:
        return f'<p class="failed">{len(mesh.vertices)} vertices are too many for a picture</p>'
    name = f"g{i}-{k}"
    places = [f"{number(SIZE * x)} {number(SIZE * y)}" for x, y in mesh.vertices.tolist()]
    faces = "".join(f"M{'L'.join(places[v] for v in face)}z" for face in mesh.faces)
    edges = "".join(f"M{places[a]}L{places[b]}" for a, b in mesh.edges.tolist())
    dots = "".join(f"M{place}h0" for place in places)
    square, around = f'<rect width="{SIZE}" height="{SIZE}"', _around()
    return (
        f'<div class="pair"><svg viewBox="{_view()}" role="img" aria-label="mesh"><defs><path id="{name}" d="{faces}"/>'
        f'</defs>{around}{square} class="ghost" mask="url(#t{i})"/>'
        f'<use href="#{name}" class="faces"/><path class="edges" d="{edges}"/><path class="dots" d="{dots}"/></svg>'
        f'<svg viewBox="{_view()}" role="img" aria-label="difference">{around}'
        f'<use href="#{name}" class="excess"/>{square} class="missing" mask="url(#t{i})"/>'
        f'<g mask="url(#t{i})"><use href="#{name}" class="match"/></g></svg></div>'
    )


def _view() -> str:
    side = SIZE + 2 * MARGIN
    return f"{-MARGIN} {-MARGIN} {side} {side}"


def _around() -> str:
    """The square that a picture stands in."""
    side = SIZE + 2 * MARGIN
    return f'<rect x="{-MARGIN}" y="{-MARGIN}" width="{side}" height="{side}" class="frame"/>'


def _target_png(comparison: Comparison, card: Card) -> str | None:
    """The target in white on black, as base64 of a PNG of two colours; None if its picture cannot be had."""
    for series, record in zip(comparison.series, card.records, strict=True):
        path = comparison.runs[series.run].picture(card.target) if record else None
        mask = _read_mask(path) if path else None
        if mask is not None:
            stream = io.BytesIO()
            Image.fromarray(mask).save(stream, "PNG", optimize=True)
            return base64.b64encode(stream.getvalue()).decode("ascii")
    return None


def _read_mask(path: Path) -> BoolArray | None:
    """(R, R) where a target's picture is white, R at most MOST_PIXELS; None for a file that is no such picture."""
    try:
        with Image.open(path) as picture:
            if picture.width != picture.height or picture.width > MOST_READ:
                return None
            silhouette = Silhouette(np.asarray(picture.convert("L")) >= 128)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError, SilhouetteError):
        return None
    return silhouette.target(min(MOST_PIXELS, silhouette.resolution)).mask
