"""The parts of a construction: its main body, and the branches that grow out of it; which part each step works on.

A step of a sequence may name its part (`Step.part`). Where it does not, the part follows from what the step does:

- the body is what the start mesh consists of, and what is made by steps that work on it without growing out of it;
- a step that puts a face beside what is there, on nothing but elements of the body, begins a new part;
- any other step belongs to the part that made what it works on. Where that is several, it is the part of the step
  before, if that is one of them, or else the one that was begun last: the body never.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from autopoly_env.arrays import FloatArray
from autopoly_env.mesh import PolyMesh
from autopoly_env.sequence.file import Step
from autopoly_env.sequence.sequence import ConstructionSequence

BODY = "body"
_COLUMNS, _ROWS = ("left", "", "right"), ("upper", "", "lower")  # thirds of the shape's box

Element = tuple[str, int] | tuple[str, int, int]  # ("vertex", id), ("face", id), ("edge", id, id)


@dataclass(frozen=True)
class Parts:
    """The parts of a sequence by number, 0 for the body, the others in the order in which they are begun."""

    names: tuple[str, ...]  # "body", then labels of the sequence, or order and place: "lower left, 2 of 3"
    of_steps: tuple[int, ...]  # the part that each step works on

    @property
    def n_returns(self) -> int:
        """How many steps go back to a part that was left: another came in between. The body is there from the start."""
        seen, here, n = {0}, 0, 0
        for part in self.of_steps:
            n += part != here and part in seen
            seen.add(part)
            here = part
        return n

    def name(self, step: int) -> str:
        """The name of the part that step number `step`, from 1, works on."""
        return self.names[self.of_steps[step - 1]]


def parts_of(sequence: ConstructionSequence) -> Parts:
    """The parts of a sequence. Raises SequenceError if it cannot be replayed."""
    meshes, owners = sequence.meshes(), _Owners(sequence.start)
    for step, before, after in zip(sequence.steps, meshes, meshes[1:], strict=False):
        owners.take(step, before, after)
    return Parts(_names(sequence, owners), tuple(owners.of_steps))


class _Owners:
    """Which part has made each element, as far as a construction has been followed."""

    def __init__(self, start: PolyMesh) -> None:
        self.labels: list[str | None] = [BODY]  # of the parts; None where the sequence says nothing
        self.of_steps: list[int] = []
        self._owner: dict[Element, int] = dict.fromkeys(_elements(start), 0)

    def take(self, step: Step, before: PolyMesh, after: PolyMesh) -> None:
        """Follow the construction by one step."""
        old, new = _elements(before), _elements(after)
        part = self._found(step, before, after, old, new) if step.part is None else self._labelled(step.part)
        self.of_steps.append(part)
        for element in new - old:
            self._owner[element] = part

    def _labelled(self, label: str) -> int:
        if label not in self.labels:
            self.labels.append(label)
        return self.labels.index(label)

    def _found(self, step: Step, before: PolyMesh, after: PolyMesh, old: set[Element], new: set[Element]) -> int:
        """The part of a step that has no label; perhaps a new one."""
        rings, kept = _rings(after), _rings(before)
        grows = bool(step.created["faces"]) and all(rings.get(face) == ring for face, ring in kept.items())
        if grows:
            sides = {side for face in step.created["faces"] for side in _sides(rings[face])}
            touched = sides & old
        else:
            touched = _worked_on(step) & old | old - new
        here = self.of_steps[-1] if self.of_steps else 0
        parts = {self._owner[element] for element in touched}
        branches = parts - {0}
        if branches:
            return here if here in branches else max(branches)
        if grows:
            self.labels.append(None)
            return len(self.labels) - 1
        return 0 if parts else here  # nothing is known of what an operator from outside works on


def _worked_on(step: Step) -> set[Element]:
    """The element of a step, of a corner its face."""
    match step.element:
        case {"edge": [int(a), int(b)]}:
            return {_edge(a, b)}
        case {"face": int(face)}:
            return {("face", face)}
        case {"vertex": int(vertex)}:
            return {("vertex", vertex)}
    return set()


def _elements(mesh: PolyMesh) -> set[Element]:
    ids = mesh.vertex_ids
    edges = {_edge(ids[a], ids[b]) for a, b in mesh.edges.tolist()}
    return {*(("vertex", name) for name in ids), *edges, *(("face", name) for name in mesh.face_ids)}


def _rings(mesh: PolyMesh) -> dict[int, tuple[int, ...]]:
    """The ids of the corners of each face by its own."""
    ids = mesh.vertex_ids
    return {name: tuple(ids[v] for v in face) for name, face in zip(mesh.face_ids, mesh.faces, strict=True)}


def _sides(ring: tuple[int, ...]) -> Iterable[Element]:
    return map(_edge, ring, (*ring[1:], ring[0]))


def _edge(a: int, b: int) -> Element:
    return ("edge", min(a, b), max(a, b))


# --- names ---


def _names(sequence: ConstructionSequence, owners: _Owners) -> tuple[str, ...]:
    n_branches = len(owners.labels) - 1
    names = []
    for part, label in enumerate(owners.labels):
        counted = f", {part} of {n_branches}" if n_branches > 1 else ""
        names.append(label or _place(sequence, owners.of_steps, part) + counted)
    return tuple(names)


def _place(sequence: ConstructionSequence, of_steps: list[int], part: int) -> str:
    """Where in the shape a part lies: `lower left`, `upper`, `middle`."""
    meshes = sequence.meshes()
    found = [_made(step, meshes[k + 1]) for k, step in enumerate(sequence.steps) if of_steps[k] == part]
    column, row = _third(np.vstack(found), meshes[-1].vertices)
    return f"{_ROWS[row]} {_COLUMNS[column]}".strip() or "middle"


def _made(step: Step, mesh: PolyMesh) -> FloatArray:
    """(n, 2) where the new vertices of a step are, or else the corners of its new faces."""
    made = [mesh.vertex_index(name) for name in step.created["vertices"]]
    if not made:
        made = [v for name in step.created["faces"] for v in mesh.faces[mesh.face_index(name)]]
    return mesh.vertices[made]


def _third(points: FloatArray, whole: FloatArray) -> tuple[int, int]:
    """The column and the row, 0 to 2, of the middle of some points in the box of all."""
    low, size = whole.min(axis=0), np.maximum(np.ptp(whole, axis=0), 1e-12)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    column, row = np.clip(3.0 * (middle - low) / size, 0, 2).astype(int).tolist()
    return column, row
