"""Whether a mesh is the one that is wanted: counts, places within a tolerance, edges and faces; what differs, in words.

Vertices are matched by where they lie. Who follows a lesson by hand has no ids, and an undo takes them along.
"""

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise

MOST_TOLD = 4  # differences; the others are counted
MOST_ROUNDS = 20  # of swapping partners that lie on each other

Ids = tuple[int, ...]
Point = tuple[float, float, float]


@dataclass(frozen=True)
class Shape:
    """A mesh, vertices and faces by any ids."""

    places: Mapping[int, Point]
    edges: frozenset[Ids]  # pairs, the lower id first
    faces: Mapping[int, Ids]  # corners, either way round

    @property
    def counts(self) -> tuple[int, int, int]:
        """How many vertices, edges and faces there are."""
        return len(self.places), len(self.edges), len(self.faces)


def shape_of(vertices: Mapping[int, tuple[float, float]], faces: Mapping[int, Ids]) -> Shape:
    """A mesh in the plane that consists of faces."""
    sides = (side for ring in faces.values() for side in pairwise((*ring, ring[0])))
    return Shape({v: (x, y, 0.0) for v, (x, y) in vertices.items()}, frozenset(map(_edge, sides)), faces)


def partners(found: Shape, wanted: Shape, tolerance: float) -> dict[int, int]:
    """For each wanted vertex the one of `found` that stands for it, no farther than `tolerance` away, where one is.

    The nearest are joined first. Of vertices that lie on each other, each gets the one that its faces hang on.
    """
    near = _near(found.places, wanted.places, tolerance)
    joined: dict[int, int] = {}
    taken: set[int] = set()
    for _, v, w in sorted((away, v, w) for v, others in near.items() for w, away in others.items()):
        if v not in joined and w not in taken:
            joined[v] = w
            taken.add(w)
    return _untangled(joined, near, found, wanted)


def differences(found: Shape, wanted: Shape, tolerance: float) -> list[str]:
    """What is otherwise than wanted, a sentence each; nothing if all fits."""
    joined = partners(found, wanted, tolerance)
    names = {w: v for v, w in joined.items()}
    missing = [v for v in wanted.places if v not in joined]
    extra = [w for w in found.places if w not in names]
    told = _count_words(found.counts, wanted.counts)
    if len(found.places) == len(wanted.places):
        away = _paired(missing, extra, found, wanted)
        told += [_away_words(v, found.places[w], wanted.places[v]) for v, w in away]
        names |= {w: v for v, w in away}
    else:
        told += [f"There is no vertex {v} at {_at(wanted.places[v])}." for v in missing]
        told += [_extra_words(found.places[w], found, joined, tolerance) for w in extra]
    told += _edge_words(_renamed(found.edges, names), wanted.edges)
    told += _face_words(found, wanted, names)
    return told


def summary(told: Iterable[str]) -> str:
    """The first differences, and how many more there are, in a line."""
    first = list(told)
    more = len(first) - MOST_TOLD
    return " ".join(first[:MOST_TOLD]) + (f" And {more} more." if more > 0 else "")


# --- who is who


def _near(found: Mapping[int, Point], wanted: Mapping[int, Point], tolerance: float) -> dict[int, dict[int, float]]:
    """For each wanted vertex those of `found` within the tolerance, and how far away they are."""
    cells: defaultdict[tuple[int, ...], list[int]] = defaultdict(list)
    for w, point in found.items():
        if all(map(math.isfinite, point)):
            cells[_cell(point, tolerance)].append(w)
    near: dict[int, dict[int, float]] = {}
    for v, point in wanted.items():
        x, y, z = _cell(point, tolerance)
        around = (cells.get((x + i, y + j, z + k), ()) for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1))
        away = {w: math.dist(point, found[w]) for cell in around for w in cell}
        near[v] = {w: d for w, d in away.items() if d <= tolerance}
    return near


def _cell(point: Point, size: float) -> tuple[int, ...]:
    return tuple(math.floor(value / size) for value in point)


def _untangled(
    joined: dict[int, int], near: Mapping[int, Mapping[int, float]], found: Shape, wanted: Shape
) -> dict[int, int]:
    """Partners swapped where more edges fit then: what lies on each other cannot be told apart by its place."""
    beside: defaultdict[int, set[int]] = defaultdict(set)
    for a, b in wanted.edges:
        beside[a].add(b)
        beside[b].add(a)
    holders: defaultdict[int, list[int]] = defaultdict(list)
    for v, others in near.items():
        for w in others:
            holders[w].append(v)

    def n_fitting(vertices: tuple[int, ...]) -> int:
        ends = {_edge((a, b)) for a in vertices for b in beside[a] if a in joined and b in joined}
        return sum(_edge((joined[a], joined[b])) in found.edges for a, b in ends)

    for _ in range(MOST_ROUNDS):
        n_swapped = 0
        for v in list(joined):
            for u in {u for w in near[v] for u in holders[w]} - {v}:
                if u in joined and joined[u] in near[v] and joined[v] in near[u]:
                    before = n_fitting((v, u))
                    joined[v], joined[u] = joined[u], joined[v]
                    if n_fitting((v, u)) > before:
                        n_swapped += 1
                    else:
                        joined[v], joined[u] = joined[u], joined[v]
        if not n_swapped:
            break
    return joined


def _paired(missing: list[int], extra: list[int], found: Shape, wanted: Shape) -> list[tuple[int, int]]:
    """Wanted vertices and those that are left over, the nearest first."""
    rows = sorted((_distance(found.places[w], wanted.places[v]), v, w) for v in missing for w in extra)
    pairs: dict[int, int] = {}
    for _, v, w in rows:
        if v not in pairs and w not in pairs.values():
            pairs[v] = w
    return list(pairs.items())


def _distance(a: Point, b: Point) -> float:
    away = math.dist(a, b)
    return away if math.isfinite(away) else math.inf


# --- words


def _count_words(found: tuple[int, int, int], wanted: tuple[int, int, int]) -> list[str]:
    wrong = [
        f"{_count(abs(n - m), noun)} too {'many' if n > m else 'few'}"
        for n, m, noun in zip(found, wanted, ("vertex", "edge", "face"), strict=True)
        if n != m
    ]
    return [f"{', '.join(wrong).capitalize()}."] if wrong else []


def _away_words(name: int, found: Point, wanted: Point) -> str:
    by = tuple(b - a for a, b in zip(found, wanted, strict=True))
    typed = " Tab ".join(_number(value) for value in (by if abs(by[2]) >= 0.0005 else by[:2]))
    away = f"{_distance(found, wanted):.3f} from its place {_at(wanted)}"
    return f"Vertex {name} is {away}: move it there, G {typed} Enter."


def _extra_words(point: Point, found: Shape, joined: Mapping[int, int], tolerance: float) -> str:
    for v, w in joined.items():
        if _distance(found.places[w], point) <= tolerance:
            return f"A vertex too many lies on vertex {v}: select both, M, By Distance."
    return f"The vertex at {_at(point)} should not be there."


def _edge_words(found: Iterable[Ids | None], wanted: frozenset[Ids]) -> list[str]:
    there = {edge for edge in found if edge is not None}
    told = [f"Edge {a}–{b} is missing." for a, b in sorted(wanted - there)]
    return told + [f"There should be no edge {a}–{b}." for a, b in sorted(there - wanted)]


def _face_words(found: Shape, wanted: Shape, names: Mapping[int, int]) -> list[str]:
    there = {_cycle([names[v] for v in ring]) for ring in found.faces.values() if all(v in names for v in ring)}
    rings = {_cycle(ring): name for name, ring in wanted.faces.items()}
    told = [f"Face {name} between {_listed(ring)} is missing." for ring, name in rings.items() if ring not in there]
    return told + [f"There should be no face between {_listed(ring)}." for ring in sorted(there - rings.keys())]


def _renamed(edges: Iterable[Ids], names: Mapping[int, int]) -> list[Ids | None]:
    return [_edge((names[a], names[b])) if a in names and b in names else None for a, b in edges]


def _cycle(ring: Iterable[int]) -> Ids:
    """The corners from the lowest id on, the way round on which the lower neighbour comes first."""
    corners = list(ring)
    first = corners.index(min(corners))
    turned = corners[first:] + corners[:first]
    return tuple(turned if turned[1] <= turned[-1] else [turned[0], *turned[:0:-1]])


def _edge(ends: Ids) -> Ids:
    a, b = ends
    return (a, b) if a < b else (b, a)


def _listed(ring: Ids) -> str:
    return ", ".join(map(str, ring))


def _at(point: Point) -> str:
    x, y, z = point
    return f"({x:.3f}, {y:.3f})" if abs(z) < 0.0005 else f"({x:.3f}, {y:.3f}, {z:.3f})"


def _number(value: float) -> str:
    text = f"{value:.3f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def _count(n: int, noun: str) -> str:
    return f"{n} {noun if n == 1 else {'vertex': 'vertices'}.get(noun, noun + 's')}"
