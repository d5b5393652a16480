"""A hand in Blender: it does the deeds of a step, one act after the other, and knows after each what Blender has.

What it knows is the select mode, what is selected, and where every vertex lies, in Blender's units: the unit square of
the XY plane, y up. Where something has to come to a place, the distance is rounded to what one would type, and all that
follows is reckoned from there. An act is plain data (JSON) with elements by their places, which is all that a driver in
Blender needs; docs/lessons.md lists the acts.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from autopoly_env.export.byhand import saying
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators.deeds import Cut, Deed, Ids, Loop, Press, Pull, Selection

DIGITS = 4  # of a distance that is typed, in units of the unit square
SEEN = 0.005  # units; who drags by eye need not care for less
CLOSE = 0.0002  # of a coordinate; a vertex that is so near to its place stays
MODE_KEYS = {"vertex": "1", "edge": "2", "face": "3"}

Place = tuple[float, float]
Act = dict[str, Any]


@dataclass(frozen=True)
class Line:
    """One line of a card: what to do, and what Blender is like then; keys to press stand between backticks."""

    words: str
    state: str  # "" where it is not known
    acts: tuple[Act, ...]  # the same as data; each with "mode" and "selected" as they are after it


@dataclass(frozen=True)
class Making:
    """What a step makes, as far as a hand has to know."""

    mesh: PolyMesh  # after the operator
    made: Mapping[int, Place]  # where the operator puts each new vertex, by id
    sources: Mapping[int, Place]  # what each of them was made of
    wanted: Mapping[int, Place]  # where every vertex belongs in the end
    factor: float = 0.0  # of the slide of a loop, -1 to 1


@dataclass
class Hand:
    """Blender while somebody follows a construction, and the lines that tell it."""

    places: dict[int, Place] = field(default_factory=dict)
    rings: dict[int, Ids] = field(default_factory=dict)  # the corners of each face, by its id
    wires: set[Ids] = field(default_factory=set)  # edges without a face
    names: dict[int, str] = field(default_factory=dict)  # what a vertex is called where its id says nothing yet
    mode: str = "object"
    selected: set[Ids] = field(default_factory=set)  # of the mode's kind: (vertex,), ends and corners sorted
    beneath: set[Ids] = field(default_factory=set)  # vertices that are selected without it showing in this mode
    lines: list[Line] = field(default_factory=list)
    acts: list[Act] = field(default_factory=list)  # of the line that is being written

    def do(self, deed: Deed | str, step: Making) -> None:
        """A deed of a step."""
        match deed:
            case Selection():
                self.select(deed)
            case Press():
                passing = [place for v, place in self.places.items() if v < 0]
                made = dict.fromkeys(step.made, _mean(passing)) if passing else step.made
                self.know(step.mesh, step.sources if deed.on_sources else made)
                self.press(deed)
            case Pull():
                self._pull(deed, step)
            case Loop():
                self._loop(deed, step)
            case Cut():
                self._cut(deed, step)
            case str():
                self.know(step.mesh, step.made)
                self.selected = set()  # it is not known
                self.acts.append({"do": "unknown", "mode": "", "selected": []})
                self.lines.append(Line(deed, "", tuple(self.acts)))
                self.acts = []

    def know(self, mesh: PolyMesh, made: Mapping[int, Place]) -> None:
        """Blender has this mesh now; `made` has the places of the vertices that are new."""
        ids = mesh.vertex_ids
        self.places = {name: made.get(name) or self.places[name] for name in ids}
        self.rings = {name: tuple(ids[v] for v in ring) for name, ring in zip(mesh.face_ids, mesh.faces, strict=True)}
        self.wires = set()

    def end_line(self, words: str) -> None:
        """All acts since the last line, in words."""
        faces = {tuple(sorted(ring)): name for name, ring in self.rings.items()}
        self.lines.append(Line(words, saying.state(self.mode, self.selected, faces), tuple(self.acts)))
        self.acts = []

    def note(self, act: Act) -> None:
        """An act, after which Blender is as the hand knows by now."""
        selected = sorted([_listed(self.places[v]) for v in element] for element in self.selected)
        self.acts.append({**act, "mode": self.mode, "selected": selected})

    # --- what a hand does

    def select(self, what: Selection, *, afresh: bool = False, ends: bool = True) -> str:
        """The key of the mode, and clicks; with `afresh`, or for no element, whatever is selected is let go of first.

        Without `ends` it is the beginning of a line, which it returns.
        """
        words = [saying.mode(MODE_KEYS[what.kind], what.kind)]
        if self.beneath and what.kind == "vertex":
            self.selected = self.beneath
        else:
            self.selected = self._as(what.kind, Selection(self.mode, tuple(self.selected)))
        self.mode, self.beneath = what.kind, set() if what.kind != self.mode else self.beneath
        self.note({"do": "mode", "keys": [MODE_KEYS[what.kind]], "kind": what.kind})
        if not what.elements or (afresh and self.selected):
            self.selected, self.beneath = set(), set()
            self.note({"do": "nothing", "keys": ["Alt", "A"]})
            words.append("`Alt` `A`: nothing is selected" if what.elements else "`Alt` `A`")
        if what.elements:
            words.append(self._click(what))
        if ends:
            self.end_line(", ".join(words))
        return ", ".join(words)

    def press(self, what: Press) -> None:
        """A key, perhaps with an entry of a menu or a number."""
        if what.leaves is not None:
            self.selected = self._as(self.mode, what.leaves)
            is_hidden = self.mode == "edge" and what.leaves.kind == "vertex" and not self.selected
            self.beneath = set(what.leaves.elements) if is_hidden else set()
        self.note(
            {
                "do": "press",
                "keys": list(what.keys),
                "entry": what.entry,
                "unticked": list(what.unticked),
                "typed": what.typed,
            }
        )
        self.end_line(saying.press(what))

    def move(self, vertices: Sequence[int], to: Place, *, afresh: bool = False) -> None:
        """Click vertices and move them so that the first comes to a place, or as near as one types."""
        words = self.select(Selection("vertex", tuple((v,) for v in vertices)), afresh=afresh, ends=False)
        by = way(self.places[vertices[0]], to)
        self.places |= {v: _sum(self.places[v], by) for v in vertices}
        self.note({"do": "drag", "keys": ["G"], "by": by})
        name = self.called(vertices[0]) if len(vertices) > 1 else "it"
        doing = "move them" if len(vertices) > 1 else "move it"
        seen = "" if max(map(abs, by)) >= SEEN else " (hardly to be seen)"
        self.end_line(f"{words}; {saying.drag('G', doing, name, self.places[vertices[0]], by)}{seen}")

    def grow(self, key: str, vertex: int, to: Place) -> None:
        """A new vertex out of the one that is selected, joined to it by an edge (E) or not (Shift D)."""
        ((source,),) = self.selected
        by = way(self.places[source], to)
        self.places[vertex] = _sum(self.places[source], by)
        self.selected = {(vertex,)}
        keys = key.split()
        if keys == ["E"]:
            self.wires.add(_edge(source, vertex))
        self.note({"do": "drag", "keys": keys, "by": by})
        self.end_line(saying.drag("` `".join(keys), "pull out a new vertex", "it", self.places[vertex], by))

    def called(self, vertex: int) -> str:
        """The name of a vertex."""
        return self.names.get(vertex) or saying.element("vertex", (vertex,))

    def has_edge(self, a: int, b: int) -> bool:
        """Whether an edge joins two vertices."""
        return _edge(a, b) in self._edges()

    # --- how each is done

    def _click(self, what: Selection) -> str:
        self.selected, self.beneath, words = set(), set(), []
        for number, element in enumerate(what.elements):
            self.selected |= self._as(what.kind, Selection(what.kind, (element,)))
            ring = self.rings[element[0]] if what.kind == "face" and len(element) == 1 else element
            at = [_listed(self.places[v]) for v in ring]
            self.note({"do": "click", "kind": what.kind, "at": at, "shift": number > 0})
            name = self.called(*element) if what.kind == "vertex" else saying.element(what.kind, element)
            if what.kind == "face" and len(element) > 1:
                name = "the face in the hole"
            words.append(saying.click(name, number > 0))
        return ", ".join(words)

    def _pull(self, deed: Pull, step: Making) -> None:
        """Drag the copies along the way after which the fewer are left to move."""
        if deed.middle is None:
            sources = {copy: _neighbour(step.mesh, copy, deed.sources) for copy in deed.copies}
            aims = {copy: step.wanted[copy] for copy in deed.copies}
            ways = {copy: way(self.places[sources[copy]], aims[copy]) for copy in deed.copies}

            def n_left(by: Place) -> int:
                return sum(not is_close(_sum(self.places[sources[v]], by), aims[v]) for v in deed.copies)

            aim = min(deed.copies, key=lambda copy: n_left(ways[copy]))
            by, name = ways[aim], f"vertex {aim}"
            places = {copy: _sum(self.places[sources[copy]], by) for copy in deed.copies}
            self.know(step.mesh, places)
            to = places[aim]
        else:
            middle = _mean([self.places[v] for v in deed.sources])
            by, name = way(middle, step.wanted[deed.middle]), "its middle"
            sources = dict(zip(deed.copies, deed.sources, strict=True))
            self.places |= {copy: _sum(self.places[sources[copy]], by) for copy in deed.copies}
            to = _sum(middle, by)
        self.selected = {_edge(*deed.copies)}
        self.note({"do": "drag", "keys": ["E"], "by": by})
        self.end_line(saying.drag("E", "pull the new edge out", name, to, by))

    def _loop(self, deed: Loop, step: Making) -> None:
        at = [_listed(self.places[v]) for v in deed.edge]
        self.know(step.mesh, step.made)
        self.selected = {edge for edge in self._edges() if set(edge) <= set(step.made)}
        (first,) = (v for v in step.made if {_edge(v, end) for end in deed.edge} <= self._edges())
        self.note({"do": "loop", "keys": ["Ctrl", "R"], "at": at, "to": self.places[first], "factor": step.factor})
        slide = (f"vertex {first}", self.places[first], step.factor) if step.factor else None
        self.end_line(saying.loop(deed.edge, slide))

    def _cut(self, deed: Cut, step: Making) -> None:
        self.know(step.mesh, step.made)
        paths = [[_listed(self.places[v]) for v in path] for path in deed.paths]
        self.note({"do": "cut", "keys": ["K"], "paths": paths})
        new, words = set(step.made), []
        for path in deed.paths:
            words.append([saying.place(self.places[v]) if v in new else f"vertex {v}" for v in path])
            new -= set(path)
        self.end_line(saying.cut(words))

    # --- what is selected

    def _edges(self) -> set[Ids]:
        sides = (pair for ring in self.rings.values() for pair in pairwise((*ring, ring[0])))
        return {_edge(*side) for side in sides} | self.wires

    def _as(self, kind: str, what: Selection) -> set[Ids]:
        """The elements that are selected in a mode once `what` is selected in its own."""
        rings = [self.rings[ids[0]] if what.kind == "face" and len(ids) == 1 else ids for ids in what.elements]
        if kind == what.kind:
            return {tuple(sorted(ring)) for ring in rings}
        vertices = {v for ring in rings for v in ring}
        if kind == "vertex":
            return {(v,) for v in vertices}
        if what.kind == "face":
            edges = {_edge(*pair) for ring in rings for pair in pairwise((*ring, ring[0]))}
        elif what.kind == "edge":
            edges = {_edge(*ring) for ring in rings}
        else:
            edges = {edge for edge in self._edges() if set(edge) <= vertices}
        if kind == "edge":
            return edges
        return {
            tuple(sorted(ring))
            for ring in self.rings.values()
            if all(_edge(*pair) in edges for pair in pairwise((*ring, ring[0])))
        }


def way(begin: Place, end: Place) -> Place:
    """The distance to type."""
    return round(end[0] - begin[0], DIGITS) + 0.0, round(end[1] - begin[1], DIGITS) + 0.0


def is_close(a: Place, b: Place) -> bool:
    """Whether a vertex may stay where it is."""
    return abs(a[0] - b[0]) <= CLOSE and abs(a[1] - b[1]) <= CLOSE


def _edge(a: int, b: int) -> Ids:
    return (a, b) if a < b else (b, a)


def _sum(a: Place, b: Place) -> Place:
    return a[0] + b[0], a[1] + b[1]


def _mean(places: Iterable[Place]) -> Place:
    x, y = np.mean(list(places), axis=0).tolist()
    return x, y


def _listed(place: Place) -> list[float]:
    return [round(place[0], 7), round(place[1], 7)]


def _neighbour(mesh: PolyMesh, name: int, others: Ids) -> int:
    """The vertex among `others` that an edge joins with another one."""
    v = mesh.vertex_index(name)
    beside = {mesh.vertex_ids[w] for edge in mesh.edges.tolist() if v in edge for w in edge}
    (found,) = beside.intersection(others)
    return found
