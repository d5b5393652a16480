"""`Reach`: which outlines a simulator's operators and step limit can build."""

from typing import NamedTuple

from agents.trace.outline import Outline
from agents.trace.rings import Ring
from autopoly_env.simulator import Simulator


class Reach(NamedTuple):
    """What can be built of rings."""

    more_than_quads: bool  # edge_subdivide
    holes: bool  # face_hole
    parts: bool  # further parts: edge_extrude and face_delete
    triangles: bool  # outer rings of three vertices: vertex_dissolve
    n_steps: int

    @classmethod
    def of(cls, simulator: Simulator) -> "Reach":
        operators = set(simulator.operators)
        return cls(
            "edge_subdivide" in operators,
            "face_hole" in operators,
            {"edge_extrude", "face_delete"} <= operators,
            "vertex_dissolve" in operators,
            simulator.max_steps,
        )

    def sizes(self, ring: Ring, index: int) -> range:
        """Numbers of vertices that ring `index` of an outline may have; empty if it cannot be built at all."""
        if (ring.is_hole and not self.holes) or (index > 0 and not ring.is_hole and not self.parts):
            return range(0)
        return range(3 if ring.is_hole or self.triangles else 4, 10_000 if self.more_than_quads else 5)

    def allows(self, outline: Outline) -> bool:
        """Whether the outline can be built, bridges permitting."""
        sizes_fit = all(len(ring.points) in self.sizes(ring, k) for k, ring in enumerate(outline.rings))
        return sizes_fit and outline.n_steps <= self.n_steps
