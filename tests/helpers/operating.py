"""Operators at work on small meshes: what comes of it, where it is legal, and with what line it is refused."""

import numpy as np
import pytest

from autopoly_env.errors import IllegalActionError
from autopoly_env.mesh import PolyMesh, validate
from autopoly_env.operators import OPERATORS, Choice


def quad() -> PolyMesh:
    return PolyMesh.rectangle(0.0, 0.0, 1.0, 1.0)


def two_quads() -> PolyMesh:
    """0-1-2 above 3-4-5: the quads (0, 1, 4, 3) and (1, 2, 5, 4) share edge 1-4."""
    return PolyMesh.from_faces([(x, y) for y in (0.0, 0.5) for x in (0.0, 0.5, 1.0)], [(0, 1, 4, 3), (1, 2, 5, 4)])


def grid() -> PolyMesh:
    return PolyMesh.grid(3, 0.0, 0.0, 1.0, 1.0)


def apply(name: str, mesh: PolyMesh, element: int, choice: Choice | None = None) -> PolyMesh:
    made = OPERATORS[name].apply(mesh, element, choice)
    validate(made)
    return made


def legal(name: str, mesh: PolyMesh) -> list[int]:
    return np.flatnonzero(OPERATORS[name].legal_mask(mesh)).tolist()


def refusal(name: str, mesh: PolyMesh, element: int, choice: Choice | None = None) -> str:
    """The one line with which an operator refuses."""
    with pytest.raises(IllegalActionError) as caught:
        OPERATORS[name].apply(mesh, element, choice)
    assert str(caught.value).startswith(f"{name} cannot work on {OPERATORS[name].element.name} {element}: ")
    assert "\n" not in str(caught.value)
    return str(caught.value)


def edge(mesh: PolyMesh, a: int, b: int) -> int:
    return mesh.edge_index(a, b)
