"""The half-edges and edges of a large mesh as arrays, in which single ones are looked up: no table of all is built.

Letters as in `topology`: V vertices, E edges, F faces, H half-edges.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain

import numpy as np

from autopoly_env.arrays import IntArray


@dataclass(frozen=True)
class Flat:
    """The faces of a mesh with n vertices, corner after corner, numbered as in `topology.HalfEdges`."""

    n_vertices: int
    tails: IntArray  # (H,)
    heads: IntArray  # (H,)
    offsets: IntArray  # (F+1,)

    @classmethod
    def of(cls, n_vertices: int, faces: Sequence[Sequence[int]]) -> "Flat":
        """The faces, given as cycles of vertex indices."""
        offsets = np.zeros(len(faces) + 1, np.int64)
        np.cumsum(np.fromiter(map(len, faces), np.int64, len(faces)), out=offsets[1:])
        tails = np.fromiter(chain.from_iterable(faces), np.int64, int(offsets[-1]))
        heads = np.empty_like(tails)
        heads[:-1] = tails[1:]
        heads[offsets[1:] - 1] = tails[offsets[:-1]]
        return cls(n_vertices, tails, heads, offsets)

    @cached_property
    def keys(self) -> IntArray:
        """(E,) a number for each edge, ascending in the order of `Topology.edges`."""
        low, high = np.minimum(self.tails, self.heads), np.maximum(self.tails, self.heads)
        keys = np.sort(low * self.n_vertices + high)  # an inner edge is there twice
        return keys[np.concatenate(([True], keys[1:] != keys[:-1]))]

    @property
    def edges(self) -> IntArray:
        """(E,2) vertex indices, see `Topology.edges`."""
        return np.column_stack(np.divmod(self.keys, self.n_vertices))

    def edge(self, a: int, b: int) -> int:
        """The index of the edge between two vertices, -1 if there is none."""
        key = min(a, b) * self.n_vertices + max(a, b)
        row = int(np.searchsorted(self.keys, key))
        return row if row < len(self.keys) and self.keys[row] == key else -1

    def sides(self, edge: int) -> tuple[int, int]:
        """The half-edge of the edge's lower face and that of its other face, -1 on the boundary."""
        a, b = divmod(int(self.keys[edge]), self.n_vertices)
        is_along = (self.tails == a) & (self.heads == b)
        found = np.flatnonzero(is_along | ((self.tails == b) & (self.heads == a))).tolist()
        return found[0], found[1] if len(found) > 1 else -1

    def corner(self, half_edge: int) -> tuple[int, int]:
        """The face of a corner, and the corner's position in it."""
        face = int(np.searchsorted(self.offsets, half_edge, side="right")) - 1
        return face, half_edge - int(self.offsets[face])

    def lone_corner(self, vertex: int) -> int:
        """The corner of the vertex if it has but one, else -1."""
        found = np.flatnonzero(self.tails == vertex)
        return int(found[0]) if len(found) == 1 else -1
