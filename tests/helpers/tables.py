"""A table that is built of a slab and two legs, and single steps."""

from typing import Any

from autopoly_env.mesh import PolyMesh
from autopoly_env.sequence import ConstructionSequence, Step


def table() -> ConstructionSequence:
    """A slab whose lower edge is cut twice and whose outer thirds are extruded down into legs."""
    slab = PolyMesh.rectangle(0.2, 0.3, 0.8, 0.4)
    score = {"iou": 0.5, "complexity": 9, "self_intersections": 0, "total": 50.0}
    sequence = ConstructionSequence.record({"target": "table"}, slab, score, [])
    for step in (
        a_step("edge_subdivide", {"edge": [2, 3]}, (4, 0.7, 0.4)),
        a_step("edge_subdivide", {"edge": [3, 4]}, (5, 0.3, 0.4)),
        a_step("edge_extrude", {"edge": [2, 4]}, (6, 0.8, 0.8), (7, 0.7, 0.8)),
        a_step("edge_extrude", {"edge": [3, 5]}, (8, 0.3, 0.8), (9, 0.2, 0.8)),
    ):
        sequence = sequence.with_step(len(sequence.steps), insert=step)
    return sequence


def a_step(operator: str, element: dict[str, Any], *moved: tuple[int, float, float]) -> Step:
    return Step(operator, element, None, {}, {}, moved, {})
