"""The registry of topological operators: their names, elements, effects on (V, E, F), and presets.

An operator works on one element: the index of an edge, face, corner (= half-edge), vertex or hole (2 * face +
sides - 3) of the current mesh. New vertices and faces come last, with new ids; the others keep their order
and ids. Names and effects are those of Blender's operators (`subdivide_edges`, `extrude_edge_only`,
`face_split`, `delete`, `dissolve_*`).
"""

from collections.abc import Callable
from dataclasses import dataclass

from autopoly_env.arrays import BoolArray
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import edits
from autopoly_env.operators.edits import Choice
from autopoly_env.operators.holes import HoleChoice, plan_hole

__all__ = ["OPERATORS", "PRESETS", "Choice", "HoleChoice", "Operator", "n_elements", "plan_hole", "preset"]


def _nothing_to_choose(_mesh: PolyMesh, _element: int) -> None:
    return None


@dataclass(frozen=True)
class Operator:
    """One topological operator."""

    name: str
    element: str  # edge, face, corner, vertex or hole
    effect: str  # in words
    changes: tuple[tuple[int, int, int], ...]  # of (V, E, F), at most; element e has changes[e % len(changes)]
    legal_mask: Callable[[PolyMesh], BoolArray]  # (n_elements,) where `apply` works
    edit: Callable[[PolyMesh, int, Choice | None], PolyMesh]  # what `apply` calls
    choose: Callable[[PolyMesh, int], Choice | None] = _nothing_to_choose  # what `apply` chooses by default

    def apply(self, mesh: PolyMesh, element: int, choice: Choice | None = None) -> PolyMesh:
        """The mesh after the operator has worked on `element`, with `choice` or what `choose` gives.

        `face_split` has the corner to split to as its choice, `face_hole` a `HoleChoice`, the others none.
        Raises IllegalActionError if the element or the choice does not allow it.
        """
        n = n_elements(mesh, self.element)
        if not 0 <= element < n:
            raise edits.refusal(self.name, self.element, element, f"the mesh has {n}; give 0..{n - 1}")
        return self.edit(mesh, int(element), self.choose(mesh, int(element)) if choice is None else choice)


def n_elements(mesh: PolyMesh, kind: str) -> int:
    """How many elements of a kind (edge, face, corner, vertex, hole) the mesh has."""
    match kind:
        case "edge":
            return mesh.topology.n_edges
        case "face":
            return len(mesh.face_ids)
        case "corner":
            return len(mesh.topology.links.tails)
        case "vertex":
            return len(mesh.vertex_ids)
        case "hole":
            return len(edits.HOLE_SIDES) * len(mesh.face_ids)
    raise ConfigError(f"element kind {kind!r} is unknown; give edge, face, corner, vertex or hole")


edge_subdivide = Operator(
    "edge_subdivide",
    "edge",
    "a new vertex at the middle of an edge",
    ((1, 1, 0),),
    edits.any_edge,
    edits.subdivide_edge,
)
edge_extrude = Operator(
    "edge_extrude",
    "edge",
    "a new quad on a boundary edge",
    ((2, 3, 1),),
    edits.boundary_edges,
    edits.extrude_edge,
)
face_split = Operator(
    "face_split",
    "corner",
    "a face cut in two along an inner diagonal from a corner",
    ((0, 1, 1),),
    edits.corners_with_diagonal,
    edits.split_face,
    edits.most_even_diagonal,
)
face_delete = Operator(
    "face_delete",
    "face",
    "a face removed, with the edges and vertices that have no other",
    ((0, 0, -1),),
    edits.any_face_but_the_last,
    edits.delete_face,
)
face_hole = Operator(
    "face_hole",
    "hole",
    "a hole of 3 or 4 corners cut into a face with two bridges",
    ((3, 5, 1), (4, 6, 1)),
    edits.faces_with_room,
    edits.cut_hole,
    edits.regular_hole,
)
vertex_dissolve = Operator(
    "vertex_dissolve",
    "vertex",
    "a boundary vertex of valence 2 removed, its two edges made one",
    ((-1, -1, 0),),
    edits.dissolvable_vertices,
    edits.dissolve_vertex,
)
edge_dissolve = Operator(
    "edge_dissolve",
    "edge",
    "the edge between two faces removed, the faces made one",
    ((0, -1, -1),),
    edits.dissolvable_edges,
    edits.dissolve_edge,
)

_PAPER = (edge_subdivide, edge_extrude, face_split, face_delete)
_FULL = (*_PAPER, face_hole, vertex_dissolve, edge_dissolve)
OPERATORS: dict[str, Operator] = {operator.name: operator for operator in _FULL}
PRESETS: dict[str, tuple[Operator, ...]] = {"paper": _PAPER, "full": _FULL}


def preset(name: str) -> tuple[Operator, ...]:
    """The operators of a preset ("paper", "full") or of a comma list of operator names, in that order.

    Raises ConfigError for a name that is neither, or an operator named twice.
    """
    if name in PRESETS:
        return PRESETS[name]
    names = [part.strip() for part in name.split(",")]
    if not set(names) <= OPERATORS.keys() or len(set(names)) < len(names):
        raise ConfigError(
            f"operators {name!r} are unknown; give one of {', '.join(PRESETS)}, "
            f"or a comma list of {', '.join(OPERATORS)}"
        )
    return tuple(OPERATORS[part] for part in names)
