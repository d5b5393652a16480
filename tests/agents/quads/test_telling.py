"""Meshes of quads told as they are modelled: every face in its turn, nothing moved afterwards, nothing gone back to."""

import itertools
from collections import Counter

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from agents.quads.building import build
from agents.quads.partition import mesh_of, partitioned
from agents.quads.telling import order_of
from agents.trace.construct import UnbuildableError
from agents.trace.outline import Outline
from agents.trace.rings import Ring
from autopoly_env.mesh import PolyMesh, canonical_hash, is_sane, is_valid
from autopoly_env.simulator import Simulator
from tests.helpers.drawings import SQUARE, painted
from tests.helpers.rings import BOX, TRIANGLE, hole, random_rings, small

GAME = Simulator(painted(SQUARE), resolution=16, operators="modeller", faces="quads", max_steps=500)


def cut(*rings: Ring) -> PolyMesh:
    outline = Outline(rings)
    partition = partitioned(outline)
    assert partition is not None
    return mesh_of(outline, partition)


def kinds(mesh: PolyMesh) -> Counter[str]:
    return Counter(addition.kind for addition in order_of(mesh))


def assert_built(mesh: PolyMesh) -> list[str]:
    """The construction builds the mesh, step by step; the operators that it takes."""
    states = build(GAME, mesh)
    assert canonical_hash(states[-1].mesh) == canonical_hash(mesh)
    for before, after in itertools.pairwise(states):
        assert is_valid(after.mesh) and is_sane(after.mesh, "quads")
        stays = [name for name in before.mesh.vertex_ids if name in after.mesh.vertex_ids]
        places = [[m.vertices[m.vertex_index(name)].tolist() for name in stays] for m in (before.mesh, after.mesh)]
        assert places[0] == places[1]
    return [state.action.operator for state in states[1:] if state.action is not None]


def test_row_of_quads__is_extruded_from_its_largest() -> None:
    points = [(0.1, 0.4), (0.3, 0.4), (0.7, 0.3), (0.9, 0.4), (0.9, 0.6), (0.7, 0.7), (0.3, 0.6), (0.1, 0.6)]
    mesh = PolyMesh.from_faces(points, [(0, 1, 6, 7), (1, 2, 5, 6), (2, 3, 4, 5)])
    assert [addition.kind for addition in order_of(mesh)] == ["start", "extrude", "extrude"]
    assert next(order_of(mesh)).face == (1, 2, 5, 6)
    assert assert_built(mesh) == ["edge_extrude", "edge_extrude"]


def test_body__is_where_the_limbs_meet_unless_a_limb_is_much_larger() -> None:
    def cross(reach: float) -> PolyMesh:
        """A small square with arms to the left and right, and one upwards of that length."""
        points = [(0.45, 0.6), (0.55, 0.6), (0.55, 0.7), (0.45, 0.7), (0.2, 0.6), (0.2, 0.7), (0.8, 0.6), (0.8, 0.7)]
        points += [(0.45, 0.6 - reach), (0.55, 0.6 - reach)]
        return PolyMesh.from_faces(points, [(0, 1, 2, 3), (4, 0, 3, 5), (1, 6, 7, 2), (8, 9, 1, 0)])

    assert next(order_of(cross(0.26))).face == (0, 1, 2, 3)
    assert [addition.part for addition in order_of(cross(0.26))] == [0, 1, 2, 3]
    assert next(order_of(cross(0.59))).face == (8, 9, 1, 0)


def test_branches__that_grow_at_once_are_told_one_after_the_other() -> None:
    mesh = cut(Ring(BOX, -1), hole(small(BOX, 0.35, 0.5, 0.25)), hole(small(BOX, 0.65, 0.5, 0.25)))
    additions = list(order_of(mesh, deep=False))
    fresh = [addition.part for addition in additions if addition.kind in ("extrude", "cap")]
    assert fresh == sorted(fresh)
    assert len(set(fresh)) > 1


def test_ring__is_closed_by_a_fill() -> None:
    mesh = cut(Ring(BOX, -1), hole(small(BOX, 0.5, 0.5, 0.5)))
    assert kinds(mesh) == {"start": 1, "extrude": 2, "fill": 1}
    assert assert_built(mesh) == ["edge_extrude", "edge_extrude", "edge_fill"]


def test_branch__is_followed_to_its_end_before_the_next() -> None:
    def arm(x: float, y: float, dx: float, dy: float, n: int) -> list[tuple[float, float]]:
        return [(x + k * dx, y + k * dy) for k in range(1, n + 1)]

    left, right = arm(0.4, 0.4, -0.1, 0.0, 3), arm(0.6, 0.4, 0.1, 0.0, 3)
    low_left, low_right = arm(0.4, 0.6, -0.1, 0.0, 3), arm(0.6, 0.6, 0.1, 0.0, 3)
    points = [(0.4, 0.4), (0.6, 0.4), (0.6, 0.6), (0.4, 0.6), *left, *low_left, *right, *low_right]
    faces = [(0, 1, 2, 3)]
    for k in range(3):
        a, b = (0, 3) if k == 0 else (3 + k, 6 + k)
        faces.append((a, b, 7 + k, 4 + k))
        c, d = (1, 2) if k == 0 else (9 + k, 12 + k)
        faces.append((d, c, 10 + k, 13 + k))
    mesh = PolyMesh.from_faces(points, faces)
    parts = [addition.part for addition in order_of(mesh)]
    assert sorted(parts) == parts == [0, 1, 1, 1, 2, 2, 2]
    assert assert_built(mesh) == ["edge_extrude"] * 6


@pytest.mark.parametrize("second", [small(BOX, 0.8, 0.8), small(TRIANGLE, 0.8, 0.8)], ids=["quad", "triangle"])
def test_part_of_its_own__is_grown_and_cut_off(second: np.ndarray) -> None:
    mesh = cut(Ring(small(BOX, 0.3, 0.3, 0.6), -1), Ring(second, -1))
    taken = assert_built(mesh)
    assert taken[:3] == ["edge_extrude", "edge_extrude", "face_delete"]
    assert taken[3:] == ([] if len(second) == 4 else ["vertex_dissolve"])


@pytest.mark.slow
@settings(deadline=None, max_examples=60)
@given(st.integers(0, 2**32 - 1))
def test_any_cut__is_built_face_by_face(seed: int) -> None:
    rings = random_rings(seed)
    assume(partitioned(Outline(tuple(rings))) is not None)
    mesh = cut(*rings)
    try:
        taken = assert_built(mesh)
    except UnbuildableError:
        assume(False)
        return
    additions = list(order_of(mesh))
    assert sorted(map(sorted, (a.face for a in additions))) == sorted(map(sorted, mesh.faces))
    n_apart = sum(a.kind == "apart" for a in additions)
    assert taken.count("face_delete") == n_apart
    assert taken.count("vertex_merge") <= 2 * kinds(mesh)["weld"]
