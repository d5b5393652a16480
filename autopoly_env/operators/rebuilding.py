"""What operators are made of: meshes grown and shrunk, corners looked up, refusals that say why."""

from collections.abc import Iterable, Sequence
from itertools import repeat
from typing import TypeVar

import numpy as np

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.errors import IllegalActionError
from autopoly_env.mesh import Face, PolyMesh, Topology
from autopoly_env.operators import edit_kernels

_Item = TypeVar("_Item")


def refusal(operator: str, kind: str, element: int, reason: str) -> IllegalActionError:
    """The error that says why an operator cannot work on an element."""
    return IllegalActionError(f"{operator} cannot work on {kind} {element}: {reason}")


def grown(
    mesh: PolyMesh,
    points: Sequence[Sequence[float]] | FloatArray,
    faces: Sequence[Face] | IntArray,
    n_new_faces: int = 0,
) -> PolyMesh:
    """The mesh with `points` appended and `faces` for its faces, of which the last `n_new_faces` are new.

    In the place of faces a packed topology will do, as kernels make it.
    """
    n, new_id, new_face = len(mesh.vertex_ids) + len(points), mesh.next_vertex_id, mesh.next_face_id
    return PolyMesh(
        np.concatenate((mesh.vertices, points)) if len(points) else mesh.vertices,
        Topology.of_packed(n, faces) if isinstance(faces, np.ndarray) else Topology(n, tuple(faces)),
        (*mesh.vertex_ids, *range(new_id, new_id + len(points))),
        (*mesh.face_ids, *range(new_face, new_face + n_new_faces)),
        new_id + len(points),
        new_face + n_new_faces,
    )


def edited(mesh: PolyMesh, edit: int, element: int, *ends: int) -> tuple[IntArray, IntArray]:
    """`edit_kernels.edited` of a mesh."""
    found: tuple[IntArray, IntArray] = edit_kernels.edited(
        mesh.topology.packed, len(mesh.vertex_ids), edit, element, np.array(ends, np.int64)
    )
    return found


def shrunk(mesh: PolyMesh, faces: Sequence[Face], face_ids: tuple[int, ...]) -> PolyMesh:
    """The mesh with only `faces`; vertices that no face uses any more go."""
    kept = sorted(set().union(*faces))
    index = dict(zip(kept, range(len(kept)), strict=True))
    renumbered = tuple(map(tuple, map(map, repeat(index.__getitem__), faces)))
    return _left(mesh, Topology(len(kept), renumbered), kept, face_ids)


def shrunk_to(mesh: PolyMesh, packed: IntArray, kept: IntArray, face_ids: tuple[int, ...]) -> PolyMesh:
    """`shrunk` to a packed topology of the vertices `kept`, ascending, as `edit_kernels` make it."""
    return _left(mesh, Topology.of_packed(len(kept), packed), kept.tolist(), face_ids)


def _left(mesh: PolyMesh, topology: Topology, kept: list[int], face_ids: tuple[int, ...]) -> PolyMesh:
    is_whole = len(kept) == len(mesh.vertex_ids)
    return PolyMesh(
        mesh.vertices if is_whole else mesh.vertices[kept],
        topology,
        mesh.vertex_ids if is_whole else tuple(map(mesh.vertex_ids.__getitem__, kept)),
        face_ids,
        mesh.next_vertex_id,
        mesh.next_face_id,
    )


def corner_of(mesh: PolyMesh, corner: int) -> tuple[int, int]:
    """The face of a corner (= half-edge) and the corner's position in it."""
    return mesh.topology.corner(corner)


def without(items: tuple[_Item, ...], i: int) -> tuple[_Item, ...]:
    """The items but for number i."""
    return (*items[:i], *items[i + 1 :])


def ends_along_face(mesh: PolyMesh, edge: int) -> tuple[int, int]:
    """The ends of an edge, by index, as its (lower) face runs."""
    return mesh.topology.ends(mesh.topology.sides(edge)[0])


def rim_defect(mesh: PolyMesh, sides: Iterable[tuple[int, int]]) -> str:
    """Why the boundary half-edges among `sides` cannot all get faces that hang together; empty if they can.

    Of each part of the mesh they have to lie on one boundary loop: to join two makes a handle, which no mesh in the
    plane has, and V - E + F would not be components - holes any more. Where all sides are on the boundary, some of it
    has to be left.
    """
    topology, asked = mesh.topology, set(sides)
    rows = dict(zip(map(tuple, topology.boundary_half_edges.tolist()), topology.boundary_labels.tolist(), strict=True))
    loops = [tuple(rows[pair]) for pair in asked if pair in rows]
    parts = {part for _, part in loops}
    if len(set(loops)) > len(parts):
        return "it would join two boundaries of one part, as a handle does"
    if len(loops) == len(asked) == sum(part in parts for _, part in rows.values()):
        return "no boundary would be left"
    return ""


def corners_from_last(mesh: PolyMesh, face: int, *vertex_ids: int) -> list[int]:
    """Vertex ids of a face in the order of its corners, the last one first.

    With y up faces run the other way round, so this is their order in Blender.
    """
    corners = [mesh.vertex_ids[v] for v in mesh.faces[face]]
    return sorted(vertex_ids, key=corners.index, reverse=True)
