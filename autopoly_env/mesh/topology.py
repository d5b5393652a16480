"""Which vertices make which faces, and what follows from it: half-edges, edges, loops, parts, holes.

Letters: V vertices, E edges, F faces, H half-edges (= corners), B boundary half-edges. A half-edge and the
corner that it leaves share their index.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, chain, pairwise
from typing import Any, NamedTuple

import numpy as np

from autopoly_env.arrays import BoolArray, IntArray, read_only
from autopoly_env.errors import MeshError
from autopoly_env.mesh.topology_kernels import PAIRS, Links, packed_links

MANY = 256  # corners of a mesh from which on single elements are looked up without tables of all

Face = tuple[int, ...]


class HalfEdges(NamedTuple):
    """The half-edges as plain lists (H,), which are quicker than arrays on meshes this small."""

    tails: list[int]
    heads: list[int]
    faces: list[int]
    following: list[int]  # the next half-edge around the same face
    twins: list[int]  # the half-edge that runs the other way, -1 on the boundary
    offsets: list[int]  # (F+1,)


_PLACES = {name: k for k, name in enumerate(Links._fields)}


class _Parts:
    """The parts of a packed topology by the names that `Links` has, each cut out when it is first asked for."""

    def __init__(self, packed: IntArray) -> None:
        self._packed = packed
        self._begins = packed[: len(Links._fields) + 1].tolist()

    def __getattr__(self, name: str) -> IntArray:
        k = _PLACES.get(name, -1)
        if k < 0:
            raise AttributeError(f"a topology has no {name!r}; there is {', '.join(Links._fields)}")
        begin, end = self._begins[k : k + 2]
        part = self._packed[begin:end]
        if name in PAIRS:
            part = part.reshape(-1, 2)
        self.__dict__[name] = part
        return part


@dataclass(frozen=True, eq=False)
class Topology:
    """The faces of a mesh as cycles of vertex indices, wound alike. Derived arrays are read-only."""

    n_vertices: int
    faces: tuple[Face, ...]

    @classmethod
    def of_packed(cls, n_vertices: int, packed: IntArray) -> "Topology":
        """The topology that a kernel has made; its `faces` are found when they are asked for."""
        made = object.__new__(cls)
        made.__dict__.update(n_vertices=n_vertices, packed=read_only(packed))
        return made

    def __getattr__(self, name: str) -> Any:
        if name != "faces" or "packed" not in self.__dict__:
            raise AttributeError(f"a Topology has no {name!r}")
        corners, ends = self.corners.tolist(), self.face_offsets.tolist()
        faces = tuple(map(tuple, map(corners.__getitem__, map(slice, ends, ends[1:]))))
        self.__dict__["faces"] = faces
        return faces

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Topology):
            return NotImplemented
        return self.n_vertices == other.n_vertices and self._key == other._key

    def __hash__(self) -> int:
        return hash((self.n_vertices, self._key))

    @cached_property
    def _key(self) -> tuple[bytes, bytes]:
        return self.corners.tobytes(), self.face_offsets.tobytes()

    def __reduce__(self) -> tuple[type["Topology"], tuple[object, ...]]:
        """Pickled without what is derived from it."""
        return Topology, (self.n_vertices, self.faces)

    @cached_property
    def packed(self) -> IntArray:
        """All of it as one array, which kernels take apart (`topology_kernels.links_in`).

        Raises MeshError where a face has a vertex that there is not.
        """
        packed: IntArray = packed_links(self.corners, self.face_offsets, self.n_vertices)
        if not len(packed):
            raise MeshError(f"a face has a vertex beyond the {self.n_vertices} that there are; give indices from 0")
        return read_only(packed)

    @cached_property
    def arrays(self) -> _Parts:
        """The parts of `packed` by the names of `Links`; the other properties follow from them."""
        return _Parts(self.packed)

    @cached_property
    def links(self) -> HalfEdges:
        """How the half-edges hang together, H entries in each list but the last.

        Numbered face by face, corner by corner. A valid mesh has each pair (tail, head) at most once.
        """
        arrays = self.arrays
        tails, heads = arrays.half_edges.T.tolist()
        lists = (array.tolist() for array in (arrays.owners, arrays.following, arrays.twins, self.face_offsets))
        return HalfEdges(tails, heads, *lists)

    def edge_at(self, a: int, b: int) -> int:
        """The index of the edge between two vertex indices, -1 if there is none."""
        low, high = (a, b) if a < b else (b, a)
        if self.n_corners < MANY:
            return self.edge_lookup.get((low, high), -1)
        first, last = np.searchsorted(self.edges[:, 0], (low, low + 1)).tolist()
        row = first + int(np.searchsorted(self.edges[first:last, 1], high))
        return row if row < last and self.edges[row, 1] == high else -1

    def sides(self, edge: int) -> tuple[int, int]:
        """One of `edge_half_edges`."""
        lower, other = self.arrays.sides[edge].tolist()
        return lower, other

    def ends(self, half_edge: int) -> tuple[int, int]:
        """The vertices that a half-edge runs from and to."""
        tail, head = self.arrays.half_edges[half_edge].tolist()
        return tail, head

    def corner(self, half_edge: int) -> tuple[int, int]:
        """The face of a corner (= half-edge), and the corner's position in it."""
        face = int(self.arrays.owners[half_edge])
        return face, half_edge - int(self.face_offsets[face])

    def first_corner(self, face: int) -> int:
        """The number of the first corner (= half-edge) of a face."""
        return int(self.face_offsets[face])

    def lone_corner(self, vertex: int) -> int:
        """One of `lone_corners`."""
        if self.n_corners < MANY:
            return self.lone_corners[vertex]
        found = np.flatnonzero(self.corners == vertex)
        return int(found[0]) if len(found) == 1 else -1

    @cached_property
    def edge_lookup(self) -> dict[tuple[int, int], int]:
        """Edge index by its two vertex indices, the lower one first."""
        return {(a, b): e for e, (a, b) in enumerate(self.edges.tolist())}

    @property
    def half_edges(self) -> IntArray:
        """(H,2) directed edges (from, to) of all faces, face by face, corner by corner."""
        return self.arrays.half_edges

    @property
    def half_edge_face(self) -> IntArray:
        """(H,) the face of each half-edge."""
        return self.arrays.owners

    @cached_property
    def corners(self) -> IntArray:
        """(H,) the vertices of all faces, face by face: where each half-edge begins."""
        if "packed" in self.__dict__:
            return self.arrays.corners
        return read_only(np.fromiter(chain.from_iterable(self.faces), np.int64))

    @cached_property
    def face_offsets(self) -> IntArray:
        """(F+1,) the corners of face f are rows face_offsets[f]:face_offsets[f+1] of `half_edges`."""
        if "packed" in self.__dict__:
            return self.arrays.offsets
        return read_only(np.fromiter(accumulate(map(len, self.faces), initial=0), np.int64))

    @cached_property
    def edges(self) -> IntArray:
        """(E,2) vertex indices, ascending within a row and from row to row."""
        return self.arrays.edges

    @cached_property
    def edge_half_edges(self) -> list[tuple[int, int]]:
        """Per edge the half-edge of its lower face and that of its other face, -1 on the boundary."""
        return [(h, twin) for h, twin in self.arrays.sides.tolist()]

    @cached_property
    def edge_faces(self) -> IntArray:
        """(E,2) the one or two faces of each edge, the lower first, -1 where there is no second."""
        sides, owners = self.arrays.sides, self.arrays.owners
        return read_only(np.where(sides < 0, -1, owners[sides]))

    @property
    def _boundary(self) -> list[list[int]]:
        """The boundary loops as half-edges; at a vertex the walk turns through the fan that it came in by."""
        rim = self.arrays.rim.tolist()
        return [rim[begin:end] for begin, end in pairwise((0, *self.arrays.loop_ends.tolist()))]

    @cached_property
    def boundary_loops(self) -> tuple[IntArray, ...]:
        """Vertex indices of each closed loop of the boundary; outer loops have positive area, holes negative.

        Where fans of faces meet in a single vertex (a pinch), each loop stays with its own fan.
        """
        tails = self.boundary_half_edges[:, 0]
        loops = pairwise((0, *self.arrays.loop_ends.tolist()))
        return tuple(read_only(tails[begin:end].copy()) for begin, end in loops)

    @cached_property
    def boundary_half_edges(self) -> IntArray:
        """(B,2) the directed edges of the boundary, loop by loop in the order of `boundary_loops`."""
        return self.arrays.boundary

    @cached_property
    def boundary_labels(self) -> IntArray:
        """(B,2) the loop and the part of each row of `boundary_half_edges`; a part is faces that edges join."""
        part = self._part_of_face()
        faces = self.links.faces
        rows = [(i, part[faces[h]]) for i, loop in enumerate(self._boundary) for h in loop]
        return read_only(np.array(rows, np.int64).reshape(-1, 2))

    def _part_of_face(self) -> list[int]:
        links, part = self.links, [-1] * self.n_faces
        for first in range(self.n_faces):
            if part[first] >= 0:
                continue
            part[first], left = first, [first]
            while left:
                f = left.pop()
                for g in links.twins[links.offsets[f] : links.offsets[f + 1]]:
                    if g >= 0 and part[links.faces[g]] < 0:
                        part[links.faces[g]] = first
                        left.append(links.faces[g])
        return part

    @cached_property
    def is_boundary_edge(self) -> BoolArray:
        """(E,) whether the edge has one face."""
        return read_only(self.arrays.sides[:, 1] < 0)

    @cached_property
    def is_boundary_vertex(self) -> BoolArray:
        """(V,) whether the vertex lies on a boundary edge."""
        mask = np.zeros(self.n_vertices, np.bool_)
        mask[self.arrays.outer] = True
        return read_only(mask)

    @cached_property
    def valence(self) -> IntArray:
        """(V,) how many edges meet at each vertex."""
        return read_only(np.bincount(self.edges.ravel(), minlength=self.n_vertices))

    @cached_property
    def lone_corners(self) -> list[int]:
        """Per vertex its corner if it has but one (a boundary vertex of valence 2), else -1."""
        corners = [-1] * self.n_vertices
        crowded = set()
        for h, v in enumerate(self.links.tails):
            if corners[v] >= 0:
                crowded.add(v)
            corners[v] = h
        for v in crowded:
            corners[v] = -1
        return corners

    @property
    def n_edges(self) -> int:
        return len(self.edges)

    @cached_property
    def n_corners(self) -> int:
        """H, of which every face has as many as vertices."""
        return len(self.corners)

    @property
    def n_faces(self) -> int:
        return len(self.face_offsets) - 1

    @cached_property
    def n_components(self) -> int:
        """How many parts there are when faces that share a vertex hang together."""
        first_face: dict[int, int] = {}
        links = self.links
        pairs = ((first_face.setdefault(v, f), f) for v, f in zip(links.tails, links.faces, strict=True))
        return _count_groups(self.n_faces, pairs)

    @cached_property
    def n_holes(self) -> int:
        """How many holes the parts enclose, counted from the boundary loops.

        Taken apart at its pinch vertices the mesh has C' parts and L' loops, hence L' - C' holes. Closing a
        pinch again joins two parts or closes one more hole: n_holes = (L' - C') + (fans - V) - (C' -
        n_components).
        """
        links = self.links
        joined = ((links.faces[h], links.faces[g]) for h, g in enumerate(links.twins) if g > h)
        n_parts = _count_groups(self.n_faces, joined)
        return len(self._boundary) + self._n_fans() - self.n_vertices + self.n_components - 2 * n_parts

    def _n_fans(self) -> int:
        """How many fans of faces there are around all vertices: V, and one per further fan at a pinch."""
        links = self.links
        turns = ((h, links.following[g]) for h, g in enumerate(links.twins) if g >= 0)
        return _count_groups(len(links.tails), turns)


def _count_groups(n: int, pairs: Iterable[tuple[int, int]]) -> int:
    """The number of groups that 0..n-1 form once every pair is joined."""
    parent = list(range(n))
    for a, b in pairs:
        while parent[a] != a:
            parent[a] = a = parent[parent[a]]
        while parent[b] != b:
            parent[b] = b = parent[parent[b]]
        if a != b:
            parent[a] = b
            n -= 1
    return n
