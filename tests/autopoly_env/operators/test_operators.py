"""The operators: known effects on known meshes, every refusal, and what no walk may break."""

from collections import Counter
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, given, settings

from autopoly_env.errors import ConfigError
from autopoly_env.mesh import Face, PolyMesh, canonical_hash, validate
from autopoly_env.operators import OPERATORS, PRESETS, HoleChoice, plan_hole, preset, register
from tests.helpers.operating import apply, edge, grid, legal, quad, refusal, two_quads
from tests.helpers.strategies import Transition, walks

L_CORNERS = [(0, 0), (0.5, 0), (0.5, 0.25), (0.25, 0.25), (0.25, 0.5), (0, 0.5)]  # 3 is the reflex one


def l_shape() -> PolyMesh:
    return PolyMesh.from_faces(L_CORNERS, [range(6)])


def holed_quad() -> PolyMesh:
    return apply("face_hole", quad(), 1, SQUARE_HOLE)


SQUARE_HOLE = HoleChoice(((0.4, 0.4), (0.6, 0.4), (0.6, 0.6), (0.4, 0.6)), ((0, 0), (2, 2)))


@pytest.mark.parametrize(
    ("name", "mesh", "element", "counts"),
    [
        ("edge_subdivide", quad(), 0, (5, 5, 1)),
        ("edge_subdivide", two_quads(), 3, (7, 8, 2)),
        ("edge_subdivide", grid(), 5, (17, 25, 9)),
        ("edge_extrude", quad(), 0, (6, 7, 2)),
        ("edge_extrude", two_quads(), 0, (8, 10, 3)),
        ("edge_extrude", grid(), 0, (18, 27, 10)),
        ("face_split", quad(), 0, (4, 5, 2)),
        ("face_split", two_quads(), 0, (6, 8, 3)),
        ("face_split", grid(), 0, (16, 25, 10)),
        ("face_delete", two_quads(), 0, (4, 4, 1)),
        ("face_delete", grid(), 4, (16, 24, 8)),
        ("face_delete", grid(), 0, (15, 22, 8)),
        ("face_delete", grid(), 1, (16, 23, 8)),
        ("face_hole", quad(), 0, (7, 9, 2)),
        ("face_hole", quad(), 1, (8, 10, 2)),
        ("face_hole", grid(), 8, (19, 29, 10)),
        ("vertex_dissolve", quad(), 0, (3, 3, 1)),
        ("vertex_dissolve", two_quads(), 0, (5, 6, 2)),
        ("vertex_dissolve", grid(), 0, (15, 23, 9)),
        ("edge_dissolve", two_quads(), 3, (6, 6, 1)),
        ("edge_dissolve", grid(), 3, (16, 23, 8)),
        ("edge_cap", quad(), 0, (5, 6, 2)),
        ("edge_cap", two_quads(), 0, (7, 9, 3)),
        ("edge_cap", grid(), 0, (17, 26, 10)),
    ],
)
def test_operator__has_its_effect_on_v_e_f(
    name: str, mesh: PolyMesh, element: int, counts: tuple[int, int, int]
) -> None:
    assert apply(name, mesh, element).counts == counts


def test_edge_subdivide__puts_the_middle_into_both_faces() -> None:
    mesh = apply("edge_subdivide", two_quads(), 3)
    assert mesh.vertices[6].tolist() == [0.5, 0.25]
    assert mesh.faces == ((0, 1, 6, 4, 3), (1, 2, 5, 4, 6))
    assert mesh.vertex_ids == (0, 1, 2, 3, 4, 5, 6)
    assert mesh.next_vertex_id == 7


def test_edge_subdivide__is_legal_on_every_edge() -> None:
    assert legal("edge_subdivide", grid()) == list(range(24))


def test_edge_extrude__stands_a_quarter_off_and_winds_as_its_neighbour() -> None:
    mesh = apply("edge_extrude", quad(), 0)
    assert mesh.faces == ((0, 1, 2, 3), (1, 0, 4, 5))
    assert mesh.vertices[4:].tolist() == [[0.0, -0.25], [1.0, -0.25]]
    assert mesh.face_areas().tolist() == [1.0, 0.25]
    assert mesh.face_ids == (0, 1)


def test_edge_extrude__refuses_an_interior_edge() -> None:
    assert "it lies between two faces; choose a boundary edge" in refusal("edge_extrude", two_quads(), 3)
    assert legal("edge_extrude", two_quads()) == [0, 1, 2, 4, 5, 6]


def test_edge_extrude__halves_its_offset_until_it_meets_nothing() -> None:
    facing = [(0, 0), (1, 0), (1, 1), (0, 1), (0, 0.7), (0.9, 0.7), (0.8, 0.1), (0, 0.6)]  # a wedge, open to the left
    mesh = PolyMesh.from_faces(facing, [range(8)])
    made = apply("edge_extrude", mesh, edge(mesh, 0, 7))  # 0.6 long, the left side: nothing in its way
    assert made.vertices[8:] == pytest.approx(np.array([(-0.15, 0.6), (-0.15, 0.0)]))
    slot = [(0, 0), (1, 0), (1, 0.5), (0.6, 0.5), (0.54, 0.2), (0.46, 0.2), (0.4, 0.5), (0, 0.5)]
    mesh = PolyMesh.from_faces(slot, [range(8)])
    made = apply("edge_extrude", mesh, edge(mesh, 4, 5))  # the bottom of a slot that widens upwards
    assert made.vertices[8:] == pytest.approx(np.array([(0.54, 0.22), (0.46, 0.22)]))
    lid = [*slot, (0.45, 0.21), (0.55, 0.21), (0.5, 0.3)]  # an island whose lower side hangs 0.01 above that bottom
    mesh = PolyMesh.from_faces(lid, [range(8), (8, 9, 10)])
    made = apply("edge_extrude", mesh, edge(mesh, 4, 5))  # 0.02 and 0.01 meet it, 0.005 does not
    assert made.vertices[11:] == pytest.approx(np.array([(0.54, 0.205), (0.46, 0.205)]))


def test_edge_extrude__narrows_in_a_right_angle() -> None:
    mesh = l_shape()
    made = apply("edge_extrude", mesh, edge(mesh, 2, 3))  # from (0.5, 0.25) to (0.25, 0.25), up along edge 3-4
    assert made.faces[1] == (3, 2, 6, 7)
    assert made.vertices[6:].tolist() == [[0.4375, 0.3125], [0.3125, 0.3125]]


def test_edge_extrude__fits_into_a_sharp_notch() -> None:
    notched = [(0, 0.5), (0, 0.25), (0.5, 0.3), (0, 0.2), (0, 0.1), (1, 0.1), (1, 0.5)]  # 6 degrees wide at (0.5, 0.3)
    mesh = PolyMesh.from_faces(notched, [range(7)])
    for element in legal("edge_extrude", mesh):
        made = apply("edge_extrude", mesh, element)
        old, new = (shapely.Polygon(made.vertices[list(face)]) for face in made.faces)
        assert new.exterior.is_ccw
        assert new.area > 1e-4
        assert new.intersection(old).area < 1e-15


def test_face_split__default_halves_the_area() -> None:
    mesh = apply("face_split", quad(), 1)
    assert mesh.faces == ((0, 1, 3), (1, 2, 3))
    assert mesh.face_ids == (0, 1)


def test_face_split__keeps_the_id_with_the_last_half_edge() -> None:
    mesh = PolyMesh.from_faces([(0, 0), (1, 0), (2, 1), (1, 2), (0, 2), (-1, 1)], [range(6)])
    made = apply("face_split", mesh, 4, 1)
    assert made.faces == ((0, 1, 4, 5), (1, 2, 3, 4))
    assert made.face_ids == (0, 1)
    assert apply("face_split", mesh, 1, 4).faces == made.faces


@pytest.mark.parametrize(
    ("corner", "targets", "default"), [(0, [2, 3, 4], 3), (1, [3], 3), (2, [0], 0), (3, [0, 1, 5], 0), (5, [3], 3)]
)
def test_face_split__of_an_l_shape_takes_diagonals_inside_it_only(
    corner: int, targets: list[int], default: int
) -> None:
    mesh = l_shape()
    assert OPERATORS["face_split"].choose(mesh, corner) == default
    for other in range(6):
        if other in targets:
            assert apply("face_split", mesh, corner, other).face_areas().sum() == pytest.approx(0.1875)
        else:
            assert "no free diagonal" in refusal("face_split", mesh, corner, other)


def test_face_split__knows_the_corners_of_a_dart_that_see_nothing() -> None:
    dart = PolyMesh.from_faces([(0, 0), (1, 0.5), (0, 1), (0.25, 0.5)], [range(4)])
    assert legal("face_split", dart) == [1, 3]
    assert "no diagonal from it runs inside its face" in refusal("face_split", dart, 0)


def test_face_split__refuses_a_triangle() -> None:
    mesh = PolyMesh.from_faces([(0, 0), (1, 0), (0, 1)], [range(3)])
    assert legal("face_split", mesh) == []
    refusal("face_split", mesh, 0)


def test_face_split__refuses_to_run_along_a_subdivided_edge() -> None:
    tilted = PolyMesh.from_faces([(0.1, 0.2), (0.8, 0.33), (0.7, 0.9), (0.2, 0.8)], [range(4)])
    mesh = apply("edge_subdivide", tilted, 0)
    assert mesh.faces == ((0, 4, 1, 2, 3),)
    assert "no free diagonal" in refusal("face_split", mesh, 0, 2)
    flat = PolyMesh.from_faces([(0, 0), (0.5, 0), (1, 0), (0, 1)], [range(4)])
    assert legal("face_split", flat) == [1, 3]


def test_face_split__refuses_a_second_edge_between_two_vertices() -> None:
    mesh = PolyMesh.from_faces([(0, 0), (1, 0), (1, 1), (0, 1), (0.1, 0.1)], [(0, 1, 2, 3), (2, 0, 4)])
    assert legal("face_split", mesh) == [1, 3]
    assert "no free diagonal" in refusal("face_split", mesh, 0, 2)


def test_face_split__refuses_corners_of_other_faces() -> None:
    assert "no free diagonal" in refusal("face_split", two_quads(), 0, 6)
    assert "is no corner" in refusal("face_split", two_quads(), 0, SQUARE_HOLE)


def test_flipped_face__has_neither_diagonals_nor_room() -> None:
    mesh = PolyMesh.from_faces(quad().vertices, [(3, 2, 1, 0)])
    assert legal("face_split", mesh) == []
    assert legal("face_hole", mesh) == []


def test_face_delete__takes_loose_vertices_and_edges_with_it() -> None:
    mesh = apply("face_delete", grid(), 0)
    assert mesh.vertex_ids == tuple(range(1, 16))
    assert mesh.face_ids == tuple(range(1, 9))
    assert mesh.vertices.tolist() == grid().vertices[1:].tolist()
    assert (mesh.next_vertex_id, mesh.next_face_id) == (16, 9)


def test_face_delete__can_leave_a_hole_or_two_parts() -> None:
    assert apply("face_delete", grid(), 4).topology.n_holes == 1
    row = PolyMesh.from_faces([(x, y) for y in (0, 1) for x in range(4)], [(i, i + 1, i + 5, i + 4) for i in range(3)])
    assert apply("face_delete", row, 1).topology.n_components == 2


def test_face_delete__refuses_the_only_face() -> None:
    assert "it is the only face" in refusal("face_delete", quad(), 0)
    assert legal("face_delete", quad()) == []


def test_face_hole__cuts_the_ring_between_outline_and_hole_in_two() -> None:
    mesh = holed_quad()
    assert mesh.faces == ((0, 4, 7, 6, 2, 3), (0, 1, 2, 6, 5, 4))
    assert mesh.face_areas() == pytest.approx([0.48, 0.48])
    assert mesh.face_ids == (0, 1)
    assert mesh.vertices[4:].tolist() == [list(point) for point in SQUARE_HOLE.points]
    assert (mesh.topology.n_components, mesh.topology.n_holes) == (1, 1)


@pytest.mark.parametrize("n_sides", [3, 4])
def test_face_hole__default_lies_about_the_widest_place(n_sides: int) -> None:
    mesh = l_shape()
    choice = OPERATORS["face_hole"].choose(mesh, n_sides - 3)
    assert isinstance(choice, HoleChoice)
    hole, face = shapely.Polygon(choice.points), shapely.Polygon(L_CORNERS)
    assert len(choice.points) == n_sides
    assert shapely.is_ccw(hole.exterior)
    assert face.contains_properly(hole)
    made = apply("face_hole", mesh, n_sides - 3, choice)
    parts = [shapely.Polygon(made.vertices[list(f)]) for f in made.faces]
    assert all(part.is_valid and part.exterior.is_ccw for part in parts)
    assert shapely.equals(shapely.union_all(parts).normalize(), face.difference(hole).normalize())


@pytest.mark.parametrize(
    ("points", "bridges", "reason"),
    [
        (SQUARE_HOLE.points[::-1], ((0, 0), (2, 2)), "not a simple, positively wound ring inside"),
        (((0.4, 0.4), (0.6, 0.6), (0.6, 0.4), (0.4, 0.6)), ((0, 0), (2, 2)), "not a simple"),
        (((0.4, 0.4), (1.2, 0.4), (1.2, 0.6), (0.4, 0.6)), ((0, 0), (2, 2)), "ring inside"),
        (((1.4, 0.4), (1.6, 0.4), (1.6, 0.6), (1.4, 0.6)), ((0, 0), (2, 2)), "ring inside"),
        (((0.0, 0.4), (0.6, 0.4), (0.6, 0.6), (0.4, 0.6)), ((0, 0), (2, 2)), "ring inside"),
        (((float("nan"), 0.4), (0.6, 0.4), (0.6, 0.6), (0.4, 0.6)), ((0, 0), (2, 2)), "ring inside"),
        (SQUARE_HOLE.points[:3], ((0, 0), (2, 2)), "is no hole of 4 corners"),
        (SQUARE_HOLE.points, ((0, 0), (2, 0)), "share a corner"),
        (SQUARE_HOLE.points, ((0, 0), (0, 2)), "share a corner"),
        (SQUARE_HOLE.points, ((0, 0), (4, 2)), "a corner that does not exist"),
        (SQUARE_HOLE.points, ((0, 0), (2, -1)), "a corner that does not exist"),
        (SQUARE_HOLE.points, ((0, 2), (2, 0)), "touches the outline or the hole"),
        (SQUARE_HOLE.points, ((0, 1), (1, 0)), "its two bridges cross"),
    ],
)
def test_face_hole__refuses_what_does_not_fit(points: tuple, bridges: tuple, reason: str) -> None:
    assert reason in refusal("face_hole", quad(), 1, HoleChoice(points, bridges))


def test_face_hole__refuses_a_face_that_crosses_itself_or_is_tiny() -> None:
    bow_tie = PolyMesh.from_faces([(0, 0), (1, 1), (1, 0), (0, 2)], [range(4)])
    tiny = PolyMesh.rectangle(0, 0, 0.001, 0.001)
    for mesh in (bow_tie, tiny):
        assert legal("face_hole", mesh) == []
        assert "crosses itself or has no room" in refusal("face_hole", mesh, 0)


def test_plan_hole__bridges_to_opposite_corners() -> None:
    choice = plan_hole(quad(), 0, SQUARE_HOLE.points)
    assert choice is not None
    assert choice.points == SQUARE_HOLE.points
    assert choice.bridges in (((0, 0), (2, 2)), ((1, 1), (3, 3)))


def test_plan_hole__goes_round_obstacles() -> None:
    square = np.array([(0, 0), (0.1, 0), (0.1, 0.1), (0, 0.1)])
    first, second = square + (0.1, 0.45), square + (0.4, 0.45)
    walls = shapely.Polygon(second)
    mesh, face = quad(), 0
    free, careful = plan_hole(mesh, face, first), plan_hole(mesh, face, first, [second, second + (0.3, 0)])
    assert free is not None
    assert careful is not None
    for f, h in careful.bridges:
        assert not shapely.LineString([mesh.vertices[f], first[h]]).intersects(walls)
    made = apply("face_hole", mesh, 1, careful)
    inside = [f for f in (0, 1) if shapely.Polygon(made.vertices[list(made.faces[f])]).contains(walls)]
    assert len(inside) == 1
    again = plan_hole(made, inside[0], second)
    assert again is not None
    assert apply("face_hole", made, 2 * inside[0] + 1, again).topology.n_holes == 2


def test_plan_hole__finds_none_where_there_is_no_way() -> None:
    fence = [(0.3, 0.3), (0.7, 0.3), (0.7, 0.7), (0.3, 0.7)]
    assert plan_hole(quad(), 0, SQUARE_HOLE.points, [fence]) is None
    assert plan_hole(quad(), 0, SQUARE_HOLE.points[::-1]) is None
    assert plan_hole(quad(), 0, np.array(SQUARE_HOLE.points) + 0.5) is None


def test_vertex_dissolve__joins_the_two_edges() -> None:
    mesh = apply("vertex_dissolve", two_quads(), 0)
    assert mesh.faces == ((0, 3, 2), (0, 1, 4, 3))
    assert mesh.vertex_ids == (1, 2, 3, 4, 5)
    assert mesh.face_ids == (0, 1)


def test_vertex_dissolve__refuses_a_triangle_a_junction_and_the_inside() -> None:
    triangle = PolyMesh.from_faces([(0, 0), (1, 0), (0, 1)], [range(3)])
    assert "a triangle" in refusal("vertex_dissolve", triangle, 0)
    assert "valence 2" in refusal("vertex_dissolve", two_quads(), 1)
    assert "valence 2" in refusal("vertex_dissolve", grid(), 5)
    assert legal("vertex_dissolve", grid()) == [0, 3, 12, 15]


def test_vertex_dissolve__refuses_a_pinch() -> None:
    corners = PolyMesh.grid(2, 0, 0, 1, 1)
    pinch = apply("face_delete", apply("face_delete", corners, 1), 1)
    assert pinch.counts == (7, 8, 2)
    assert legal("vertex_dissolve", pinch) == [v for v in range(7) if pinch.vertex_ids[v] != 4]


def test_vertex_dissolve__refuses_a_second_edge_between_two_vertices() -> None:
    mesh = PolyMesh.from_faces([(0, 0), (1, 0), (1, 1), (0, 1), (2, 2)], [(0, 1, 2, 3), (3, 1, 4)])
    assert "joined by an edge already" in refusal("vertex_dissolve", mesh, 0)
    assert legal("vertex_dissolve", mesh) == []


def test_edge_dissolve__makes_one_face_that_keeps_the_lower_id() -> None:
    mesh = apply("edge_dissolve", two_quads(), 3)
    assert mesh.faces == ((0, 1, 2, 5, 4, 3),)
    assert mesh.face_ids == (0,)
    assert mesh.next_face_id == 2


def test_edge_dissolve__undoes_a_split() -> None:
    mesh = apply("face_split", quad(), 0)
    assert canonical_hash(apply("edge_dissolve", mesh, edge(mesh, 0, 2))) == canonical_hash(quad())


def test_edge_dissolve__refuses_the_boundary_and_faces_that_share_more() -> None:
    assert "one face only" in refusal("edge_dissolve", two_quads(), 0)
    mesh = holed_quad()
    assert legal("edge_dissolve", mesh) == []
    assert "share more than this edge" in refusal("edge_dissolve", mesh, edge(mesh, 0, 4))
    bent = apply("edge_subdivide", two_quads(), 3)
    assert "share more than this edge" in refusal("edge_dissolve", bent, edge(bent, 1, 6))


@pytest.mark.parametrize("name", OPERATORS)
def test_operator__refuses_elements_that_are_not_there(name: str) -> None:
    n = OPERATORS[name].element.count(grid())
    assert f"the mesh has {n}; give 0..{n - 1}" in refusal(name, grid(), n)
    refusal(name, grid(), -1)


def test_preset__takes_a_name_or_a_list() -> None:
    assert [operator.name for operator in preset("paper")] == [
        "edge_subdivide", "edge_extrude", "face_split", "face_delete",
    ]  # fmt: skip
    assert preset("full") == tuple(OPERATORS.values())[:7] == PRESETS["full"]
    assert [operator.name for operator in preset("modeller")] == [
        "edge_extrude", "edge_cap", "edge_fill", "vertex_merge", "loop_cut", "face_inset",
        "face_delete", "vertex_dissolve", "edge_dissolve",
    ]  # fmt: skip
    assert preset("face_hole, edge_extrude") == (OPERATORS["face_hole"], OPERATORS["edge_extrude"])
    assert preset(["paper", OPERATORS["face_hole"]]) == (*PRESETS["paper"], OPERATORS["face_hole"])
    for wrong in ("papers", "", "edge_extrude,"):
        with pytest.raises(ConfigError, match="give some of paper, full"):
            preset(wrong)
    for wrong in ("edge_extrude,edge_extrude", "full,edge_extrude"):
        with pytest.raises(ConfigError, match="edge_extrude stands there twice"):
            preset(wrong)
    for wrong, said in {
        "no.such.module:edge_cut": "there is no module no;",
        "autopoly_env.errors:edge_cut": "autopoly_env.errors has no attribute edge_cut",
        "autopoly_env.errors:MeshError": "expected an autopoly_env.operators.Operator",
        ":": "such as my.module:name",
    }.items():
        with pytest.raises(ConfigError, match=said):
            preset(wrong)


def test_register__refuses_names_that_are_taken_or_no_words() -> None:
    other = replace(OPERATORS["edge_subdivide"], effect="another one")
    with pytest.raises(ConfigError, match=r"is an operator of autopoly_env.operators.edge_subdivide already"):
        register(other)
    for name in ("stop", "full", "edge cut", ""):
        with pytest.raises(ConfigError, match="cannot be called"):
            register(replace(other, name=name))
    assert register(OPERATORS["face_split"]) is OPERATORS["face_split"]


EFFECTS = {
    "edge_subdivide": (1, 1, 0),
    "edge_extrude": (2, 3, 1),
    "face_split": (0, 1, 1),
    "vertex_dissolve": (-1, -1, 0),
    "edge_dissolve": (0, -1, -1),
    "edge_cap": (1, 2, 1),
}


def expected_effect(transition: Transition) -> tuple[int, int, int]:
    """The table's entry; for a deleted face counted from the faces that stay."""
    name, mesh, element = transition.action.operator, transition.before, transition.action.element
    if name == "face_hole":
        k = 3 + element % 2
        return k, k + 2, 1
    if name == "face_delete":
        others = [face for f, face in enumerate(mesh.faces) if f != element]
        stay = set().union(*others), {frozenset(p) for face in others for p in pairwise((*face, face[0]))}
        return len(stay[0]) - mesh.counts[0], len(stay[1]) - mesh.counts[1], -1
    if name == "edge_fill":
        return 0, n_new_sides(mesh, transition.made.faces[-1]), 1
    if name == "face_inset":
        n = len(mesh.faces[element])
        return n, 2 * n, n
    if name == "loop_cut":
        n, k = (len(transition.made.vertex_ids) - mesh.counts[0]), (len(transition.made.faces) - mesh.counts[2])
        assert n in (k, k + 1)
        return n, n + k, k
    if name == "vertex_merge":
        choice = OPERATORS[name].choose(mesh, element) if transition.choice is None else transition.choice
        ends = [{u for e in mesh.edges.tolist() for u in e if v in e and u != v} for v in (element, choice)]
        return -1, -len(ends[0] & ends[1]), 0
    return EFFECTS[name]


def n_new_sides(mesh: PolyMesh, face: Face) -> int:
    """How many sides of a face are no edges of the mesh."""
    edges = {frozenset(pair) for other in mesh.faces for pair in pairwise((*other, other[0]))}
    return len({frozenset(pair) for pair in pairwise((*face, face[0]))} - edges)


def check_topology(mesh: PolyMesh) -> None:
    validate(mesh)
    n_vertices, n_edges, n_faces = mesh.counts
    assert n_vertices - n_edges + n_faces == mesh.topology.n_components - mesh.topology.n_holes
    sides = Counter(frozenset(pair) for face in mesh.faces for pair in pairwise((*face, face[0])))
    assert set(sides.values()) <= {1, 2}
    assert len(sides) == n_edges


@pytest.mark.slow
@settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(walks())
def test_walk__keeps_meshes_valid_euler_true_effects_exact_and_ids_fresh(walk: list[Transition]) -> None:
    seen_vertices, seen_faces = set(walk[0].before.vertex_ids), set(walk[0].before.face_ids)
    for transition in walk:
        before, made = transition.before, transition.made
        check_topology(made)
        assert tuple(np.subtract(made.counts, before.counts)) == expected_effect(transition)
        new_vertices = set(made.vertex_ids) - set(before.vertex_ids)
        new_faces = set(made.face_ids) - set(before.face_ids)
        assert not new_vertices & seen_vertices
        assert not new_faces & seen_faces
        seen_vertices |= new_vertices
        seen_faces |= new_faces
        for name in set(made.vertex_ids) & set(before.vertex_ids):
            here, there = made.vertices[made.vertex_index(name)], before.vertices[before.vertex_index(name)]
            assert here.tobytes() == there.tobytes()


@settings(max_examples=20, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(walks(1, 20))
def test_legal_mask__is_true_exactly_where_apply_works(walk: list[Transition]) -> None:
    mesh = walk[-1].after
    for operator in OPERATORS.values():
        mask = operator.legal_mask(mesh)
        assert mask.shape == (operator.element.count(mesh),)
        for element, is_legal in enumerate(mask):
            if is_legal:
                validate(operator.apply(mesh, element))
            else:
                refusal(operator.name, mesh, element)
