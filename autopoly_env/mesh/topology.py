"""Which vertices make which faces, and what follows from it: half-edges, edges, loops, parts, holes.

Letters: V vertices, E edges, F faces, H half-edges (= corners), B boundary half-edges. A half-edge and the
corner that it leaves share their index.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, TypeVar

import numpy as np

from autopoly_env.arrays import BoolArray, IntArray
from autopoly_env.mesh.flat import Flat

MANY = 256  # corners of a mesh from which on single elements are looked up without tables of all

Face = tuple[int, ...]
_Array = TypeVar("_Array", IntArray, BoolArray)


class HalfEdges(NamedTuple):
    """The half-edges as plain lists (H,), which are quicker than arrays on meshes this small."""

    tails: list[int]
    heads: list[int]
    faces: list[int]
    following: list[int]  # the next half-edge around the same face
    twins: list[int]  # the half-edge that runs the other way, -1 on the boundary
    offsets: list[int]  # (F+1,)


@dataclass(frozen=True)
class Topology:
    """The faces of a mesh as cycles of vertex indices, wound alike. Derived arrays are read-only."""

    n_vertices: int
    faces: tuple[Face, ...]

    def __reduce__(self) -> tuple[type["Topology"], tuple[object, ...]]:
        """Pickled without what is derived from it."""
        return Topology, (self.n_vertices, self.faces)

    @cached_property
    def links(self) -> HalfEdges:
        """How the half-edges hang together, H entries in each list but the last; all other properties follow from it.

        Numbered face by face, corner by corner. A valid mesh has each pair (tail, head) at most once.
        """
        tails: list[int] = []
        heads: list[int] = []
        owners: list[int] = []
        following: list[int] = []
        offsets = [0]
        for f, face in enumerate(self.faces):
            start = len(tails)
            tails += face
            heads += face[1:]
            heads.append(face[0])
            owners += [f] * len(face)
            following += range(start + 1, len(tails))
            following.append(start)
            offsets.append(len(tails))
        index = {pair: h for h, pair in enumerate(zip(tails, heads, strict=True))}
        twins = [index.get(pair, -1) for pair in zip(heads, tails, strict=True)]
        return HalfEdges(tails, heads, owners, following, twins, offsets)

    @cached_property
    def _flat(self) -> Flat | None:
        """The arrays to look single elements up in; None where tables of all are as quick."""
        return Flat.of(self.n_vertices, self.faces) if self.n_corners >= MANY else None

    def edge_at(self, a: int, b: int) -> int:
        """The index of the edge between two vertex indices, -1 if there is none."""
        if self._flat is not None:
            return self._flat.edge(a, b)
        return self.edge_lookup.get((a, b) if a < b else (b, a), -1)

    def sides(self, edge: int) -> tuple[int, int]:
        """One of `edge_half_edges`."""
        if self._flat is not None and "edge_half_edges" not in vars(self):
            return self._flat.sides(edge)
        return self.edge_half_edges[edge]

    def ends(self, half_edge: int) -> tuple[int, int]:
        """The vertices that a half-edge runs from and to."""
        f, i = self.corner(half_edge)
        face = self.faces[f]
        return face[i], face[i + 1 - len(face)]

    def corner(self, half_edge: int) -> tuple[int, int]:
        """The face of a corner (= half-edge), and the corner's position in it."""
        if self._flat is not None:
            return self._flat.corner(half_edge)
        face = self.links.faces[half_edge]
        return face, half_edge - self.links.offsets[face]

    def first_corner(self, face: int) -> int:
        """The number of the first corner (= half-edge) of a face."""
        return self.links.offsets[face] if self._flat is None else int(self._flat.offsets[face])

    def lone_corner(self, vertex: int) -> int:
        """One of `lone_corners`."""
        if self._flat is not None and "lone_corners" not in vars(self):
            return self._flat.lone_corner(vertex)
        return self.lone_corners[vertex]

    @cached_property
    def edge_lookup(self) -> dict[tuple[int, int], int]:
        """Edge index by its two vertex indices, the lower one first."""
        links = self.links
        rows = {(a, b) if a < b else (b, a) for a, b in zip(links.tails, links.heads, strict=True)}
        return {pair: e for e, pair in enumerate(sorted(rows))}

    @cached_property
    def half_edges(self) -> IntArray:
        """(H,2) directed edges (from, to) of all faces, face by face, corner by corner."""
        return _read_only(np.array((self.links.tails, self.links.heads), np.int64).T)

    @cached_property
    def half_edge_face(self) -> IntArray:
        """(H,) the face of each half-edge."""
        return _read_only(np.array(self.links.faces, np.int64))

    @cached_property
    def corners(self) -> IntArray:
        """(H,) the vertices of all faces, face by face: where each half-edge begins."""
        return _read_only(np.array(self.links.tails, np.int64))

    @cached_property
    def face_offsets(self) -> IntArray:
        """(F+1,) the corners of face f are rows face_offsets[f]:face_offsets[f+1] of `half_edges`."""
        return _read_only(np.array(self.links.offsets, np.int64))

    @cached_property
    def edges(self) -> IntArray:
        """(E,2) vertex indices, ascending within a row and from row to row."""
        rows = np.array(list(self.edge_lookup), np.int64) if self._flat is None else self._flat.edges
        return _read_only(rows)

    @cached_property
    def edge_half_edges(self) -> list[tuple[int, int]]:
        """Per edge the half-edge of its lower face and that of its other face, -1 on the boundary."""
        sides = [(-1, -1)] * len(self.edge_lookup)
        links, lookup = self.links, self.edge_lookup
        for h, (a, b) in enumerate(zip(links.tails, links.heads, strict=True)):
            twin = links.twins[h]
            if twin < 0 or h < twin:
                sides[lookup[(a, b) if a < b else (b, a)]] = (h, twin)
        return sides

    @cached_property
    def edge_faces(self) -> IntArray:
        """(E,2) the one or two faces of each edge, the lower first, -1 where there is no second."""
        owners = [*self.links.faces, -1]  # a missing half-edge, -1, reads the -1 at the end
        return _read_only(np.array([(owners[h], owners[g]) for h, g in self.edge_half_edges], np.int64))

    @cached_property
    def _boundary(self) -> list[list[int]]:
        """The boundary loops as half-edges; at a vertex the walk turns through the fan that it came in by."""
        following, twins = self.links.following, self.links.twins
        seen = [twin >= 0 for twin in twins]
        loops = []
        for start in range(len(twins)):
            if seen[start]:
                continue
            loop, h = [], start
            while not seen[h]:
                seen[h] = True
                loop.append(h)
                h = following[h]
                while twins[h] >= 0:
                    h = following[twins[h]]
            loops.append(loop)
        return loops

    @cached_property
    def boundary_loops(self) -> tuple[IntArray, ...]:
        """Vertex indices of each closed loop of the boundary; outer loops have positive area, holes negative.

        Where fans of faces meet in a single vertex (a pinch), each loop stays with its own fan.
        """
        tails = self.links.tails
        return tuple(_read_only(np.array([tails[h] for h in loop], np.int64)) for loop in self._boundary)

    @cached_property
    def boundary_half_edges(self) -> IntArray:
        """(B,2) the directed edges of the boundary, loop by loop in the order of `boundary_loops`."""
        tails, heads = self.links.tails, self.links.heads
        rows = [(tails[h], heads[h]) for loop in self._boundary for h in loop]
        return _read_only(np.array(rows, np.int64).reshape(-1, 2))

    @cached_property
    def boundary_labels(self) -> IntArray:
        """(B,2) the loop and the part of each row of `boundary_half_edges`; a part is faces that edges join."""
        part = self._part_of_face()
        faces = self.links.faces
        rows = [(i, part[faces[h]]) for i, loop in enumerate(self._boundary) for h in loop]
        return _read_only(np.array(rows, np.int64).reshape(-1, 2))

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
        return _read_only(np.array([g < 0 for _, g in self.edge_half_edges], np.bool_))

    @cached_property
    def is_boundary_vertex(self) -> BoolArray:
        """(V,) whether the vertex lies on a boundary edge."""
        mask = np.zeros(self.n_vertices, np.bool_)
        mask[self.boundary_half_edges[:, 0]] = True
        return _read_only(mask)

    @cached_property
    def valence(self) -> IntArray:
        """(V,) how many edges meet at each vertex."""
        return _read_only(np.bincount(self.edges.ravel(), minlength=self.n_vertices))

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
        return len(self.edge_lookup) if self._flat is None else len(self._flat.keys)

    @cached_property
    def n_corners(self) -> int:
        """H, of which every face has as many as vertices."""
        return sum(map(len, self.faces))

    @property
    def n_faces(self) -> int:
        return len(self.faces)

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


def _read_only(array: _Array) -> _Array:
    array.flags.writeable = False
    return array
