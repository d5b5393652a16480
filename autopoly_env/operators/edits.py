"""What each operator does: the mask of where it may work, and the edit `(mesh, element, choice) -> mesh`.

Indices in, new mesh out; an element or choice that is not allowed raises IllegalActionError. Letters: V
vertices, E edges, F faces, H corners (= half-edges). `operators.py` gives these functions their names and
presets.
"""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray
from autopoly_env.errors import IllegalActionError
from autopoly_env.mesh import Face, PolyMesh, Topology
from autopoly_env.mesh.planar_kernels import clear_extrusion, split_imbalance, splittable_corners
from autopoly_env.operators.hole_kernels import roomy_faces
from autopoly_env.operators.holes import HoleChoice, default_hole, hole_defect

Choice = int | HoleChoice
HOLE_SIDES = (3, 4)
EXTRUDE_OFFSET = 0.25  # of the edge's length
EXTRUDE_INSET = 0.25
MAX_HALVINGS = 12
TINY_AREA = 1e-6  # unit square; 1/16 of a pixel at 256 x 256

_Item = TypeVar("_Item")


def refusal(operator: str, kind: str, element: int, reason: str) -> IllegalActionError:
    """The error that says why an operator cannot work on an element."""
    return IllegalActionError(f"{operator} cannot work on {kind} {element}: {reason}")


def _grown(
    mesh: PolyMesh,
    points: Sequence[Sequence[float]] | FloatArray,
    faces: Sequence[Face],
    n_new_faces: int = 0,
) -> PolyMesh:
    """The mesh with `points` appended and `faces` for its faces, of which the last `n_new_faces` are new."""
    n, new_id, new_face = len(mesh.vertex_ids) + len(points), mesh.next_vertex_id, mesh.next_face_id
    return PolyMesh(
        np.concatenate((mesh.vertices, points)) if len(points) else mesh.vertices,
        Topology(n, tuple(faces)),
        (*mesh.vertex_ids, *range(new_id, new_id + len(points))),
        (*mesh.face_ids, *range(new_face, new_face + n_new_faces)),
        new_id + len(points),
        new_face + n_new_faces,
    )


def _shrunk(mesh: PolyMesh, faces: Sequence[Face], face_ids: tuple[int, ...]) -> PolyMesh:
    """The mesh with only `faces`; vertices that no face uses any more go."""
    used = set().union(*faces)
    kept = [v for v in range(len(mesh.vertex_ids)) if v in used]
    if len(kept) == len(mesh.vertex_ids):
        vertices, renumbered = mesh.vertices, tuple(faces)
    else:
        index = {v: i for i, v in enumerate(kept)}
        vertices, renumbered = mesh.vertices[kept], tuple(tuple(index[v] for v in face) for face in faces)
    return PolyMesh(
        vertices,
        Topology(len(kept), renumbered),
        tuple(mesh.vertex_ids[v] for v in kept),
        face_ids,
        mesh.next_vertex_id,
        mesh.next_face_id,
    )


def _corner(mesh: PolyMesh, corner: int) -> tuple[int, int]:
    """The face of a corner and the corner's position in it."""
    links = mesh.topology.links
    face = links.faces[corner]
    return face, corner - links.offsets[face]


# --- edge_subdivide


def any_edge(mesh: PolyMesh) -> BoolArray:
    return np.ones(mesh.topology.n_edges, np.bool_)


def subdivide_edge(mesh: PolyMesh, edge: int, _choice: Choice | None) -> PolyMesh:
    """A new vertex at the midpoint of the edge; the faces beside it keep their other corners."""
    links, new = mesh.topology.links, len(mesh.vertex_ids)
    faces = list(mesh.faces)
    for h in mesh.topology.edge_half_edges[edge]:
        if h >= 0:
            f, i = _corner(mesh, h)
            faces[f] = (*faces[f][: i + 1], new, *faces[f][i + 1 :])
    h = mesh.topology.edge_half_edges[edge][0]
    middle = 0.5 * (mesh.vertices[links.tails[h]] + mesh.vertices[links.heads[h]])
    return _grown(mesh, middle[None], faces)


# --- edge_extrude ---


def boundary_edges(mesh: PolyMesh) -> BoolArray:
    return mesh.topology.is_boundary_edge


def extrude_edge(mesh: PolyMesh, edge: int, _choice: Choice | None) -> PolyMesh:
    """A new quad (b, a, a', b') outside boundary edge a-b. Its far side is parallel to a-b.

    It stands off by `EXTRUDE_OFFSET` of the edge's length, halved up to `MAX_HALVINGS` times while the quad meets
    another edge of the mesh, be it straight or narrowed by `EXTRUDE_INSET` of the edge's length at either end.
    """
    h, twin = mesh.topology.edge_half_edges[edge]
    if twin >= 0:
        raise refusal("edge_extrude", "edge", edge, "it lies between two faces; choose a boundary edge")
    a, b, new = mesh.topology.links.tails[h], mesh.topology.links.heads[h], len(mesh.vertex_ids)
    offset, inset = clear_extrusion(mesh.vertices, mesh.edges, a, b, EXTRUDE_OFFSET, EXTRUDE_INSET, MAX_HALVINGS)
    (ax, ay), (bx, by) = mesh.vertices[[a, b]].tolist()
    in_x, in_y = inset * (bx - ax), inset * (by - ay)
    out_x, out_y = offset * (by - ay), offset * (ax - bx)
    points = ((ax + in_x + out_x, ay + in_y + out_y), (bx - in_x + out_x, by - in_y + out_y))
    return _grown(mesh, points, (*mesh.faces, (b, a, new, new + 1)), 1)


# --- face_split ---


def corners_with_diagonal(mesh: PolyMesh) -> BoolArray:
    topology = mesh.topology
    mask: BoolArray = splittable_corners(mesh.vertices, topology.corners, topology.face_offsets, topology.edges)
    return mask


def _split_costs(mesh: PolyMesh, corner: int) -> FloatArray:
    face, i = _corner(mesh, corner)
    costs: FloatArray = split_imbalance(mesh.vertices, np.array(mesh.faces[face]), mesh.edges, i)
    return costs


def most_even_diagonal(mesh: PolyMesh, corner: int) -> int | None:
    """The corner of the same face with the most even split; of equals (to 1e-12) the first in the face."""
    costs = _split_costs(mesh, corner)
    least = costs.min()
    if least == np.inf:
        return None
    start = mesh.topology.links.offsets[_corner(mesh, corner)[0]]
    return start + int(np.flatnonzero(costs <= least + 1e-12)[0])


def split_face(mesh: PolyMesh, corner: int, choice: Choice | None) -> PolyMesh:
    """The face cut along the diagonal to corner `choice`.

    The part that keeps the face's last half-edge (from its last corner to its first) keeps its id and place.
    """
    if choice is None:
        raise refusal("face_split", "corner", corner, "no diagonal from it runs inside its face; choose another")
    if not isinstance(choice, int | np.integer):
        raise refusal("face_split", "corner", corner, f"{choice!r} is no corner; give the corner to split to")
    f, i = _corner(mesh, corner)
    face, j = mesh.faces[f], int(choice) - mesh.topology.links.offsets[f]
    if not 0 <= j < len(face) or _split_costs(mesh, corner)[j] == np.inf:
        raise refusal(
            "face_split",
            "corner",
            corner,
            f"the way to corner {choice} is no free diagonal of its face; choose another",
        )
    i, j = min(i, j), max(i, j)
    faces = list(mesh.faces)
    faces[f] = (*face[: i + 1], *face[j:])
    return _grown(mesh, (), (*faces, face[i : j + 1]), 1)


# --- face_delete ---


def any_face_but_the_last(mesh: PolyMesh) -> BoolArray:
    return np.full(len(mesh.face_ids), len(mesh.face_ids) > 1)


def delete_face(mesh: PolyMesh, face: int, _choice: Choice | None) -> PolyMesh:
    """The mesh without the face, and without the edges and vertices that had no other."""
    if len(mesh.face_ids) == 1:
        raise refusal("face_delete", "face", face, "it is the only face; a mesh keeps at least one")
    return _shrunk(mesh, _without(mesh.faces, face), _without(mesh.face_ids, face))


def _without(items: tuple[_Item, ...], i: int) -> tuple[_Item, ...]:
    return (*items[:i], *items[i + 1 :])


# --- face_hole ---


def faces_with_room(mesh: PolyMesh) -> BoolArray:
    topology = mesh.topology
    return np.repeat(roomy_faces(mesh.vertices, topology.corners, topology.face_offsets, TINY_AREA), len(HOLE_SIDES))


def _hole_of(element: int) -> tuple[int, int]:
    """The face and the number of sides that a hole index stands for."""
    return element // len(HOLE_SIDES), HOLE_SIDES[element % len(HOLE_SIDES)]


def regular_hole(mesh: PolyMesh, element: int) -> HoleChoice | None:
    return default_hole(mesh, *_hole_of(element))


def cut_hole(mesh: PolyMesh, element: int, choice: Choice | None) -> PolyMesh:
    """A hole with the corners choice.points, and its face cut in two by the bridges.

    The part that keeps the face's last half-edge (from its last corner to its first) keeps its id and place.
    """
    f, n_sides = _hole_of(element)
    face = mesh.faces[f]
    if choice is None or not faces_with_room(mesh)[element]:
        raise refusal("face_hole", "hole", element, f"face {f} crosses itself or has no room; choose another")
    if not isinstance(choice, HoleChoice) or len(choice.points) != n_sides:
        raise refusal("face_hole", "hole", element, f"{choice!r} is no hole of {n_sides} corners; give a HoleChoice")
    defect = hole_defect(mesh.vertices[list(face)], choice)
    if defect is not None:
        raise refusal("face_hole", "hole", element, f"{defect}; give points and bridges from plan_hole")
    (i, h), (j, k) = sorted(choice.bridges)
    new = len(mesh.vertex_ids)
    faces = list(mesh.faces)
    faces[f] = (*face[: i + 1], *_backwards(new, n_sides, h, k), *face[j:])
    part = (*face[i : j + 1], *_backwards(new, n_sides, k, h))
    return _grown(mesh, choice.points, (*faces, part), 1)


def _backwards(first: int, n: int, start: int, end: int) -> list[int]:
    """The hole's vertex indices from corner `start` down to `end`, against its winding."""
    return [first + (start - step) % n for step in range((start - end) % n + 1)]


# --- vertex_dissolve ---


def dissolvable_vertices(mesh: PolyMesh) -> BoolArray:
    return np.array([_vertex_defect(mesh, v) is None for v in range(len(mesh.vertex_ids))], np.bool_)


def _vertex_defect(mesh: PolyMesh, vertex: int) -> str | None:
    corner = mesh.topology.lone_corners[vertex]
    if corner < 0:
        return "more than two edges or one face meet there; choose a boundary vertex of valence 2"
    f, i = _corner(mesh, corner)
    face = mesh.faces[f]
    if len(face) == 3:
        return "its face is a triangle; choose a vertex of a larger face"
    a, b = face[i - 1], face[(i + 1) % len(face)]
    if (min(a, b), max(a, b)) in mesh.topology.edge_lookup:
        return "its two neighbours are joined by an edge already; choose another"
    return None


def dissolve_vertex(mesh: PolyMesh, vertex: int, _choice: Choice | None) -> PolyMesh:
    """The mesh without the vertex; its two edges become one."""
    defect = _vertex_defect(mesh, vertex)
    if defect is not None:
        raise refusal("vertex_dissolve", "vertex", vertex, defect)
    f, i = _corner(mesh, mesh.topology.lone_corners[vertex])
    return _shrunk(mesh, (*mesh.faces[:f], _without(mesh.faces[f], i), *mesh.faces[f + 1 :]), mesh.face_ids)


# --- edge_dissolve ---


def dissolvable_edges(mesh: PolyMesh) -> BoolArray:
    return np.array([_edge_defect(mesh, e) is None for e in range(mesh.topology.n_edges)], np.bool_)


def _edge_defect(mesh: PolyMesh, edge: int) -> str | None:
    h, g = mesh.topology.edge_half_edges[edge]
    if g < 0:
        return "it has one face only; choose an edge between two faces"
    owners = mesh.topology.links.faces
    if len(set(mesh.faces[owners[h]]).intersection(mesh.faces[owners[g]])) > 2:
        return "its two faces share more than this edge; choose another"
    return None


def dissolve_edge(mesh: PolyMesh, edge: int, _choice: Choice | None) -> PolyMesh:
    """The two faces beside the edge made one, which keeps the id and the first corner of the lower."""
    defect = _edge_defect(mesh, edge)
    if defect is not None:
        raise refusal("edge_dissolve", "edge", edge, defect)
    h, g = mesh.topology.edge_half_edges[edge]
    (f, i), (other, j) = _corner(mesh, h), _corner(mesh, g)
    face, joined = mesh.faces[f], mesh.faces[other]
    detour = (*joined[j:], *joined[:j])[2:]  # round the other face from the end of the edge back to its start
    faces = list(mesh.faces)
    faces[f] = (*face[: i + 1], *detour, *face[i + 1 :])
    return _shrunk(mesh, _without(tuple(faces), other), _without(mesh.face_ids, other))
