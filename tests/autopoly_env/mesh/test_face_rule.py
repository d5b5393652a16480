"""The rule of faces: which faces break it, and what is said of them."""

import numpy as np
import pytest
from hypothesis import given, settings

from autopoly_env.errors import ConfigError, MeshError
from autopoly_env.mesh import (
    ASKED_TURN,
    FACE_RULES,
    LEAST_TURN,
    PolyMesh,
    broken_faces,
    check_faces,
    defects_of,
    face_rule,
    fits_rule,
    is_sane,
)
from tests.helpers.shapes import polygon
from tests.helpers.strategies import meshes

SQUARE = PolyMesh.rectangle(0.2, 0.2, 0.8, 0.8)
DART = polygon(np.array([(0.2, 0.2), (0.5, 0.4), (0.8, 0.2), (0.5, 0.8)]))
PENTAGON = polygon(0.5 + 0.3 * np.array([(np.cos(a), np.sin(a)) for a in 2.0 * np.pi * np.arange(5) / 5]))
NOTCHED = PolyMesh.from_faces(  # a square, and beside it one with a straight corner
    [(0.1, 0.2), (0.5, 0.2), (0.5, 0.6), (0.1, 0.6), (0.7, 0.2), (0.9, 0.2), (0.9, 0.6)],
    [(0, 1, 2, 3), (1, 4, 5, 6, 2)],
)


@pytest.mark.parametrize(
    ("mesh", "convex", "quads"),
    [(SQUARE, [], []), (DART, [0], [0]), (PENTAGON, [], [0]), (NOTCHED, [1], [1])],
    ids=["square", "dart", "pentagon", "notched"],
)
def test_broken_faces__are_those_with_a_reflex_or_straight_corner_or_too_many(
    mesh: PolyMesh, convex: list[int], quads: list[int]
) -> None:
    assert [broken_faces(mesh, rule) for rule in FACE_RULES] == [[], convex, quads]
    assert [fits_rule(mesh.topology, rule) for rule in FACE_RULES] == [True, True, max(map(len, mesh.faces)) <= 4]


@pytest.mark.parametrize("sine", [0.9 * LEAST_TURN, 1.1 * LEAST_TURN])
def test_broken_faces__draw_the_line_at_the_least_turn(sine: float) -> None:
    """A corner between two edges of equal length stands off the line between its neighbours by half the turn."""
    height = 0.3 * np.tan(0.5 * np.arcsin(sine))
    bent = polygon(np.array([(0.2, 0.5), (0.5, 0.5 - height), (0.8, 0.5), (0.5, 0.9)]))
    assert (broken_faces(bent, "quads") == [0]) == (sine < LEAST_TURN)
    assert broken_faces(bent, "quads", ASKED_TURN) == [0]


def test_defects__count_faces_that_break_the_rule() -> None:
    assert [defects_of(DART, rule) for rule in FACE_RULES] == [(0, 0), (0, 1), (0, 1)]
    assert is_sane(PENTAGON, "convex") and not is_sane(PENTAGON, "quads")


@given(meshes())
@settings(max_examples=40)
def test_broken_faces__are_those_that_a_plain_reading_finds(mesh: PolyMesh) -> None:
    """The corners one by one, as angles, which is not how the kernel does it."""
    found = []
    for f, face in enumerate(mesh.faces):
        p = mesh.vertices[list(face)]
        into, out = p - np.roll(p, 1, axis=0), np.roll(p, -1, axis=0) - p
        turn = np.arctan2(out[:, 1], out[:, 0]) - np.arctan2(into[:, 1], into[:, 0])
        lengths = np.hypot(*into.T) * np.hypot(*out.T)
        if (np.where(lengths > 0.0, np.sin(turn), 0.0) < LEAST_TURN).any():
            found.append(f)
    assert broken_faces(mesh, "convex") == found
    assert set(broken_faces(mesh, "quads")) == {*found, *(f for f, face in enumerate(mesh.faces) if len(face) > 4)}


@pytest.mark.parametrize(
    ("mesh", "words"),
    [
        (DART, "face 0 of the mesh has a reflex corner at vertex 1; faces=quads allows convex ones"),
        (PENTAGON, "face 0 of the mesh has 5 corners; faces=quads allows 3 and 4: split it"),
        (SQUARE.with_vertices([(0.2, 0.2), (0.5, 0.5), (0.8, 0.8), (0.2, 0.8)]), "a straight corner at vertex 1"),
    ],
    ids=["reflex", "n-gon", "straight"],
)
def test_check_faces__names_the_face_and_what_is_wrong_with_it(mesh: PolyMesh, words: str) -> None:
    check_faces(mesh, "any", "the mesh")
    with pytest.raises(MeshError, match=words):
        check_faces(mesh, "quads", "the mesh")


def test_unknown_rule__is_refused() -> None:
    assert [face_rule(rule) for rule in FACE_RULES] == list(FACE_RULES)
    with pytest.raises(ConfigError, match="faces 'round': expected one of any, convex, quads"):
        face_rule("round")
