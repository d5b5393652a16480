"""Constructions by hand in which every operator works once, for tests of what shows or writes sequences."""

from collections.abc import Mapping
from typing import Any

from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import OPERATORS, Action
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.sequence.follower import moved_to

TOTALS = (60.0, 70.0, 69.0, 72.0, 80.0, 80.5, 81.5, 75.25)  # of the start and of each step
BEST = 6
# (operator, the element by ids, the choice by vertex ids, where vertices go afterwards)
STEPS: tuple[tuple[str, Mapping[str, Any], int | None, Mapping[int, tuple[float, float]]], ...] = (
    ("edge_subdivide", {"edge": [0, 1]}, None, {4: (0.5, 0.125)}),
    ("face_split", {"face": 0, "vertex": 4}, 2, {}),
    ("edge_extrude", {"edge": [1, 2]}, None, {3: (0.2, 0.8), 6: (0.9, 0.7)}),
    ("face_hole", {"face": 0, "sides": 3}, None, {}),
    ("vertex_dissolve", {"vertex": 5}, None, {}),
    ("edge_dissolve", {"edge": [1, 2]}, None, {}),
    ("face_delete", {"face": 3}, None, {}),
)
# What modellers have beside these: (operator, the element by ids, the choice by ids, where vertices go afterwards)
CHAPEL: tuple[tuple[str, Mapping[str, Any], Mapping[str, Any] | None, Mapping[int, tuple[float, float]]], ...] = (
    ("edge_cap", {"edge": [0, 1]}, None, {4: (0.5, 0.125)}),
    ("edge_cap", {"edge": [1, 2]}, None, {5: (0.9, 0.4)}),
    ("edge_fill", {"edge": [1, 4]}, {"to": [1, 5]}, {}),
    ("edge_extrude", {"edge": [2, 3]}, None, {6: (0.7, 0.85), 7: (0.3, 0.9)}),
    ("edge_extrude", {"edge": [2, 5]}, None, {8: (0.95, 0.6), 9: (0.85, 0.85)}),
    ("vertex_merge", {"vertex": 9}, {"to": 6}, {}),
    ("loop_cut", {"edge": [0, 1]}, {"from": 0, "slide": 0.25}, {}),
    ("face_inset", {"face": 6}, None, {}),
)


def house(n_steps: int = len(STEPS), settings: dict[str, Any] | None = None) -> ConstructionSequence:
    """The first steps of the construction, from the quad (0.25, 0.25) to (0.75, 0.75)."""
    start = mesh = PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75)
    transitions = []
    for k, (name, ids, to, moves) in enumerate(STEPS[:n_steps], 1):
        operator = OPERATORS[name]
        element = operator.element.index(mesh, dict(ids))
        choice = operator.choose(mesh, element)
        if to is not None:
            face = mesh.face_index(ids["face"])
            choice = mesh.topology.first_corner(face) + mesh.faces[face].index(mesh.vertex_index(to))
        mesh = operator.apply(mesh, element, choice)
        vertices = mesh.vertices.copy()
        for vertex, place in moves.items():
            vertices[mesh.vertex_index(vertex)] = place
        mesh = mesh.with_vertices(vertices)
        transitions.append((Action(name, element), choice, mesh, score(TOTALS[k])))
    return ConstructionSequence.record(settings or {"target": "house"}, start, score(TOTALS[0]), transitions)


def chapel() -> ConstructionSequence:
    """The operators of `CHAPEL`, from the same quad."""
    start = mesh = PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75)
    transitions = []
    for name, ids, choice_ids, moves in CHAPEL:
        operator = OPERATORS[name]
        element = operator.element.index(mesh, dict(ids))
        choice = None if operator.choice is None else operator.choice.indices(mesh, element, dict(choice_ids or {}))
        mesh = moved_to(operator.apply(mesh, element, choice), dict(moves))
        transitions.append((Action(name, element), choice, mesh, score(50.0)))
    return ConstructionSequence.record({"target": "chapel"}, start, score(50.0), transitions)


def score(total: float) -> dict[str, Any]:
    """A score as a sequence keeps it."""
    return {"iou": total / 100.0, "complexity": 9, "self_intersections": 0, "total": total}
