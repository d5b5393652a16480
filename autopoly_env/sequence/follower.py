"""`Follower`: takes the steps of a construction again on another mesh, where ids and positions may differ.

Steps name vertices and faces of the mesh that they were recorded on, the old one. A follower knows which of the new
mesh's each of them is. Two rules are handed in, for what some step that was left out, or taken otherwise, has left
without a counterpart: which vertex stands for the missing end of an edge, and which face for an old one.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from autopoly_env.arrays import FloatArray
from autopoly_env.errors import MeshError, SequenceError
from autopoly_env.mesh import PolyMesh, mirrored
from autopoly_env.operators import Action, Choice, Operator, operator_named
from autopoly_env.operators.choices import Renaming
from autopoly_env.sequence.file import Step
from autopoly_env.sequence.ids import choice_indices, decoded

_ALIKE = 0.5  # share of the corners of two faces, of old and new, that they need to have in common to be one

PointMap = Callable[[FloatArray], FloatArray]  # where points (P, 2) of an old mesh go
Taken = tuple[Action, Choice | None, PolyMesh]


class Standing(NamedTuple):
    """How far a construction has been taken again: up to `mesh`, which `old` is the old mesh of."""

    names: dict[int, int]  # id of a vertex in the new construction by its id in the old one; none for those left out
    old: PolyMesh
    mesh: PolyMesh


EndChoice = Callable[[Standing, PolyMesh, int, int], int]  # (.., old mesh before a step, an end, its other) -> id
FaceChoice = Callable[[Standing, PolyMesh, int], int]  # (.., old mesh before a step, an old face) -> id in the new mesh


def end_on_boundary(standing: Standing, before: PolyMesh, end: int, other: int) -> int:
    """Past a missing vertex, the next along its boundary that is there: the edges beside it are one edge."""
    v, u = before.vertex_index(end), before.vertex_index(other)
    for loop in before.topology.boundary_loops:
        ring = list(loop)
        if v in ring and u in ring:
            i, n = ring.index(v), len(ring)
            for turn in (1, -1):
                if ring[(i - turn) % n] == u:
                    names = (before.vertex_ids[ring[(i + turn * k) % n]] for k in range(1, n))
                    return next((standing.names[name] for name in names if name in standing.names), end)
    raise _gone("vertex", end)


def face_most_alike(standing: Standing, _: PolyMesh, face: int) -> int:
    """Of a face of the old mesh that the last step led to, the new one with most of its vertices."""
    old, mesh = standing.old, standing.mesh
    if face in old.face_ids:
        cycle = old.faces[old.face_index(face)]
        corners = {standing.names.get(old.vertex_ids[v], -1) for v in cycle} - {-1}
        others = [{mesh.vertex_ids[v] for v in other} for other in mesh.faces]
        alike = [len(corners & other) / len(corners | other) for other in others]
        if max(alike) > _ALIKE:
            return mesh.face_ids[alike.index(max(alike))]
    raise _gone("face", face)


class Follower:
    """Where a construction stands that is taken again: the new mesh, and the old names of what is in it."""

    def __init__(
        self,
        old: PolyMesh,
        mesh: PolyMesh,
        *,
        is_mirrored: bool = False,
        end_rule: EndChoice = end_on_boundary,
        face_rule: FaceChoice = face_most_alike,
    ) -> None:
        """`mesh` has the vertices of `old` under the same ids; with `is_mirrored` its faces are wound the other way."""
        self.mesh = mesh
        self._is_mirrored = is_mirrored
        self._end_rule, self._face_rule = end_rule, face_rule
        present = set(mesh.vertex_ids)
        self._standing = Standing({name: name for name in old.vertex_ids if name in present}, old, mesh)

    @property
    def names(self) -> dict[int, int]:
        """Of every old vertex that is there, its id in the new construction."""
        return self._standing.names

    def take(self, step: Step, before: PolyMesh, after: PolyMesh, place: PointMap, *, is_moving: bool = True) -> Taken:
        """Take a step that once led from `before` to `after`; every vertex goes where `place` takes its old position.

        Vertices without an old position stay; all do, where it is not `is_moving`. Raises an AutoPolyError, and takes
        nothing, where the step is illegal.
        """
        operator = operator_named(step.operator)
        element = operator.element.index(self.mesh, self._element(step, before))
        choice = choice_indices(self.mesh, operator, element, self._choice(operator, step, place))
        made = operator.apply(self.mesh, element, choice)
        created, olds = _created(self.mesh, made), step.created["vertices"]
        if len(created) != len(olds):
            raise SequenceError(f"it makes {len(created)} vertices here, not {len(olds)}; drop this step")
        if self._is_mirrored:
            created = _mirror_images(*decoded(before, step), before, made, created)
        self.names.update(zip(olds, created, strict=True))
        self.mesh = self._placed(made, after, place) if is_moving else made
        self._standing = Standing(self.names, after, self.mesh)
        return Action(step.operator, element), choice, self.mesh

    def do(self, step: Step) -> Taken:
        """Take a step that names what is in the new mesh, and move what it moves. Raises an AutoPolyError."""
        operator, element, choice = decoded(self.mesh, step)
        self.mesh = moved_to(operator.apply(self.mesh, element, choice), {name: (x, y) for name, x, y in step.moved})
        return Action(step.operator, element), choice, self.mesh

    def settle(self, mesh: PolyMesh) -> None:
        """Go on from other positions of the same vertices."""
        self.mesh = mesh

    def _element(self, step: Step, before: PolyMesh) -> dict[str, int | list[int]]:
        named: dict[str, int | list[int]] = {}
        for key, value in step.element.items():
            match key, value:
                case "edge", [a, b]:
                    named[key] = [self._end(before, a, b), self._end(before, b, a)]
                case "vertex", int(name):
                    named[key] = self._vertex(name)
                case "face", int(name):
                    named[key] = self._face_rule(self._standing, before, name)
                case _:
                    named[key] = value
        return named

    def _end(self, before: PolyMesh, end: int, other: int) -> int:
        """The new name of an edge's end."""
        return self.names[end] if end in self.names else self._end_rule(self._standing, before, end, other)

    def _vertex(self, name: int) -> int:
        if name not in self.names:
            raise _gone("vertex", name)
        return self.names[name]

    def _choice(self, operator: Operator, step: Step, place: PointMap) -> dict[str, Any] | None:
        if step.choice is None or operator.choice is None:
            return step.choice
        return operator.choice.renamed(step.choice, Renaming(self._vertex, place, self._is_mirrored))

    def _placed(self, made: PolyMesh, after: PolyMesh, place: PointMap) -> PolyMesh:
        present, names = set(made.vertex_ids), self.names
        places = zip(after.vertex_ids, place(after.vertices).tolist(), strict=True)
        named = {names.get(name, -1): (x, y) for name, (x, y) in places}
        return moved_to(made, {name: position for name, position in named.items() if name in present})


def _created(before: PolyMesh, made: PolyMesh) -> list[int]:
    """The ids of the vertices that an operator has made."""
    return [name for name in made.vertex_ids if name >= before.next_vertex_id]


def _mirror_images(
    operator: Operator, element: int, choice: Choice | None, before: PolyMesh, made: PolyMesh, created: list[int]
) -> list[int]:
    """Of the vertices that the operator makes of the old mesh `before`, those of `made` that are their mirror images.

    The operator puts them where the others' mirror images lie; which order it makes them in is its own affair.
    """
    old = operator.apply(before, element, choice)
    left, images = created[::-1], []
    for name in _created(before, old):
        x, y = old.vertices[old.vertex_index(name)].tolist()
        ways = made.vertices[[made.vertex_index(other) for other in left]] - (1.0 - x, y)
        images.append(left.pop(int(np.argmin((ways**2).sum(axis=1)))))
    return images


def _gone(kind: str, name: int) -> SequenceError:
    return SequenceError(f"{kind} {name} is not there any more; drop this step, too")


def moved_to(mesh: PolyMesh, positions: dict[int, tuple[float, float]]) -> PolyMesh:
    """The mesh with some vertices elsewhere, by their ids. Raises MeshError for an unknown id, and for NaN."""
    vertices = mesh.vertices.copy()
    for name, place in positions.items():
        if not np.isfinite(place).all():
            raise MeshError(f"vertex {name} is moved to {place}; give finite numbers")
        vertices[mesh.vertex_index(name)] = place
    return mesh.with_vertices(vertices)


def mirror_image(mesh: PolyMesh) -> PolyMesh:
    """The mesh mirrored at x = 1/2, its faces wound the other way so that their areas stay positive."""
    topology = type(mesh.topology)(mesh.topology.n_vertices, tuple(face[::-1] for face in mesh.faces))
    return replace(mesh, vertices=mirrored(mesh.vertices, 0.5), topology=topology)
