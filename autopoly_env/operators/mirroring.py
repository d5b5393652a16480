"""Helpers for operators under symmetry: an action that changes the outline is followed by its mirror image.

New vertices are made exact mirror images of each other here, and the refit keeps them so.
"""

from collections.abc import Mapping

from autopoly_env.arrays import FloatArray
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators.action import Action, Choice, Halfway
from autopoly_env.operators.operator import Operator


def again(operator: Operator, first: PolyMesh, element: int, choice: Choice | None = None) -> tuple[PolyMesh, Halfway]:
    """The mesh after the operator has worked on an element of `first`, too."""
    return operator.apply(first, element, choice), Halfway(first, Action(operator.name, element), choice)


def moved(mesh: PolyMesh, places: Mapping[int, FloatArray]) -> PolyMesh:
    """The mesh with some vertices, by index, elsewhere."""
    vertices = mesh.vertices.copy()
    for vertex, place in places.items():
        vertices[vertex] = place
    return mesh.with_vertices(vertices)
