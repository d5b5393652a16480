"""Between a mesh, where elements have indices that change, and a construction sequence, where they have ids."""

from typing import Any

from autopoly_env.errors import SequenceError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import HOLE_SIDES, OPERATORS, Choice, HoleChoice, Operator
from autopoly_env.sequence.file import Step, parse_hole, parse_id


def element_ids(mesh: PolyMesh, kind: str, element: int) -> dict[str, int | list[int]]:
    """The element as a step names it."""
    links = mesh.topology.links
    match kind:
        case "edge":
            return {"edge": [mesh.vertex_ids[v] for v in mesh.edges[element]]}
        case "face":
            return {"face": mesh.face_ids[element]}
        case "vertex":
            return {"vertex": mesh.vertex_ids[element]}
        case "hole":
            face, sides = divmod(element, len(HOLE_SIDES))
            return {"face": mesh.face_ids[face], "sides": HOLE_SIDES[sides]}
    return {"face": mesh.face_ids[links.faces[element]], "vertex": mesh.vertex_ids[links.tails[element]]}


def element_index(mesh: PolyMesh, kind: str, element: dict[str, int | list[int]]) -> int:
    """The index of the element that the ids name. Raises SequenceError or MeshError if there is none."""
    match kind, element:
        case "edge", {"edge": [a, b], **rest} if not rest:
            i, j = sorted((mesh.vertex_index(a), mesh.vertex_index(b)))
            if (i, j) not in mesh.topology.edge_lookup:
                raise SequenceError(f"no edge joins vertices {a} and {b}; give the two ends of an edge")
            return mesh.edge_index(i, j)
        case "face", {"face": int(face), **rest} if not rest:
            return mesh.face_index(face)
        case "vertex", {"vertex": int(vertex), **rest} if not rest:
            return mesh.vertex_index(vertex)
        case "hole", {"face": int(face), "sides": int(sides), **rest} if sides in HOLE_SIDES and not rest:
            return len(HOLE_SIDES) * mesh.face_index(face) + HOLE_SIDES.index(sides)
        case "corner", {"face": int(face), "vertex": int(vertex), **rest} if not rest:
            f = mesh.face_index(face)
            return mesh.topology.links.offsets[f] + _position(mesh, f, vertex)
    raise SequenceError(f"element {element} is not of kind {kind}; see docs/sequence-format.md")


def _position(mesh: PolyMesh, face: int, vertex_id: int) -> int:
    """The position of a vertex among the corners of a face."""
    vertex = mesh.vertex_index(vertex_id)
    if vertex not in mesh.faces[face]:
        raise SequenceError(f"vertex {vertex_id} is no corner of face {mesh.face_ids[face]}; give one that is")
    return mesh.faces[face].index(vertex)


def choice_ids(mesh: PolyMesh, element: int, choice: Choice | None) -> dict[str, Any] | None:
    """The choice as a step names it."""
    if choice is None:
        return None
    if not isinstance(choice, HoleChoice):
        return {"to": mesh.vertex_ids[mesh.topology.links.tails[choice]]}
    face = mesh.faces[element // len(HOLE_SIDES)]
    return {
        "points": [[float(x), float(y)] for x, y in choice.points],
        "bridges": [[mesh.vertex_ids[face[i]], int(corner)] for i, corner in choice.bridges],
    }


def choice_indices(mesh: PolyMesh, operator: Operator, element: int, choice: dict[str, Any] | None) -> Choice | None:
    """The choice that the ids name. Raises SequenceError if the operator has no such choice."""
    if operator.name == "face_split" and choice is not None and choice.keys() == {"to"}:
        face = mesh.topology.links.faces[element]
        return mesh.topology.links.offsets[face] + _position(mesh, face, parse_id(choice["to"], "choice.to"))
    if operator.name == "face_hole" and choice is not None:
        hole = parse_hole(choice)
        (a, i), (b, j) = hole.bridges
        face = element // len(HOLE_SIDES)
        return HoleChoice(hole.points, ((_position(mesh, face, a), i), (_position(mesh, face, b), j)))
    if choice is None and operator.name not in ("face_split", "face_hole"):
        return None
    raise SequenceError(f"choice {choice} is not one of {operator.name}; see docs/sequence-format.md")


def decoded(mesh: PolyMesh, step: Step) -> tuple[Operator, int, Choice | None]:
    """The operator of a step from `mesh`, and the indices there of its element and its choice.

    Raises SequenceError or MeshError for what there is not.
    """
    operator = operator_named(step.operator)
    element = element_index(mesh, operator.element, step.element)
    return operator, element, choice_indices(mesh, operator, element, step.choice)


def operator_named(name: str) -> Operator:
    """The operator of that name. Raises SequenceError if there is none."""
    if name not in OPERATORS:
        raise SequenceError(f"operator {name!r} is unknown; give one of {', '.join(OPERATORS)}")
    return OPERATORS[name]


def element_words(step: Step) -> str:
    """The element of a step for a message: `edge 3–7`, `face 0, vertex 2`."""
    words = {
        key: "–".join(map(str, value)) if isinstance(value, list) else value for key, value in step.element.items()
    }
    return ", ".join(f"{key} {value}" for key, value in words.items())
