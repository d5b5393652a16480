"""The gallery of a report: every agent's mesh of the worst targets, over the target and as a difference from it.

A picture of a difference needs no pixels of its own: the mesh in the colour of excess, then the target's mask in that
of what is missing, then the mesh again, through the mask, in that of a match. Both are in the page once.
"""

import base64
import io
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

import numpy as np
from PIL import Image

from autopoly_env.arrays import BoolArray
from autopoly_env.errors import AutoPolyError, SilhouetteError
from autopoly_env.silhouette import Silhouette
from training.records import Outcome, Record
from training.report.axes import number
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


@dataclass(frozen=True)
class Drawing:
    """A mesh as paths of SVG, SIZE user units a side."""

    faces: str
    edges: str
    dots: str


@dataclass(frozen=True)
class Figure:
    """What an agent made of a target; without a drawing `problem` says why there is none."""

    series: int
    label: str
    record: Record
    n_seeds: int  # of which this is the worst
    is_best: bool  # of the card
    drawing: Drawing | None
    problem: str


@dataclass(frozen=True)
class ShownCard:
    """A card as the page shows it."""

    target: str
    picture: str | None  # base64 of a PNG, white where the target is
    figures: list[Figure]


@dataclass(frozen=True)
class Gallery:
    """The cards, and the measures of their pictures in user units."""

    cards: list[ShownCard]
    size: int = SIZE
    margin: int = MARGIN
    side: int = SIZE + 2 * MARGIN


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


def gallery_of(comparison: Comparison, cards: Sequence[Card]) -> Gallery:
    """What the page shows of the cards."""
    return Gallery([_shown_card(comparison, card) for card in cards])


def _shown_card(comparison: Comparison, card: Card) -> ShownCard:
    best = max((total for total in card.totals if total is not None), default=None)
    figures = [
        _figure(series, record, k, is_best=total is not None and total == best)
        for k, (series, record, total) in enumerate(zip(comparison.series, card.records, card.totals, strict=True))
        if record is not None
    ]
    return ShownCard(card.target, _target_png(comparison, card), figures)


def _figure(series: Series, record: Record, k: int, *, is_best: bool) -> Figure:
    n_seeds = sum(other.target == record.target for other in series.records)
    drawing, problem = (None, "") if record.outcome is None else _drawn(record.outcome)
    return Figure(k, series.label, record, n_seeds, is_best, drawing, problem)


def _drawn(outcome: Outcome) -> tuple[Drawing | None, str]:
    """The drawing of a mesh, or why there is none."""
    try:
        mesh = outcome.mesh.polymesh()
    except AutoPolyError as error:
        return None, str(error)
    if len(mesh.topology.half_edges) > MOST_CORNERS:
        return None, f"{len(mesh.vertices)} vertices are too many for a picture"
    places = [f"{number(SIZE * x)} {number(SIZE * y)}" for x, y in mesh.vertices.tolist()]
    faces = "".join(f"M{'L'.join(places[v] for v in face)}z" for face in mesh.faces)
    edges = "".join(f"M{places[a]}L{places[b]}" for a, b in mesh.edges.tolist())
    return Drawing(faces, edges, "".join(f"M{place}h0" for place in places)), ""


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
