"""The kinds of elements that operators work on: how many a mesh has, and how a sequence names them.

An element is a whole number in one mesh. Those of the mesh itself are its vertices, edges, faces and corners (=
half-edges); others come `n_each` to one of these, such as holes of 3 and of 4 corners to each face.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

from autopoly_env.errors import SequenceError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators.hole_kernels import HOLE_SIDES
from autopoly_env.shown import short

ElementIds = dict[str, int | list[int]]  # {"edge": [3, 7]}, {"face": 0, "vertex": 2}, ...: what JSON knows


@dataclass(frozen=True)
class ElementKind:
    """One kind of element."""

    name: str
    base: str  # vertex, edge, face or corner: what each element lies at
    per_vertex: int  # how many there is room for in an action space, by each vertex that there is room for
    ids: Callable[[PolyMesh, int], ElementIds]  # the element with this index, as a sequence names it
    index: Callable[[PolyMesh, ElementIds], int]  # of the element with these ids; raises SequenceError or MeshError
    words: Callable[[ElementIds], str]  # the element in a sentence, with ids
    variants: tuple[str, ...] = ("",)  # what tells the elements at one place apart: element % n_each is which

    @cached_property
    def n_each(self) -> int:
        """How many elements lie at one place."""
        return len(self.variants)

    def count(self, mesh: PolyMesh) -> int:
        """How many there are in a mesh."""
        return self.n_each * _COUNTS[self.base](mesh)

    def place(self, element: int) -> int:
        """The vertex, edge, face or corner that an element lies at."""
        return element // self.n_each


_COUNTS: dict[str, Callable[[PolyMesh], int]] = {
    "vertex": lambda mesh: len(mesh.vertex_ids),
    "edge": lambda mesh: mesh.topology.n_edges,
    "face": lambda mesh: len(mesh.face_ids),
    "corner": lambda mesh: mesh.topology.n_corners,
}


def corner_position(mesh: PolyMesh, face: int, vertex_id: int) -> int:
    """The position of a vertex among the corners of a face. Raises SequenceError if it is none of them."""
    vertex = mesh.vertex_index(vertex_id)
    if vertex not in mesh.faces[face]:
        raise SequenceError(f"vertex {vertex_id} is no corner of face {mesh.face_ids[face]}; give one that is")
    return mesh.faces[face].index(vertex)


def no_such_element(kind: str, element: object) -> SequenceError:
    """The error for ids that name no element of a kind."""
    return SequenceError(f"element {short(element)} is not of kind {kind}; see docs/sequence-format.md")


def _edge_ids(mesh: PolyMesh, edge: int) -> ElementIds:
    return {"edge": [mesh.vertex_ids[v] for v in mesh.edges[edge]]}


def _edge_index(mesh: PolyMesh, ids: ElementIds) -> int:
    match ids:
        case {"edge": [a, b], **rest} if not rest:
            edge = mesh.topology.edge_at(mesh.vertex_index(a), mesh.vertex_index(b))
            if edge < 0:
                raise SequenceError(f"no edge joins vertices {a} and {b}; give the two ends of an edge")
            return edge
    raise no_such_element("edge", ids)


def _edge_words(ids: ElementIds) -> str:
    ends = ids["edge"]
    return f"edge {ends[0]}–{ends[1]}" if isinstance(ends, list) else f"edge {ends}"


def _face_ids(mesh: PolyMesh, face: int) -> ElementIds:
    return {"face": mesh.face_ids[face]}


def _face_index(mesh: PolyMesh, ids: ElementIds) -> int:
    match ids:
        case {"face": int(face), **rest} if not rest:
            return mesh.face_index(face)
    raise no_such_element("face", ids)


def _vertex_ids(mesh: PolyMesh, vertex: int) -> ElementIds:
    return {"vertex": mesh.vertex_ids[vertex]}


def _vertex_index(mesh: PolyMesh, ids: ElementIds) -> int:
    match ids:
        case {"vertex": int(vertex), **rest} if not rest:
            return mesh.vertex_index(vertex)
    raise no_such_element("vertex", ids)


def _corner_ids(mesh: PolyMesh, corner: int) -> ElementIds:
    face, i = mesh.topology.corner(corner)
    return {"face": mesh.face_ids[face], "vertex": mesh.vertex_ids[mesh.faces[face][i]]}


def _corner_index(mesh: PolyMesh, ids: ElementIds) -> int:
    match ids:
        case {"face": int(face), "vertex": int(vertex), **rest} if not rest:
            f = mesh.face_index(face)
            return mesh.topology.first_corner(f) + corner_position(mesh, f, vertex)
    raise no_such_element("corner", ids)


def _hole_ids(mesh: PolyMesh, hole: int) -> ElementIds:
    face, sides = divmod(hole, len(HOLE_SIDES))
    return {"face": mesh.face_ids[face], "sides": HOLE_SIDES[sides]}


def _hole_index(mesh: PolyMesh, ids: ElementIds) -> int:
    match ids:
        case {"face": int(face), "sides": int(sides), **rest} if sides in HOLE_SIDES and not rest:
            return len(HOLE_SIDES) * mesh.face_index(face) + HOLE_SIDES.index(sides)
    raise no_such_element("hole", ids)


def hole_face(hole: int) -> tuple[int, int]:
    """The face that a hole's index stands for, and the number of its sides."""
    face, which = divmod(hole, len(HOLE_SIDES))
    return face, HOLE_SIDES[which]


VERTEX = ElementKind("vertex", "vertex", 1, _vertex_ids, _vertex_index, lambda ids: f"vertex {ids['vertex']}")
EDGE = ElementKind("edge", "edge", 2, _edge_ids, _edge_index, _edge_words)
FACE = ElementKind("face", "face", 1, _face_ids, _face_index, lambda ids: f"face {ids['face']}")
CORNER = ElementKind(
    "corner", "corner", 4, _corner_ids, _corner_index, lambda ids: f"face {ids['face']} at vertex {ids['vertex']}"
)
HOLE = ElementKind(
    "hole",
    "face",
    len(HOLE_SIDES),
    _hole_ids,
    _hole_index,
    lambda ids: f"face {ids['face']}, {ids['sides']} sides",
    tuple(map(str, HOLE_SIDES)),
)
CAPACITY_PER_VERTEX = {kind.base: kind.per_vertex for kind in (VERTEX, EDGE, FACE, CORNER)}
