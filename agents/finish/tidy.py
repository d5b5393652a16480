"""Tell a construction without detours: actions that later ones undo are left out.

A vertex that is subdivided in and dissolved later, a face split off and joined again, an extrusion that is deleted: the
steps of such a detour are left out together where what remains is still a construction, of the same last mesh and by
sane meshes only. What they moved on the way moves with the step before or after.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from autopoly_env.errors import AutoPolyError
from autopoly_env.mesh import PolyMesh, is_sane
from autopoly_env.operators import Action, Choice, Operator, operator_named
from autopoly_env.operators.choices import Renaming
from autopoly_env.score import Score
from autopoly_env.sequence import ConstructionSequence, Step
from autopoly_env.sequence.ids import choice_indices
from autopoly_env.sequence.variation import stay

_MOST_LOST = 0.1  # of the IoU of a mesh on the way

Taken = tuple[Action, Choice | None, PolyMesh]  # an action, its choice and the mesh after it
Faces = set[tuple[int, ...]]


class _DetourNeededError(AutoPolyError):
    """What is left of a construction cannot be told without the steps that were left out."""


def tidy(sequence: ConstructionSequence, scored: Callable[[PolyMesh], Score]) -> ConstructionSequence:
    """The sequence without its detours; itself if it has none, and never one that ends otherwise.

    The last mesh is the same but for its ids: the same vertices, bit for bit, in the same faces. `scored` scores the
    meshes on the way that are new; the last keeps its score.
    """
    meshes, j = sequence.meshes(), 0
    while j < len(sequence.steps):
        for detour in _detours(sequence, meshes, j):
            shorter = _without(sequence, meshes, detour, scored)
            if shorter is not None:
                sequence, meshes, j = shorter, shorter.meshes(), j - len(detour)
                break
        j += 1
    return sequence


def _detours(sequence: ConstructionSequence, meshes: Sequence[PolyMesh], j: int) -> Iterator[frozenset[int]]:
    """Sets of steps, from 0, that may undo each other: step j, if it removes, and those that made what it removes."""
    step = sequence.steps[j]
    if not operator_named(step.operator).removes:
        return
    match step.element:
        case {"edge": [a, b]}:
            makers = [i for i in range(j) if _has_edge(meshes[i + 1], a, b) and not _has_edge(meshes[i], a, b)][-1:]
        case _:
            kinds = ("vertices", "faces") if "face" in step.element else ("vertices",)
            gone = {(kind, name) for kind in kinds for name in step.removed[kind]}
            made = [{(kind, name) for kind in kinds for name in s.created[kind]} for s in sequence.steps[:j]]
            makers = [i for i in range(j) if not gone.isdisjoint(made[i])]
    if makers:
        yield frozenset((*makers, j))
    if len(makers) > 1:
        yield from (frozenset((i, j)) for i in reversed(makers))


def _has_edge(mesh: PolyMesh, a: int, b: int) -> bool:
    ids = mesh.vertex_ids
    if a not in ids or b not in ids:
        return False
    i, j = sorted((mesh.vertex_index(a), mesh.vertex_index(b)))
    return (i, j) in mesh.topology.edge_lookup


def _without(
    sequence: ConstructionSequence,
    meshes: Sequence[PolyMesh],
    detour: frozenset[int],
    scored: Callable[[PolyMesh], Score],
) -> ConstructionSequence | None:
    """The sequence without the steps of a detour; None if they are needed."""
    steps = sequence.steps
    kept = [k for k in range(len(steps)) if k not in detour]
    first = min(min(detour), max(kept, default=0))  # so that some step is told again, unless none is left
    kept = [k for k in kept if k >= first]
    ends = [*(k + 1 for k in kept[:-1]), len(steps)]  # the last takes over what moved after it
    retold = _Retold(meshes[first], {name: name for name in meshes[first].vertex_ids})
    try:
        taken = [retold.take(steps[k], meshes[k], meshes[end]) for k, end in zip(kept, ends, strict=False)]
    except AutoPolyError:
        return None
    if not retold.is_same(meshes[-1]):
        return None
    if not taken:  # nothing was done in the end
        return sequence.trim(0)
    scores = [*(scored(mesh).as_dict() for _, _, mesh in taken[:-1]), steps[-1].score]
    if any(new["iou"] < steps[k].score["iou"] - _MOST_LOST for k, new in zip(kept, scores, strict=True)):
        return None
    transitions = [(action, choice, mesh, score) for (action, choice, mesh), score in zip(taken, scores, strict=True)]
    later = ConstructionSequence.record(sequence.settings, meshes[first], sequence.start_score, transitions)
    return replace(sequence, steps=(*steps[:first], *later.steps))


@dataclass
class _Retold:
    """A construction that is told again with steps left out."""

    mesh: PolyMesh
    names: dict[int, int]  # id of a vertex in this construction by its id in the old one; none for those left out

    def take(self, step: Step, before: PolyMesh, after: PolyMesh) -> Taken:
        """Take a step of the old construction, which leads from `before` to `after` there.

        Raises AutoPolyError where that cannot be done, or leaves a mesh that is not sane.
        """
        operator = operator_named(step.operator)
        element = operator.element.index(self.mesh, self._element(step, before))
        choice = choice_indices(self.mesh, operator, element, self._choice(operator, step))
        made = operator.apply(self.mesh, element, choice)
        created = [name for name in made.vertex_ids if name >= self.mesh.next_vertex_id]
        self.names |= dict(zip(step.created["vertices"], created, strict=True))
        vertices = made.vertices.copy()
        left = set(made.vertex_ids)
        for old, new in self.names.items():
            if new in left and old in after.vertex_ids:
                vertices[made.vertex_index(new)] = after.vertices[after.vertex_index(old)]
        self.mesh = made.with_vertices(vertices)
        if not is_sane(self.mesh):
            raise _DetourNeededError("a mesh on the way is not sane without it")
        return Action(step.operator, element), choice, self.mesh

    def is_same(self, last: PolyMesh) -> bool:
        """Whether the mesh is `last`, whatever the ids."""
        old = {new: old for old, new in self.names.items()}
        if tuple(old.get(name) for name in self.mesh.vertex_ids) != last.vertex_ids:
            return False
        same_places = self.mesh.vertices.tobytes() == last.vertices.tobytes()
        return same_places and _cycles(self.mesh.faces) == _cycles(last.faces)

    def _element(self, step: Step, before: PolyMesh) -> dict[str, int | list[int]]:
        """The element of a step by ids of this construction."""
        element = dict(step.element)
        match element:
            case {"edge": [a, b]}:
                element["edge"] = [self._end(before, a, b), self._end(before, b, a)]
            case {"face": int(face)}:
                element["face"] = self._face(before, face)
        if "vertex" in element:
            element["vertex"] = self._name(element["vertex"])
        return element

    def _choice(self, operator: Operator, step: Step) -> dict[str, Any] | None:
        if step.choice is None or operator.choice is None:
            return step.choice
        return operator.choice.renamed(step.choice, Renaming(self._name, stay))

    def _name(self, old: object) -> int:
        if not isinstance(old, int) or old not in self.names:
            raise _DetourNeededError(f"vertex {old} is not there without it")
        return self.names[old]

    def _end(self, before: PolyMesh, end: int, other: int) -> int:
        """An end of an edge; where it was left out, the next vertex beyond it."""
        first = end
        while end not in self.names:
            v = before.vertex_index(end)
            ends = [before.vertex_ids[a + b - v] for a, b in before.edges.tolist() if v in (a, b)]
            beyond = [name for name in ends if name != other]
            if len(beyond) != 1 or len(ends) != 2:
                raise _DetourNeededError(f"vertex {end} is no point on an edge")
            end, other = beyond[0], end
            if end == first:
                raise _DetourNeededError(f"vertex {end} is on a ring that was left out")
        return self.names[end]

    def _face(self, before: PolyMesh, face: int) -> int:
        """The smallest face with all the vertices, those left out aside."""
        old = (before.vertex_ids[v] for v in before.faces[before.face_index(face)])
        wanted = {self.mesh.vertex_index(self.names[name]) for name in old if name in self.names}
        found = [(len(cycle), k) for k, cycle in enumerate(self.mesh.faces) if wanted.issubset(cycle)]
        if not found:
            raise _DetourNeededError(f"face {face} is not there without it")
        return self.mesh.face_ids[min(found)[1]]


def _cycles(faces: Sequence[Sequence[int]]) -> Faces:
    """The faces, each begun at its least vertex."""
    starts = [list(face).index(min(face)) for face in faces]
    return {(*face[k:], *face[:k]) for k, face in zip(starts, map(tuple, faces), strict=True)}
