"""The operators of the preset `modeller`: known effects on known meshes, and every refusal."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autopoly_env.errors import AutoPolyError, IllegalActionError
from autopoly_env.mesh import PolyMesh, canonical_hash, validate
from autopoly_env.operators import OPERATORS, ActionCodec
from tests.helpers.operating import apply, edge, grid, legal, quad, refusal, two_quads
from tests.helpers.strategies import random_walk


def test_edge_cap__stands_half_as_high_as_its_edge_is_long() -> None:
    mesh = apply("edge_cap", quad(), 0)
    assert mesh.faces == ((0, 1, 2, 3), (1, 0, 4))
    assert mesh.vertices[4].tolist() == [0.5, -0.5]
    assert mesh.face_areas().tolist() == [1.0, 0.25]
    assert "it lies between two faces; choose a boundary edge" in refusal("edge_cap", two_quads(), 3)
    assert legal("edge_cap", two_quads()) == [0, 1, 2, 4, 5, 6]


def test_edge_cap__keeps_clear_of_what_faces_it() -> None:
    slot = [(0, 0), (1, 0), (1, 0.5), (0.6, 0.5), (0.6, 0.2), (0.4, 0.2), (0.4, 0.5), (0, 0.5)]
    lid = [*slot, (0.45, 0.23), (0.55, 0.23), (0.5, 0.3)]  # an island whose lower side hangs 0.03 above the bottom
    mesh = PolyMesh.from_faces(lid, [range(8), (8, 9, 10)])
    made = apply("edge_cap", mesh, edge(mesh, 4, 5))  # 0.2 long: 0.1 and 0.05 meet the island, 0.025 does not
    assert made.vertices[11] == pytest.approx((0.5, 0.225))


def arms() -> PolyMesh:
    """A bar 0-1-2-3 below, a quad up from either end of it: 4-5 and 6-7 face each other across the gap."""
    corners = [(0, 1), (0.2, 0.8), (0.8, 0.8), (1, 1), (0, 0), (0.2, 0.2), (1, 0), (0.8, 0.2)]
    return PolyMesh.from_faces(corners, [(1, 2, 3, 0), (1, 0, 4, 5), (3, 2, 7, 6)])


def test_edge_fill__closes_a_ring_with_a_quad() -> None:
    mesh = arms()
    made = apply("edge_fill", mesh, edge(mesh, 4, 5), edge(mesh, 6, 7))
    assert made.faces[-1] == (5, 4, 6, 7)
    assert made.counts == (8, 12, 4)
    assert (made.topology.n_components, made.topology.n_holes) == (1, 1)
    assert canonical_hash(apply("edge_fill", mesh, edge(mesh, 6, 7), edge(mesh, 4, 5))) == canonical_hash(made)


def test_edge_fill__uses_sides_that_are_there() -> None:
    mesh = arms()
    one = apply("edge_fill", mesh, edge(mesh, 1, 5), edge(mesh, 2, 7))  # over the bar, which is its third side
    assert one.faces[-1] == (1, 5, 7, 2)
    assert one.counts == (8, 11, 4)
    hole = apply("face_delete", grid(), 4)
    two = apply("edge_fill", hole, edge(hole, 5, 6), edge(hole, 9, 10))
    assert two.counts == grid().counts
    assert canonical_hash(two) == canonical_hash(grid())


def test_edge_fill__makes_a_triangle_where_two_edges_share_a_corner() -> None:
    mesh = apply("face_delete", PolyMesh.grid(2, 0, 0, 1, 1), 0)
    corner = mesh.vertex_index(4)
    first, second = (edge(mesh, corner, mesh.vertex_index(v)) for v in (1, 3))
    made = apply("edge_fill", mesh, first)
    assert {made.vertex_ids[v] for v in made.faces[-1]} == {1, 3, 4}
    assert np.subtract(made.counts, mesh.counts).tolist() == [0, 1, 1]
    assert made.face_areas()[-1] == 0.125
    assert OPERATORS["edge_fill"].choose(mesh, first) == second


def test_edge_fill__closes_a_gap_between_three_parts_that_touch_in_corners() -> None:
    corners = [(0.4, 0.4), (0.6, 0.4), (0.5, 0.6), (0.5, 0.2), (0.8, 0.6), (0.2, 0.6)]
    mesh = PolyMesh.from_faces(corners, [(1, 0, 3), (2, 1, 4), (0, 2, 5)])  # each all boundary, three sides of it
    rim = [edge(mesh, *e) for e in ((0, 1), (1, 2), (0, 2))]
    assert set(rim) <= set(legal("edge_fill", mesh))
    for first in rim:
        made = apply("edge_fill", mesh, first)
        assert made.counts == (6, 9, 4) and set(made.faces[-1]) == {0, 1, 2}


def test_edge_fill__prefers_the_narrowest_gap() -> None:
    left, near, far = (PolyMesh.rectangle(x, 0, x + 0.1, 0.5).vertices for x in (0.0, 0.2, 0.5))
    mesh = PolyMesh.from_faces(np.vstack((left, near, far)), [(0, 1, 2, 3), (4, 5, 6, 7), (8, 9, 10, 11)])
    assert OPERATORS["edge_fill"].choose(mesh, edge(mesh, 1, 2)) == edge(mesh, 4, 7)
    assert OPERATORS["edge_fill"].choose(mesh, edge(mesh, 5, 6)) == edge(mesh, 8, 11)
    assert legal("edge_fill", mesh) == sorted(edge(mesh, *e) for e in ((1, 2), (4, 7), (5, 6), (8, 11)))
    apply("edge_fill", mesh, edge(mesh, 1, 2), edge(mesh, 8, 11))  # over the one between: asked for, so done


def test_edge_fill__refuses_what_makes_no_mesh() -> None:
    mesh = two_quads()
    assert "it lies between two faces" in refusal("edge_fill", mesh, 3)
    assert "no convex face joins it" in refusal("edge_fill", mesh, 0)
    assert legal("edge_fill", mesh) == []
    first = edge(mesh, 0, 1)
    for other in (first, edge(mesh, 1, 4)):
        assert "is not another boundary edge" in refusal("edge_fill", mesh, first, other)
    for other in (-1, 7, "6"):
        assert "is no edge" in refusal("edge_fill", mesh, first, other)
    assert "has two faces already" in refusal("edge_fill", mesh, first, edge(mesh, 3, 4))  # 1-4 has
    assert "no boundary would be left" in refusal("edge_fill", quad(), 0, edge(quad(), 2, 3))
    pinched = PolyMesh.from_faces([(0, 0), (1, 0), (0, 1), (-1, 0), (0, -1)], [(0, 1, 2), (0, 3, 4)])
    ways = [pinched.edge_index(0, v) for v in (1, 3)]  # both run from the pinch
    assert "runs from or to the same vertex" in refusal("edge_fill", pinched, *ways)


def bent() -> PolyMesh:
    """Three quads around a missing one: 2 and 6 are the ends of the corner at 4."""
    return apply("face_delete", PolyMesh.grid(2, 0.0, 0.0, 1.0, 1.0), 3)


def test_vertex_merge__closes_a_corner_where_the_other_vertex_is() -> None:
    mesh = bent()
    assert mesh.vertex_ids == (0, 1, 2, 3, 4, 5, 6, 7)
    made = apply("vertex_merge", mesh, 5, 7)
    assert made.vertex_ids == (0, 1, 2, 3, 4, 6, 7)
    assert made.counts == (7, 9, 3)
    assert [[made.vertex_ids[v] for v in face] for face in made.faces] == [[0, 1, 4, 3], [1, 2, 7, 4], [3, 4, 7, 6]]
    assert made.vertices[6].tolist() == mesh.vertices[7].tolist()
    assert OPERATORS["vertex_merge"].choose(mesh, 5) == 7
    assert OPERATORS["vertex_merge"].choose(mesh, 7) == 5
    assert legal("vertex_merge", mesh) == [5, 7]


def test_vertex_merge__closes_a_hole_of_four_corners_to_two_edges() -> None:
    mesh = apply("face_delete", grid(), 4)
    made = apply("vertex_merge", mesh, 5, 10)
    assert np.subtract(made.counts, mesh.counts).tolist() == [-1, -2, 0]
    assert (made.topology.n_holes, made.topology.is_boundary_vertex.sum()) == (0, 12)


def test_vertex_merge__refuses_what_makes_no_mesh() -> None:
    mesh = bent()
    for other in (5, 4, 2):
        assert "is a corner of the same face" in refusal("vertex_merge", mesh, 5, other)
    assert "they would only touch" in refusal("vertex_merge", mesh, 0, 7)
    assert "of more than two faces" in refusal("vertex_merge", grid(), 1, 9)
    assert "no missing corner lies between" in refusal("vertex_merge", mesh, 0)
    for other in (-1, 8, "6"):
        assert "is no vertex" in refusal("vertex_merge", mesh, 5, other)


def test_vertex_merge__leaves_some_boundary() -> None:
    corners = [(0, 0), (1, 0), (1, 1), (0, 1), (0.3, 0.3), (0.7, 0.3), (0.7, 0.7), (0.3, 0.7)]
    inset = PolyMesh.from_faces(corners, [(k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k) for k in range(4)] + [(4, 5, 6, 7)])
    assert "no boundary would be left" in refusal("vertex_merge", inset, 0, 2)


def ring() -> PolyMesh:
    """Eight quads around a hole."""
    return apply("face_delete", grid(), 4)


def test_loop_cut__runs_through_a_strip_from_rim_to_rim() -> None:
    mesh = grid()
    made = apply("loop_cut", mesh, edge(mesh, 5, 9), 0.25)  # upright: the strip is the middle row
    assert np.subtract(made.counts, mesh.counts).tolist() == [4, 7, 3]
    assert made.vertices[16:] == pytest.approx(np.array([(x / 3, 1.25 / 3) for x in range(4)]))
    assert made.face_ids == (*range(9), 9, 10, 11)
    assert made.faces[3] == (4, 5, 17, 16)  # with its first corner
    assert made.faces[9] == (17, 9, 8, 16)
    same = apply("loop_cut", mesh, edge(mesh, 7, 11), 0.25)
    assert canonical_hash(same) == canonical_hash(made)


@pytest.mark.parametrize("k", [1, 2, 5])
def test_loop_cut__of_k_quads_adds_what_the_strip_has(k: int) -> None:
    row = PolyMesh.from_faces(
        [(x, y) for y in (0, 1) for x in range(k + 1)], [(i, i + 1, i + k + 2, i + k + 1) for i in range(k)]
    )
    made = apply("loop_cut", row, edge(row, 0, k + 1))
    assert np.subtract(made.counts, row.counts).tolist() == [k + 1, 2 * k + 1, k]
    assert made.vertices[2 * k + 2 :].tolist() == [[x, 0.5] for x in range(k + 1)]


def test_loop_cut__goes_all_around_a_ring() -> None:
    corners = [(0, 0), (3, 0), (3, 3), (0, 3), (1, 1), (2, 1), (2, 2), (1, 2)]
    mesh = PolyMesh.from_faces(corners, [(k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k) for k in range(4)])
    made = apply("loop_cut", mesh, edge(mesh, 2, 6), 0.5)
    assert np.subtract(made.counts, mesh.counts).tolist() == [4, 8, 4]
    assert sorted(made.vertices[8:].tolist()) == [[0.5, 0.5], [0.5, 2.5], [2.5, 0.5], [2.5, 2.5]]
    assert (made.topology.n_holes, made.topology.n_components) == (1, 1)


def test_loop_cut__ends_at_a_face_that_is_no_quad() -> None:
    mesh = PolyMesh.from_faces([(0, 0), (1, 0), (1, 1), (0, 1), (2, 0.5)], [(0, 1, 2, 3), (1, 4, 2)])
    made = apply("loop_cut", mesh, edge(mesh, 0, 3))
    assert made.counts == (7, 9, 3)
    assert made.faces[1] == (1, 4, 2, 6)


def test_loop_cut__refuses_what_is_no_strip() -> None:
    triangle = PolyMesh.from_faces([(0, 0), (1, 0), (0, 1)], [range(3)])
    assert "no quad lies beside it" in refusal("loop_cut", triangle, 0)
    assert legal("loop_cut", triangle) == []
    for slide in (0.0, 1.0, -0.5, float("nan"), "half"):
        assert "is no slide; give a number between 0 and 1" in refusal("loop_cut", quad(), 0, slide)
    corners = [(0, 0), (3, 0), (3, 3), (0, 3), (1, 1), (2, 1), (2, 2), (1, 2)]
    mesh = PolyMesh.from_faces(corners, [(k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k) for k in range(4)])
    pentagon = apply("edge_subdivide", mesh, edge(mesh, 0, 1))  # instead of a quad of the ring
    assert "both ends of its strip lie on one face" in refusal("loop_cut", pentagon, edge(pentagon, 2, 6))
    corners = [(0.2, 0.2), (0.7, 0.2), (0.7, 0.7), (0.2, 0.7), (0.9, 0.2), (0.9, 0.7), (0.5, 1), (0.9, 0.8)]
    curl = PolyMesh.from_faces(
        corners, [(0, 1, 2, 3), (2, 1, 4, 5), (7, 5, 4, 6), (2, 5, 7, 6)]
    )  # back to 2-5 of 2-1-4-5
    assert "its strip of quads crosses itself" in refusal("loop_cut", curl, edge(curl, 0, 3))


def test_face_inset__puts_a_ring_around_the_middle() -> None:
    made = apply("face_inset", quad(), 0)
    assert made.counts == (8, 12, 5)
    assert made.faces == ((4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
    assert made.vertices[4:].tolist() == [[0.25, 0.25], [0.75, 0.25], [0.75, 0.75], [0.25, 0.75]]
    hole = apply("face_delete", made, 0)
    assert np.subtract(hole.counts, quad().counts).tolist() == [4, 8, 3]
    assert hole.topology.n_holes == 1


def test_face_inset__refuses_a_face_that_is_not_convex() -> None:
    dart = PolyMesh.from_faces([(0, 0), (1, 0.5), (0, 1), (0.25, 0.5)], [range(4)])
    star = PolyMesh.from_faces([(0.5, 0), (0.8, 1), (0, 0.4), (1, 0.4), (0.2, 1)], [range(5)])  # turns twice
    tiny = PolyMesh.rectangle(0, 0, 0.001, 0.001)
    for mesh in (dart, star, tiny):
        assert legal("face_inset", mesh) == []
        assert "not convex or has no room" in refusal("face_inset", mesh, 0)


def test_edge_fill__joins_two_parts() -> None:
    corners = [(0, 0), (1, 0), (1, 1), (0, 1), (2, 0), (3, 0.5), (2, 1)]
    mesh = PolyMesh.from_faces(corners, [(0, 1, 2, 3), (4, 5, 6)])
    made = apply("edge_fill", mesh, edge(mesh, 1, 2), edge(mesh, 4, 6))
    assert made.counts == (7, 9, 3)
    assert made.topology.n_components == 1


def test_edge_fill__makes_no_handle() -> None:
    """The outer rim of a ring and the rim of its hole are never joined, for no mesh in the plane has a handle."""
    mesh = ring()
    assert "it would join two boundaries" in refusal("edge_fill", mesh, edge(mesh, 0, 1), edge(mesh, 9, 10))


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.integers(1, 25), st.sampled_from((0.0, 0.02)), st.data())
def test_any_choice__makes_a_true_mesh_or_is_refused_in_a_line(
    seed: int, n_steps: int, shake: float, data: st.DataObject
) -> None:
    mesh = random_walk(seed, "modeller", n_steps, shake)[-1].after
    rim = np.flatnonzero(mesh.topology.is_boundary_edge).tolist()
    ends = np.flatnonzero(mesh.topology.is_boundary_vertex).tolist()
    for name, some in (("edge_fill", rim), ("vertex_merge", ends)):
        element = data.draw(st.sampled_from(some))
        for choice in some:
            try:
                made = OPERATORS[name].apply(mesh, element, choice)
            except IllegalActionError as error:
                assert str(error).startswith(f"{name} cannot work on ") and "\n" not in str(error)
                continue
            validate(made)
            n_vertices, n_edges, n_faces = made.counts
            assert n_vertices - n_edges + n_faces == made.topology.n_components - made.topology.n_holes
            assert made.topology.is_boundary_edge.any()


@pytest.mark.parametrize(
    ("name", "element", "ids", "reason"),
    [
        ("edge_fill", 0, {"to": 3}, "expected the ends of the edge to fill to"),
        ("edge_fill", 0, {"to": [2, 3], "at": 1}, "expected the ends of the edge to fill to"),
        ("edge_fill", 0, {"to": [0, 2]}, "no edge joins vertices 0 and 2"),
        ("edge_fill", 0, {"to": [0, 9]}, "vertex id 9 is not in this mesh"),
        ("vertex_merge", 0, {"to": [2]}, "expected the vertex to merge with"),
        ("vertex_merge", 0, {"to": True}, "expected the vertex to merge with"),
        ("vertex_merge", 0, {"to": 9}, "vertex id 9 is not in this mesh"),
        ("loop_cut", 0, {"slide": 0.5}, "expected an end of the edge and how far from it"),
        ("loop_cut", 0, {"from": 2, "slide": 0.5}, "expected an end of the edge and how far from it"),
        ("loop_cut", 0, {"from": 0, "slide": "0.5"}, "expected an end of the edge and how far from it"),
    ],
)
def test_choice_in_a_file__that_is_none_is_told(name: str, element: int, ids: dict[str, Any], reason: str) -> None:
    codec = OPERATORS[name].choice
    assert codec is not None
    with pytest.raises(AutoPolyError, match=reason):
        codec.indices(quad(), element, ids)


def test_slide_in_a_file__counts_from_either_end() -> None:
    codec = OPERATORS["loop_cut"].choice
    assert codec is not None
    assert codec.indices(quad(), 0, {"from": 0, "slide": 0.25}) == 0.25
    assert codec.indices(quad(), 0, {"from": 1, "slide": 0.25}) == 0.75
    assert codec.ids(quad(), 0, 0.75) == {"from": 0, "slide": 0.75}


def test_action_mask__knows_how_much_a_loop_and_an_inset_add() -> None:
    mesh = PolyMesh.grid(2, 0.0, 0.0, 1.0, 1.0)  # 9 vertices; a loop adds 3, an inset 4
    for room, loops, insets in ((11, 0, 0), (12, 12, 0), (13, 12, 4)):
        codec = ActionCodec(("loop_cut", "face_inset"), room)
        mask = codec.legal_mask(mesh)
        assert [mask[codec.indices_of(name)].sum() for name in codec.operators] == [loops, insets]
