"""What a hand changes of a mesh, as the construction tells it: the sequence that comes of it replays as any other.

A vertex that is pulled is a move of the last step (of the start, where there is none); all else is a step of its own.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from autopoly_env.errors import AutoPolyError, ConfigError
from autopoly_env.mesh import PolyMesh, broken_faces, defects_of, images_of
from autopoly_env.operators import Action
from autopoly_env.score import Score
from autopoly_env.sequence import ConstructionSequence, Step
from autopoly_env.sequence.file import Id
from autopoly_env.sequence.ids import decoded

Scored = Callable[[PolyMesh], Score]
Places = Mapping[int, tuple[float, float]]  # by vertex id, in the unit square


def pulled(sequence: ConstructionSequence, places: Places, scored: Scored) -> ConstructionSequence:
    """The construction with vertices of its last mesh elsewhere. Raises ConfigError where they cannot lie there."""
    mesh = sequence.final()
    points = mesh.vertices.copy()
    for name, place in places.items():
        points[mesh.vertex_index(name)] = place
    if not (np.isfinite(points).all() and (points >= 0.0).all() and (points <= 1.0).all()):
        raise ConfigError("the vertex would leave the picture: pull it less far")
    moved = _sound(mesh.with_vertices(points))
    sequence = _ruled(sequence, moved)
    if not sequence.steps:
        return replace(sequence, start=moved, start_score=scored(moved).as_dict())
    *before, last = sequence.steps
    there = {name: (x, y) for name, x, y in last.moved} | dict(places)
    told = replace(last, moved=tuple((name, *there[name]) for name in there), score=scored(moved).as_dict())
    return replace(sequence, steps=(*before, told))


@dataclass(frozen=True)
class Pull:
    """A vertex, by its id, that is to lie elsewhere."""

    vertex: int
    to: tuple[float, float]  # in the unit square


@dataclass(frozen=True)
class Asked:
    """A step that is asked for: elements and what is left to choose by ids, as a sequence names them."""

    operator: Literal["face_delete", "face_split", "edge_subdivide", "edge_extrude", "vertex_dissolve", "edge_dissolve"]
    element: dict[str, Id | list[Id]]
    choice: dict[str, Id] | None = None


def done(sequence: ConstructionSequence, asked: Asked, scored: Scored) -> ConstructionSequence:
    """The construction with one step more. Raises AutoPolyError, in the operator's words, where it cannot be."""
    mesh, operator = sequence.final(), asked.operator
    found, index, chosen = decoded(mesh, Step(operator, asked.element, asked.choice, {}, {}, (), {}))
    made = _sound(found.apply(mesh, index, chosen))
    sequence = _ruled(sequence, made)
    step = ConstructionSequence.record(
        {}, mesh, scored(mesh).as_dict(), [(Action(operator, index), chosen, made, scored(made).as_dict())]
    )
    return replace(sequence, steps=(*sequence.steps, *step.steps))


def with_images(mesh: PolyMesh, places: Places, axis: float | None) -> dict[int, tuple[float, float]]:
    """The places, and those of the mirror images, where left and right are alike; what lies on the axis stays on it."""
    images = None if axis is None else images_of(mesh, axis)
    if images is None or axis is None:
        return dict(places)
    found: dict[int, tuple[float, float]] = {}
    for name, (x, y) in places.items():
        image = int(images[mesh.vertex_index(name)])
        other = mesh.vertex_ids[image] if image >= 0 else None
        found[name] = (axis, y) if other == name else (x, y)
        if other is not None and other != name:
            found[other] = (2.0 * axis - x, y)
    return found


def _sound(mesh: PolyMesh) -> PolyMesh:
    """The mesh. Raises ConfigError where edges cross or a face is flipped or empty."""
    crossings, flipped = defects_of(mesh)
    if crossings:
        raise ConfigError("edges would cross or touch there: choose another place")
    if flipped:
        raise ConfigError("a face would be flipped or empty there: choose another place")
    return mesh


def _ruled(sequence: ConstructionSequence, mesh: PolyMesh) -> ConstructionSequence:
    """The sequence; without its rule of faces where the mesh does not keep that."""
    try:
        is_kept = not broken_faces(mesh, sequence.faces)
    except AutoPolyError:
        is_kept = False
    return sequence if is_kept else sequence.under("any")
