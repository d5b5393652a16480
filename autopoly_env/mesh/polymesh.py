"""`PolyMesh`: an immutable polygon mesh in the unit square, its validity and its canonical hash.

Letters: V vertices, E edges, F faces. Coordinates: x right, y down; a face has positive shoelace area.
Vertices and faces are numbered 0.. within one mesh (indices) and keep a name for life across meshes (ids).
"""

import hashlib
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.errors import MeshError
from autopoly_env.mesh import geometry_kernels
from autopoly_env.mesh.drawing import Figure, drawing, groups
from autopoly_env.mesh.topology import Face, Topology

_NOTEBOOK_SIZE = 320  # user units a side of the drawing that notebooks show


class Defects(NamedTuple):
    """How often something is wrong with a valid mesh."""

    crossings: int  # pairs of edges that cross
    uncertain: int  # those of them that rounding decides
    hairlines: int
    flipped: int  # faces that are flipped or empty


@dataclass(frozen=True, eq=False, repr=False)
class PolyMesh:
    """A polygon mesh; every change makes a new one. Its faces are n-gons; holes are rings of faces.

    Nothing is checked here, so that operators stay quick: meshes from outside come through `from_faces` or
    `validate`.
    """

    vertices: FloatArray  # (V,2) unit square, a read-only copy of what is given
    topology: Topology
    vertex_ids: tuple[int, ...]  # (V,) names that are never reused
    face_ids: tuple[int, ...]  # (F,)
    next_vertex_id: int
    next_face_id: int

    def __post_init__(self) -> None:
        vertices = np.array(self.vertices, np.float64)
        vertices.flags.writeable = False
        object.__setattr__(self, "vertices", vertices)

    def __reduce__(self) -> tuple[type["PolyMesh"], tuple[object, ...]]:
        """Pickled without its caches, and read-only again when it comes back."""
        return PolyMesh, (self.vertices, *self._naming())

    @classmethod
    def from_faces(cls, vertices: npt.ArrayLike, faces: Iterable[Sequence[int]]) -> "PolyMesh":
        """A checked mesh of `vertices` (V,2) and `faces` (vertex indices, positive area) with ids 0, 1, ...

        Raises MeshError if it is no valid mesh (see `validate`).
        """
        points = _as_points(vertices)
        cycles = tuple(tuple(int(v) for v in face) for face in faces)
        mesh = cls.numbered(points, Topology(len(points), cycles))
        validate(mesh)
        return mesh

    @classmethod
    def numbered(cls, vertices: FloatArray, topology: Topology) -> "PolyMesh":
        """The mesh of `vertices` (V,2) and a topology with ids 0, 1, ..., unchecked."""
        n, f = topology.n_vertices, topology.n_faces
        return cls(vertices, topology, tuple(range(n)), tuple(range(f)), n, f)

    @classmethod
    def rectangle(cls, x0: float, y0: float, x1: float, y1: float) -> "PolyMesh":
        """One quad with the corners (x0, y0), (x1, y0), (x1, y1), (x0, y1): 4 vertices, 4 edges, 1 face."""
        _check_box(x0, y0, x1, y1)
        return cls.from_faces([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], [(0, 1, 2, 3)])

    @classmethod
    def grid(cls, n: int, x0: float, y0: float, x1: float, y1: float) -> "PolyMesh":
        """n x n quads over a box, vertices and faces row by row."""
        _check_box(x0, y0, x1, y1)
        if n < 1:
            raise MeshError(f"a grid of {n} x {n} quads was asked for; give n of at least 1")
        columns, rows = np.meshgrid(np.linspace(x0, x1, n + 1), np.linspace(y0, y1, n + 1))
        corners = [row * (n + 1) + column for row in range(n) for column in range(n)]
        faces = [(c, c + 1, c + n + 2, c + n + 1) for c in corners]
        return cls.from_faces(np.column_stack((columns.ravel(), rows.ravel())), faces)

    def with_vertices(self, vertices: npt.ArrayLike, defects: Defects | None = None) -> "PolyMesh":
        """The same mesh with its vertices (V,2) elsewhere; the topology is shared, all it derives too.

        `defects` are those of the new mesh, where they are known already.
        """
        points = np.asarray(vertices, np.float64)
        if points.shape != self.vertices.shape:
            raise MeshError(f"new vertices have shape {points.shape}; give {self.vertices.shape}, one row per vertex")
        made = PolyMesh(points, self.topology, self.vertex_ids, self.face_ids, self.next_vertex_id, self.next_face_id)
        if defects is not None:
            made.__dict__["defects"] = defects
        return made

    @property
    def faces(self) -> tuple[Face, ...]:
        """Vertex indices of each face."""
        return self.topology.faces

    @property
    def edges(self) -> IntArray:
        """(E,2) vertex indices, see `Topology.edges`."""
        return self.topology.edges

    @property
    def counts(self) -> tuple[int, int, int]:
        """(V, E, F)."""
        return len(self.vertex_ids), self.topology.n_edges, len(self.face_ids)

    @property
    def complexity(self) -> int:
        """V + E + F, the paper's r_sc."""
        return sum(self.counts)

    @cached_property
    def defects(self) -> Defects:
        """What is wrong with it all the same: see `sanity`."""
        return Defects(*geometry_kernels.defects(self.vertices, self.topology.packed))

    def face_areas(self) -> FloatArray:
        """(F,) signed shoelace areas in the unit square; negative for a flipped face."""
        start, end = self.vertices[self.topology.half_edges.T]
        cross = start[:, 0] * end[:, 1] - end[:, 0] * start[:, 1]
        return 0.5 * np.add.reduceat(cross, self.topology.face_offsets[:-1])

    @cached_property
    def _vertex_of_id(self) -> dict[int, int]:
        return dict(zip(self.vertex_ids, range(len(self.vertex_ids)), strict=True))

    @cached_property
    def _face_of_id(self) -> dict[int, int]:
        return dict(zip(self.face_ids, range(len(self.face_ids)), strict=True))

    def vertex_index(self, vertex_id: int) -> int:
        """The index of the vertex with this id. Raises MeshError if there is none."""
        if vertex_id not in self._vertex_of_id:
            raise MeshError(f"vertex id {vertex_id} is not in this mesh; give one of {_listed(self.vertex_ids)}")
        return self._vertex_of_id[vertex_id]

    def face_index(self, face_id: int) -> int:
        """The index of the face with this id. Raises MeshError if there is none."""
        if face_id not in self._face_of_id:
            raise MeshError(f"face id {face_id} is not in this mesh; give one of {_listed(self.face_ids)}")
        return self._face_of_id[face_id]

    def edge_index(self, a: int, b: int) -> int:
        """The index of the edge between the vertex indices a and b. Raises MeshError if there is none."""
        edge = self.topology.edge_at(a, b)
        if edge < 0:
            raise MeshError(f"no edge joins vertices {a} and {b}; give the two ends of an edge")
        return edge

    def __eq__(self, other: object) -> bool:
        """Whether numbering, names and positions all agree."""
        if not isinstance(other, PolyMesh):
            return NotImplemented
        return self._naming() == other._naming() and np.array_equal(self.vertices, other.vertices)

    def __hash__(self) -> int:
        return hash((self._naming(), (self.vertices + 0.0).tobytes()))  # 0.0 and -0.0 are equal

    def _naming(self) -> tuple[Topology, tuple[int, ...], tuple[int, ...], int, int]:
        return self.topology, self.vertex_ids, self.face_ids, self.next_vertex_id, self.next_face_id

    def __repr__(self) -> str:
        n_vertices, n_edges, n_faces = self.counts
        return f"PolyMesh(V={n_vertices}, E={n_edges}, F={n_faces})"

    @property
    def figure(self) -> Figure:
        """What a drawing shows of it."""
        points = [(x, y) for x, y in self.vertices.tolist()]
        return Figure(points, self.vertex_ids, self.edges.tolist(), self.faces, self.face_ids)

    def _repr_svg_(self) -> str:
        """A drawing, for notebooks."""
        return drawing(_NOTEBOOK_SIZE, groups(self.figure, _NOTEBOOK_SIZE))


def validate(mesh: PolyMesh) -> None:
    """Raise MeshError naming the first defect of a mesh. Flipped or crossing faces are no defect."""
    _check_vertices(mesh)
    n_vertices, faces = len(mesh.vertices), mesh.faces
    if not faces:
        raise MeshError("the mesh has no face; give at least one")
    for f, face in enumerate(faces):
        if len(face) < 3:
            raise MeshError(f"face {f} has {len(face)} vertices; give at least 3")
        if min(face) < 0 or max(face) >= n_vertices:
            raise MeshError(f"face {f} names a vertex outside 0..{n_vertices - 1}; give indices of the vertex list")
        if len(set(face)) < len(face):
            raise MeshError(f"face {f} passes through a vertex twice; give each vertex of a face once")
    _check_edges(faces)
    loose = set(range(n_vertices)).difference(*faces)
    if loose:
        raise MeshError(f"vertex {min(loose)} belongs to no face; leave it out")
    _check_ids("vertex", mesh.vertex_ids, n_vertices, mesh.next_vertex_id)
    _check_ids("face", mesh.face_ids, len(faces), mesh.next_face_id)


def is_valid(mesh: PolyMesh) -> bool:
    """Whether `validate` finds nothing."""
    try:
        validate(mesh)
    except MeshError:
        return False
    return True


def canonical_hash(mesh: PolyMesh, grid: float = 2**-20) -> str:
    """A hash of the shape that no numbering enters: not of vertices, faces, or the first corner of a face.

    The faces are hashed as cycles of coordinates, rounded to multiples of `grid` (unit square).
    """
    keys = list(map(tuple, np.rint(mesh.vertices / grid).astype(np.int64).tolist()))
    cycles = sorted(_least_rotation([keys[v] for v in face]) for face in mesh.faces)
    return hashlib.blake2b(repr(cycles).encode(), digest_size=16).hexdigest()


def _least_rotation(cycle: list[tuple[int, ...]]) -> list[tuple[int, ...]]:
    least = min(cycle)
    return min(cycle[i:] + cycle[:i] for i, key in enumerate(cycle) if key == least)


def _as_points(vertices: npt.ArrayLike) -> FloatArray:
    points = np.asarray(vertices, np.float64)
    if points.ndim != 2 or points.shape[1] != 2:
        raise MeshError(f"vertices have shape {points.shape}; give (V, 2), one row x, y per vertex")
    return points


def _check_box(x0: float, y0: float, x1: float, y1: float) -> None:
    if not (x0 < x1 and y0 < y1):
        raise MeshError(f"the box ({x0}, {y0}) to ({x1}, {y1}) is empty; give x0 < x1 and y0 < y1")


def _check_vertices(mesh: PolyMesh) -> None:
    points = _as_points(mesh.vertices)
    if mesh.topology.n_vertices != len(points):
        raise MeshError(f"{len(points)} vertices came with a topology of {mesh.topology.n_vertices}; give one row each")
    broken = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(broken):
        raise MeshError(f"vertex {broken[0]} is not finite; give finite coordinates")


def _check_edges(faces: tuple[Face, ...]) -> None:
    directed = Counter(pair for face in faces for pair in pairwise((*face, face[0])))
    for (a, b), n_along in directed.items():
        n_faces = n_along + directed.get((b, a), 0)
        if n_faces > 2:
            raise MeshError(f"edge {a}-{b} has {n_faces} faces; an edge has one or two")
        if n_along > 1:
            raise MeshError(f"two faces run along edge {a}-{b} in the same direction; reverse one of them")


def _check_ids(kind: str, ids: tuple[int, ...], n_elements: int, next_id: int) -> None:
    if len(ids) != n_elements:
        raise MeshError(f"{len(ids)} {kind} ids came for {n_elements} elements; give one id each")
    doubled = [name for name, n_times in Counter(ids).items() if n_times > 1]
    if doubled:
        raise MeshError(f"{kind} id {doubled[0]} stands for two elements; give each its own")
    if min(ids) < 0 or max(ids) >= next_id:
        raise MeshError(f"{kind} ids must lie in 0..{next_id - 1}, below the next free id; renumber them")


def _listed(ids: tuple[int, ...]) -> str:
    return ", ".join(map(str, ids[:12])) + (", ..." if len(ids) > 12 else "")
