"""Constructions whose worth as lessons is known by hand."""

from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import OPERATORS, Action
from autopoly_env.sequence import ConstructionSequence

SQUARE = PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75)


def score(iou: float) -> dict[str, float]:
    return {"iou": iou, "complexity": 9, "self_intersections": 0, "total": 100 * iou}


def subdivided(*steps: tuple[dict[int, tuple[float, float]], float]) -> ConstructionSequence:
    """Subdivisions of edge 0 of a square with IoU 0.5, each with where vertices go in it, and its IoU."""
    mesh, transitions = SQUARE, []
    for places, iou in steps:
        mesh = OPERATORS["edge_subdivide"].apply(mesh, 0)
        vertices = mesh.vertices.copy()
        for name, place in places.items():
            vertices[mesh.vertex_index(name)] = place
        mesh = mesh.with_vertices(vertices)
        transitions.append((Action("edge_subdivide", 0), None, mesh, score(iou)))
    return ConstructionSequence.record({}, SQUARE, score(0.5), transitions)
