"""What an action leaves free, between a mesh, where it counts by indices, and a sequence, where it names ids."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any

import numpy as np
from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from autopoly_env.arguments import first_defect
from autopoly_env.arrays import FloatArray
from autopoly_env.errors import SequenceError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators.action import Choice
from autopoly_env.operators.elements import EDGE, corner_position, hole_face
from autopoly_env.operators.holes import HoleChoice
from autopoly_env.shown import short

ChoiceIds = dict[str, Any]


@dataclass(frozen=True)
class Renaming:
    """How a construction is told again on another mesh: which vertex is which, and where points go."""

    vertex: Callable[[int], int]  # id there by id here; raises SequenceError for one that is not there
    place: Callable[[FloatArray], FloatArray]  # of points (P, 2)
    is_mirrored: bool = False  # faces run the other way there


@dataclass(frozen=True)
class ChoiceCodec:
    """How a choice is written down, read and told again."""

    ids: Callable[[PolyMesh, int, Choice], ChoiceIds]  # of (mesh, element, choice), as a step names it
    indices: Callable[[PolyMesh, int, ChoiceIds], Choice]  # back; raises SequenceError for what it is not
    renamed: Callable[[ChoiceIds, Renaming], ChoiceIds]  # on another mesh; raises SequenceError


_Id = Annotated[int, Field(strict=True, ge=0)]
_FARTHEST = 1e6  # unit square, as of vertices
_Place = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-_FARTHEST, le=_FARTHEST)]


@dataclass(frozen=True)
class _Hole:
    __pydantic_config__ = ConfigDict(extra="forbid")

    points: tuple[tuple[_Place, _Place], ...]
    bridges: tuple[tuple[_Id, _Id], tuple[_Id, _Id]]


@cache
def _reader() -> TypeAdapter[_Hole]:
    return TypeAdapter(_Hole)


def _corner_choice_ids(mesh: PolyMesh, _corner: int, choice: Choice) -> ChoiceIds:
    assert isinstance(choice, int | np.integer)
    face, i = mesh.topology.corner(int(choice))
    return {"to": mesh.vertex_ids[mesh.faces[face][i]]}


def _corner_choice(mesh: PolyMesh, corner: int, ids: ChoiceIds) -> Choice:
    if ids.keys() != {"to"}:
        raise SequenceError(f"choice {short(ids)}: expected the vertex to split to, {{'to': id}}")
    to = ids["to"]
    if isinstance(to, bool) or not isinstance(to, int) or to < 0:
        raise SequenceError(f"choice.to is {short(to)}; give an id, an integer from 0")
    face, _ = mesh.topology.corner(corner)
    return mesh.topology.first_corner(face) + corner_position(mesh, face, to)


def _vertex_choice_ids(mesh: PolyMesh, _vertex: int, choice: Choice) -> ChoiceIds:
    assert isinstance(choice, int | np.integer)
    return {"to": mesh.vertex_ids[int(choice)]}


def _vertex_choice(mesh: PolyMesh, _vertex: int, ids: ChoiceIds) -> Choice:
    match ids:
        case {"to": int(to), **rest} if not rest and not isinstance(to, bool):
            return mesh.vertex_index(to)
    raise SequenceError(f"choice {short(ids)}: expected the vertex to merge with, {{'to': id}}")


def _edge_choice_ids(mesh: PolyMesh, _edge: int, choice: Choice) -> ChoiceIds:
    assert isinstance(choice, int | np.integer)
    return {"to": [mesh.vertex_ids[v] for v in mesh.edges[int(choice)]]}


def _edge_choice(mesh: PolyMesh, _edge: int, ids: ChoiceIds) -> Choice:
    match ids:
        case {"to": [int(a), int(b)], **rest} if not rest and not isinstance(a, bool) and not isinstance(b, bool):
            return EDGE.index(mesh, {"edge": [a, b]})
    raise SequenceError(f"choice {short(ids)}: expected the ends of the edge to fill to, {{'to': [id, id]}}")


def _renamed_edge(ids: ChoiceIds, renaming: Renaming) -> ChoiceIds:
    return {"to": [renaming.vertex(name) for name in ids["to"]]}


def _slide_ids(mesh: PolyMesh, edge: int, choice: Choice) -> ChoiceIds:
    assert isinstance(choice, int | float | np.floating)
    return {"from": mesh.vertex_ids[mesh.edges[edge][0]], "slide": float(choice)}


def _slide(mesh: PolyMesh, edge: int, ids: ChoiceIds) -> Choice:
    match ids:
        case {"from": int(end), "slide": float(slide), **rest} if not rest and not isinstance(end, bool):
            ends = [mesh.vertex_ids[v] for v in mesh.edges[edge]]
            if end in ends:
                return slide if end == ends[0] else 1.0 - slide
    raise SequenceError(
        f"choice {short(ids)}: expected an end of the edge and how far from it, {{'from': id, 'slide': 0.5}}"
    )


def _hole_choice_ids(mesh: PolyMesh, hole: int, choice: Choice) -> ChoiceIds:
    assert isinstance(choice, HoleChoice)
    face = mesh.faces[hole_face(hole)[0]]
    return {
        "points": [[float(x), float(y)] for x, y in choice.points],
        "bridges": [[mesh.vertex_ids[face[i]], int(corner)] for i, corner in choice.bridges],
    }


def _hole_choice(mesh: PolyMesh, hole: int, ids: ChoiceIds) -> Choice:
    try:
        plan = _reader().validate_python(ids)
    except ValidationError as error:
        defect = first_defect(error)
        place = ".".join(("choice", *map(str, defect.place or ("all of it",))))
        raise SequenceError(f"{place}: {defect.problem}") from None
    (a, i), (b, j) = plan.bridges
    face, _ = hole_face(hole)
    return HoleChoice(plan.points, ((corner_position(mesh, face, a), i), (corner_position(mesh, face, b), j)))


def _renamed_hole(ids: ChoiceIds, renaming: Renaming) -> ChoiceIds:
    placed = renaming.place(np.array(ids["points"], np.float64)).tolist()
    bridges = [(renaming.vertex(name), int(corner)) for name, corner in ids["bridges"]]
    if renaming.is_mirrored:
        placed = placed[::-1]
        bridges = [(name, len(placed) - 1 - corner) for name, corner in bridges]
    return {"points": placed, "bridges": bridges}


TO_CORNER = ChoiceCodec(_corner_choice_ids, _corner_choice, lambda ids, r: {"to": r.vertex(ids["to"])})
TO_VERTEX = ChoiceCodec(_vertex_choice_ids, _vertex_choice, lambda ids, r: {"to": r.vertex(ids["to"])})
SLIDE = ChoiceCodec(_slide_ids, _slide, lambda ids, r: {"from": r.vertex(ids["from"]), "slide": ids["slide"]})
TO_EDGE = ChoiceCodec(_edge_choice_ids, _edge_choice, _renamed_edge)
OF_HOLE = ChoiceCodec(_hole_choice_ids, _hole_choice, _renamed_hole)
