"""What rendering and target disagree about, as far as an operator may ask: `placement.Disagreement` answers."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple, Protocol

from autopoly_env.arrays import FloatArray
from autopoly_env.mesh import PolyMesh, defects_of

_SHRINKING = (1.0, 0.7, 0.4, 0.15)  # shares of a proposed move, tried until the mesh stays sane


class Blame(NamedTuple):
    """What a boundary edge answers for, on one side of it. Lengths and areas in the unit square."""

    mass: float  # area of the region with most of the edge's pixels, as far as they are the edge's; 0 for nothing
    far_x: float  # the pixel of it that is farthest from the edge
    far_y: float
    low: float  # the stretch along the edge that the pixels span, 0 to 1
    high: float
    depth: float  # distance of the farthest pixel from the edge's line


class Region(NamedTuple):
    """A connected region that the rendering shows too much of (area below 0) or leaves bare. In the unit square."""

    area: float
    deep_x: float  # the pixel that lies deepest inside
    deep_y: float
    radius: float  # its distance to the rim
    mean_x: float
    mean_y: float
    var_x: float
    var_y: float
    cov_xy: float


class Evidence(Protocol):
    """What separates a mesh's rendering from its target."""

    mesh: PolyMesh

    @property
    def defects(self) -> tuple[int, int]:
        """(crossings, flipped faces) of the mesh."""

    @property
    def most(self) -> tuple[float, float]:
        """The largest masses that an edge is to blame for: what is missing, what is too much."""

    def missing(self, edge: int) -> Blame | None:
        """What the rendering leaves bare beside an edge; None for an edge that is not on the boundary."""

    def excess(self, edge: int) -> Blame | None:
        """What the rendering shows too much of beside an edge; None for an edge that is not on the boundary."""

    def excess_in(self, face: int) -> Region | None:
        """The largest region that the rendering shows too much of and whose deepest pixel lies in the face."""


def sane_move(evidence: Evidence, plain: PolyMesh, goal: FloatArray | Sequence[Sequence[float]]) -> Iterator[PolyMesh]:
    """`plain` with its last len(goal) vertices moved to `goal`, or as far as brings no new crossing or flip, if any."""
    n = len(goal)
    for share in _SHRINKING:
        vertices = plain.vertices.copy()
        vertices[-n:] += share * (goal - vertices[-n:])
        moved = plain.with_vertices(vertices)
        crossings, flipped = defects_of(moved)
        if crossings <= evidence.defects[0] and flipped <= evidence.defects[1]:
            yield moved
            return


def missing_mass(evidence: Evidence, edge: int) -> float:
    """The area (unit square) that is missing outside a boundary edge, as far as it answers for it."""
    missing = evidence.missing(edge)
    return 0.0 if missing is None else missing.mass
