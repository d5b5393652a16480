"""How a random construction grows: an action that shows in the outline, then every vertex moved, then the next.

Lengths are in extents, the longer side of the mesh's bounding box, unless they say otherwise: a shape is put into the
picture when it is finished.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.mesh import PolyMesh, Topology
from autopoly_env.operators import HOLE_SIDES, OPERATORS, Action, Choice, HoleChoice
from autopoly_env.operators.edit_kernels import DELETE, DISSOLVE, EXTRUDE, HOLE, SPLIT, SUBDIVIDE
from autopoly_env.raster import workspace
from autopoly_env.targets import growth_kernels
from autopoly_env.targets.construction_kernels import Limits
from autopoly_env.targets.dice import Dice
from autopoly_env.targets.growth_kernels import MORE_DRAWS, STUCK

# What can change the outline by itself. `face_split` cannot: it comes with a `face_delete` of one of the two parts.
OUTLINE_OPERATORS = ("edge_subdivide", "edge_extrude", "face_delete", "face_hole", "vertex_dissolve")
MIN_GAP = 0.05  # between edges that do not meet: 2 pixels at 64 x 64 in the smallest shape
MIN_LENGTH = 0.08  # of an edge
MIN_BEND = 0.035  # of a corner of the outline from the line between its neighbours
MAX_COSINE = 0.92  # of the angle between edges that meet: 23 degrees
MIN_AREA = 0.2  # of the shape, in square extents
OVERLAP_RESOLUTION = 32  # pixels a side of the picture that shows whether faces overlap

_LIMITS = Limits(MIN_AREA, MIN_GAP, MIN_LENGTH, MIN_BEND, MAX_COSINE)
_MOST_EDGES = 128  # of the largest shape: each of ten changes brings four at most, and holes six
_N_DRAWS = 1024  # to begin with
_KINDS = {
    "edge_subdivide": SUBDIVIDE,
    "edge_extrude": EXTRUDE,
    "face_delete": DELETE,
    "vertex_dissolve": DISSOLVE,
    "face_split": SPLIT,
    "face_hole": HOLE,
}
_NAMES = {kind: name for name, kind in _KINDS.items()}
_CORNERS = ((-1, -1), (1, -1), (1, 1), (-1, 1))
_QUAD = Topology(4, ((0, 1, 2, 3),))


class Grown(NamedTuple):
    """A step: an action, what was left free by it, and the mesh after it and a random translation."""

    action: Action
    choice: Choice | None
    mesh: PolyMesh


class Growth(NamedTuple):
    """A rectangle and the n steps from it, as `growth_kernels.grow` gives them."""

    start: FloatArray  # (4, 2)
    steps: IntArray  # (n, 3)
    places: FloatArray  # of all vertices after each step, one after the other
    ends: IntArray  # (n,) where those of each end
    holes: FloatArray  # (n, 4, 2)
    bridges: IntArray  # (n, 4)
    packed: IntArray  # the topology in the end

    def put(self, scale: float, centre: FloatArray) -> "Growth":
        """The same about the middle of the picture, `centre` (2,) going there, so many times as large."""
        start, places, holes = (0.5 + scale * (some - centre) for some in (self.start, self.places, self.holes))
        return self._replace(start=start, places=places, holes=holes)

    @property
    def first(self) -> PolyMesh:
        """The rectangle."""
        return PolyMesh.numbered(self.start, _QUAD)

    @property
    def last(self) -> PolyMesh:
        """The shape in the end, its vertices and faces named by their numbers."""
        begin = self.ends[-2] if len(self.ends) > 1 else 0
        points = self.places[begin:]
        return PolyMesh.numbered(points, Topology.of_packed(len(points), self.packed))

    def told(self) -> Iterator[Grown]:
        """Step by step, done by the operators."""
        mesh = self.first
        for k, (begin, end) in enumerate(pairwise((0, *self.ends.tolist()))):
            kind, element, other = self.steps[k].tolist()
            action, choice = Action(_NAMES[kind], element), None if other < 0 else other
            if kind == HOLE:
                choice = self._hole(k)
            made = OPERATORS[action.operator].apply(mesh, element, choice)
            mesh = made.with_vertices(self.places[begin:end])
            yield Grown(action, choice, mesh)

    def _hole(self, k: int) -> HoleChoice:
        n_sides = HOLE_SIDES[self.steps[k, growth_kernels.ELEMENT] % len(HOLE_SIDES)]
        f, h, g, i = self.bridges[k].tolist()
        return HoleChoice(tuple((x, y) for x, y in self.holes[k, :n_sides].tolist()), ((f, h), (g, i)))


def grow(dice: Dice, operators: Sequence[str], n_changes: int) -> Growth | None:
    """A random rectangle and the steps from it, with `n_changes` of the outline; None where it grew into a corner.

    No two changes leave outlines with the same number of loops and corners, so that none undoes another.
    """
    useful = [operator for operator in operators if operator in OUTLINE_OPERATORS]
    if {"face_split", "face_delete"} <= set(operators):
        useful.append("face_split")
    kinds = np.array([_KINDS[operator] for operator in useful])
    start, n_draws = _rectangle(dice), _N_DRAWS
    scratch = workspace(OVERLAP_RESOLUTION, _MOST_EDGES), np.empty((OVERLAP_RESOLUTION, OVERLAP_RESOLUTION))
    while True:
        n_steps, n_used, *found = growth_kernels.grow(
            start, _QUAD.packed.copy(), kinds, n_changes, dice.ahead(n_draws), _LIMITS, *scratch
        )
        dice.skip(n_used)
        if n_steps != MORE_DRAWS:
            return None if n_steps == STUCK else Growth(start, *found)
        n_draws *= 2


def _rectangle(dice: Dice) -> FloatArray:
    """(4, 2) the corners of a rectangle in the unit square, up to 10 degrees from upright."""
    width, height = dice.between(0.25, 0.6), dice.between(0.25, 0.6)
    x, y, turn = dice.between(0.4, 0.6), dice.between(0.4, 0.6), np.radians(dice.between(-10.0, 10.0))
    along = np.array([np.cos(turn), np.sin(turn)])
    across = np.array([-along[1], along[0]])
    return np.array([(x, y) + 0.5 * (i * width * along + j * height * across) for i, j in _CORNERS])
