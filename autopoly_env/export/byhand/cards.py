"""Cards: what to do by hand in Blender for the start of a construction and for each of its steps, line by line."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from autopoly_env.errors import AutoPolyError
from autopoly_env.export.byhand import saying
from autopoly_env.export.byhand.hand import DIGITS, SEEN, Hand, Line, Making, Place, is_close, way
from autopoly_env.export.byhand.reasons import reason
from autopoly_env.export.byhand.starting import begin
from autopoly_env.export.replay import finite_meshes
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import HoleChoice, Operator, operator_named
from autopoly_env.operators.deeds import Cut, Ids, Loop, Selection
from autopoly_env.sequence import ConstructionSequence, Step, parts_of
from autopoly_env.sequence.ids import decoded


@dataclass(frozen=True)
class Card:
    """What to do for one step; whoever has followed all cards before it has the mesh that it begins with."""

    operator: str  # "start" for the first card
    lines: tuple[Line, ...]
    aims: dict[int, Place]  # the vertices that are placed, and where: Blender's units, y up
    picks: tuple[str, ...] = ()  # what is clicked of the mesh before the step: "edge 0–1", "vertex 4", "face 3"
    why: str = ""  # what the step is good for


def cards_of(sequence: ConstructionSequence) -> list[Card]:
    """The card of the start and one for each step. Raises SequenceError if the sequence cannot be replayed."""
    meshes = finite_meshes(sequence)
    hand = Hand()
    begin(hand, meshes[0], _places(meshes[0]))
    parts = parts_of(sequence)
    cards = [Card("start", _taken(hand), _places(meshes[0]))]
    for number, (step, before, after) in enumerate(zip(sequence.steps, meshes, meshes[1:], strict=False), 1):
        known = dict(hand.places)
        _follow(hand, step, before, after)
        wanted = _places(after)
        aims = {v: place for v, place in wanted.items() if v not in known or _is_seen(known[v], hand.places[v])}
        why = reason(number, step, before, after, parts)
        picks = tuple(saying.element(*pick) for pick in picks_of(step, before))
        cards.append(Card(step.operator, _taken(hand), aims, picks, why))
    return cards


def picks_of(step: Step, before: PolyMesh) -> tuple[tuple[str, Ids], ...]:
    """What is pointed at of the mesh before a step: kinds, and ids of which edges have two, ascending."""
    picked: list[tuple[str, Ids]] = []
    for deed in operator_named(step.operator).told.keys(step):
        match deed:
            case Selection():
                picked += [(deed.kind, ids) for ids in deed.elements if deed.kind != "face" or len(ids) == 1]
            case Loop():
                picked.append(("edge", deed.edge))
            case Cut():
                old = set(before.vertex_ids)
                picked += [("vertex", (v,)) for path in deed.paths for v in path if v in old]
            case str():
                kind, ids = next(iter(step.element.items()))
                picked.append((kind, tuple(ids) if isinstance(ids, list) else (ids,)))
    return tuple(dict.fromkeys((kind, tuple(sorted(ids))) for kind, ids in picked))


def _is_seen(a: Place, b: Place) -> bool:
    return max(abs(a[0] - b[0]), abs(a[1] - b[1])) >= SEEN


def _taken(hand: Hand) -> tuple[Line, ...]:
    lines, hand.lines = tuple(hand.lines), []
    return lines


def _follow(hand: Hand, step: Step, before: PolyMesh, after: PolyMesh) -> None:
    """All that a step takes: the deeds of its operator, then vertices moved to their places."""
    operator, element, choice = decoded(before, step)
    making = _making(hand, step, before, after, operator, element, choice)
    for deed in operator.told.keys(step):
        hand.do(deed, making)
    left = [v for v, place in making.wanted.items() if not is_close(hand.places[v], place)]
    afresh = True
    while left:
        first = left[0]
        by = way(hand.places[first], making.wanted[first])
        alike = [v for v in left if is_close(tuple(np.add(hand.places[v], by).tolist()), making.wanted[v])]
        hand.move(alike, making.wanted[first], afresh=afresh)
        left = [v for v in left if v not in alike]
        afresh = False


def _making(
    hand: Hand, step: Step, before: PolyMesh, after: PolyMesh, operator: Operator, element: int, choice: Any
) -> Making:
    """What the operator makes of the mesh as it is under the hand, whose places are rounded."""
    typed, factor = _typed(choice)
    there = before.with_vertices(np.array([(x, 1.0 - y) for x, y in map(hand.places.__getitem__, before.vertex_ids)]))
    try:
        made = operator.apply(there, element, typed)
    except AutoPolyError:  # the rounding has taken the room for it
        there, typed = before, choice
        made = operator.apply(there, element, typed)
    new = step.created["vertices"]
    sources = operator.sources_of(there, element, typed, made)
    return Making(
        made,
        {v: place for v, place in _places(made).items() if v in set(new)},
        {v: (float(x), 1.0 - float(y)) for v, (x, y) in zip(new, sources.tolist(), strict=True)},
        _places(after),
        factor,
    )


def _typed(choice: Any) -> tuple[Any, float]:
    """A choice as a hand makes it: with as many digits as are told; and the factor of a slide, -1 to 1."""
    if isinstance(choice, HoleChoice):
        points = tuple((round(x, DIGITS), round(y, DIGITS)) for x, y in choice.points)
        return HoleChoice(points, choice.bridges), 0.0
    if isinstance(choice, float):
        factor = round(2.0 * choice - 1.0, DIGITS) + 0.0
        return 0.5 * (1.0 + factor), factor
    return choice, 0.0


def _places(mesh: PolyMesh) -> dict[int, Place]:
    """Where the vertices belong in Blender, by id."""
    return {name: (x, 1.0 - y) for name, (x, y) in zip(mesh.vertex_ids, mesh.vertices.tolist(), strict=True)}
