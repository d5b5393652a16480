"""Which polygons to make of a contour: for every number of vertices the one with the least area between the two."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from agents.trace.simplify_kernels import best_polygons, chord_errors, thin
from autopoly_env.arrays import FloatArray, IntArray

N_CANDIDATES = 120  # points of the contour that may become vertices; half as many may be vertices of one polygon
_MOST_CANDIDATES = 1920
_LONGEST_CHORD = 120  # candidates that a chord may span


@dataclass(frozen=True)
class Contour:
    """A closed contour (n, 2) and its best polygons."""

    points: FloatArray
    n_candidates: int = N_CANDIDATES

    @cached_property
    def finer(self) -> "Contour | None":
        """The same with twice as many candidates, for polygons of up to twice as many vertices; None if that is all."""
        if self.n_candidates >= min(len(self.points), _MOST_CANDIDATES):
            return None
        return Contour(self.points, 2 * self.n_candidates)

    @property
    def n_most(self) -> int:
        """How many vertices a polygon may have."""
        return min(self.n_candidates // 2, len(self._candidates))

    @cached_property
    def _candidates(self) -> FloatArray:
        """At most `n_candidates` points of the contour, beginning with the one that matters most."""
        kept = self.points[thin(self.points, min(len(self.points), self.n_candidates))]
        first = int(thin(kept, min(len(kept), 3))[0])
        return np.ascontiguousarray(np.roll(kept, -first, axis=0))

    @cached_property
    def _best(self) -> tuple[FloatArray, IntArray]:
        errors, came_from = best_polygons(chord_errors(self._candidates, _LONGEST_CHORD), self.n_most, _LONGEST_CHORD)
        return errors, came_from

    @property
    def errors(self) -> FloatArray:
        """(k+1,) area (unit square) between the contour and its best polygon of k vertices; infinite below 3."""
        errors = self._best[0].copy()
        errors[:3] = np.inf
        return errors

    def polygon(self, n_vertices: int) -> FloatArray:
        """The best polygon (n_vertices, 2) whose vertices lie on the contour."""
        _, came_from = self._best
        chosen, j = [], len(self._candidates)
        for k in range(n_vertices, 0, -1):
            j = int(came_from[k, j])
            chosen.append(j)
        return self._candidates[chosen[::-1]]
