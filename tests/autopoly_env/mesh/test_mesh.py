"""The mesh: what is derived from its faces, what makes it valid, and what its hash sees."""

import pickle
import random
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from autopoly_env.errors import MeshError
from autopoly_env.mesh import PolyMesh, Topology, canonical_hash, is_valid, topology, validate
from tests.helpers.strategies import meshes, random_walk

SQUARE = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
NAN = float("nan")


def two_quads() -> PolyMesh:
    """0-1-2 above 3-4-5: the quads (0, 1, 4, 3) and (1, 2, 5, 4) share edge 1-4."""
    return PolyMesh.from_faces([(x, y) for y in (0.0, 0.5) for x in (0.0, 0.5, 1.0)], [(0, 1, 4, 3), (1, 2, 5, 4)])


def grid_without(*gone: int) -> PolyMesh:
    """The 3 x 3 grid of the unit square less some faces, loose vertices left out."""
    grid = PolyMesh.grid(3, 0.0, 0.0, 1.0, 1.0)
    faces = [face for f, face in enumerate(grid.faces) if f not in gone]
    used = sorted(set().union(*faces))
    return PolyMesh.from_faces(grid.vertices[used], [[used.index(v) for v in face] for face in faces])


def loop_areas(mesh: PolyMesh) -> list[float]:
    return [shapely.Polygon(mesh.vertices[loop]).area for loop in mesh.topology.boundary_loops]


def test_rectangle__has_4_4_1_and_positive_area() -> None:
    mesh = PolyMesh.rectangle(0.25, 0.5, 0.75, 1.0)
    assert mesh.counts == (4, 4, 1)
    assert mesh.complexity == 9
    assert mesh.vertices.tolist() == [[0.25, 0.5], [0.75, 0.5], [0.75, 1.0], [0.25, 1.0]]
    assert mesh.face_areas().tolist() == [0.25]
    assert repr(mesh) == "PolyMesh(V=4, E=4, F=1)"


@pytest.mark.parametrize(("n", "counts"), [(1, (4, 4, 1)), (2, (9, 12, 4)), (3, (16, 24, 9)), (5, (36, 60, 25))])
def test_grid__has_the_counts_of_a_grid(n: int, counts: tuple[int, int, int]) -> None:
    mesh = PolyMesh.grid(n, 0.0, 0.0, 1.0, 1.0)
    assert mesh.counts == counts
    assert mesh.face_areas() == pytest.approx(1 / n**2)


def test_rectangle__refuses_an_empty_box() -> None:
    with pytest.raises(MeshError, match="is empty; give x0 < x1 and y0 < y1"):
        PolyMesh.rectangle(0.5, 0.0, 0.5, 1.0)


def test_two_quads__derived_arrays_are_those_written_by_hand() -> None:
    topology = two_quads().topology
    assert topology.half_edges.tolist() == [[0, 1], [1, 4], [4, 3], [3, 0], [1, 2], [2, 5], [5, 4], [4, 1]]
    assert topology.half_edge_face.tolist() == [0, 0, 0, 0, 1, 1, 1, 1]
    assert topology.face_offsets.tolist() == [0, 4, 8]
    assert topology.edges.tolist() == [[0, 1], [0, 3], [1, 2], [1, 4], [2, 5], [3, 4], [4, 5]]
    assert topology.corners.tolist() == topology.half_edges[:, 0].tolist()
    assert topology.edge_faces.tolist() == [[0, -1], [0, -1], [1, -1], [0, 1], [1, -1], [0, -1], [1, -1]]
    assert topology.is_boundary_edge.tolist() == [True, True, True, False, True, True, True]
    assert topology.is_boundary_vertex.all()
    assert topology.valence.tolist() == [2, 3, 2, 2, 3, 2]
    assert [loop.tolist() for loop in topology.boundary_loops] == [[0, 1, 2, 5, 4, 3]]
    assert topology.boundary_half_edges.tolist() == [[0, 1], [1, 2], [2, 5], [5, 4], [4, 3], [3, 0]]
    assert (topology.n_components, topology.n_holes) == (1, 0)


def test_l_shape__is_one_hexagon_with_three_quarters_of_the_area() -> None:
    mesh = PolyMesh.from_faces([(0, 0), (1, 0), (1, 0.5), (0.5, 0.5), (0.5, 1), (0, 1)], [range(6)])
    assert mesh.counts == (6, 6, 1)
    assert mesh.face_areas().tolist() == [0.75]
    assert mesh.topology.boundary_loops[0].tolist() == [0, 1, 2, 3, 4, 5]


def test_grid__has_interior_vertices_off_the_boundary() -> None:
    topology = PolyMesh.grid(3, 0.0, 0.0, 1.0, 1.0).topology
    assert np.flatnonzero(~topology.is_boundary_vertex).tolist() == [5, 6, 9, 10]
    assert topology.valence[5] == 4


def test_ring_of_eight_quads__has_one_hole_with_a_reversed_loop() -> None:
    mesh = grid_without(4)
    assert mesh.counts == (16, 24, 8)
    assert (mesh.topology.n_components, mesh.topology.n_holes) == (1, 1)
    outer, inner = (mesh.vertices[loop] for loop in mesh.topology.boundary_loops)
    assert shapely.LinearRing(outer).is_ccw  # counter-clockwise with y up is positive shoelace area
    assert not shapely.LinearRing(inner).is_ccw
    assert loop_areas(mesh) == pytest.approx([1.0, 1 / 9])


def test_two_apart_quads__are_two_components() -> None:
    mesh = grid_without(1, 2, 3, 4, 5, 6, 7)
    assert mesh.counts == (8, 8, 2)
    assert (mesh.topology.n_components, mesh.topology.n_holes) == (2, 0)


def test_two_quads_at_a_pinch__are_one_component_with_a_loop_each() -> None:
    mesh = grid_without(1, 2, 3, 5, 6, 7, 8)
    assert mesh.counts == (7, 8, 2)
    assert (mesh.topology.n_components, mesh.topology.n_holes) == (1, 0)
    assert sorted(sorted(loop) for loop in mesh.topology.boundary_loops) == sorted(map(sorted, mesh.faces))
    assert mesh.topology.valence.max() == 4


def test_ring_closed_by_a_pinch__has_a_hole_although_its_boundary_is_one_loop() -> None:
    mesh = grid_without(0, 4)
    assert mesh.counts == (15, 22, 7)
    assert [len(loop) for loop in mesh.topology.boundary_loops] == [16]
    assert (mesh.topology.n_components, mesh.topology.n_holes) == (1, 1)


def test_checkerboard__counts_the_holes_between_its_pinches() -> None:
    mesh = grid_without(1, 3, 5, 7)  # five quads, joined by four pinches, enclose nothing
    assert mesh.counts == (16, 20, 5)
    assert (mesh.topology.n_components, mesh.topology.n_holes) == (1, 0)
    frame = grid_without(0, 2, 4, 6, 8)  # four quads in a circle, joined by four pinches, enclose the middle
    assert frame.counts == (12, 16, 4)
    assert (frame.topology.n_components, frame.topology.n_holes) == (1, 1)


def test_arrays__are_read_only() -> None:
    mesh = two_quads()
    arrays = [mesh.vertices, mesh.edges, mesh.topology.half_edges, mesh.topology.valence, mesh.topology.edge_faces]
    for array in arrays:
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_vertices__are_a_copy_of_what_was_given() -> None:
    given_array = np.array(SQUARE)
    mesh = PolyMesh.from_faces(given_array, [range(4)])
    given_array[0] = 9.0
    assert mesh.vertices[0].tolist() == [0.0, 0.0]


def test_with_vertices__moves_vertices_and_shares_the_topology() -> None:
    mesh = two_quads()
    moved = mesh.with_vertices(mesh.vertices + 0.25)
    assert moved.topology is mesh.topology
    assert moved.vertices[0].tolist() == [0.25, 0.25]
    assert (moved.vertex_ids, moved.face_ids) == (mesh.vertex_ids, mesh.face_ids)


def test_with_vertices__refuses_another_shape() -> None:
    with pytest.raises(MeshError, match=r"shape \(3, 2\); give \(6, 2\)"):
        two_quads().with_vertices([(0, 0), (1, 0), (1, 1)])


def test_ids__lead_to_indices_and_back() -> None:
    mesh = PolyMesh(np.array(SQUARE), Topology(4, ((0, 1, 2, 3),)), (7, 3, 9, 1), (5,), 10, 6)
    validate(mesh)
    assert [mesh.vertex_index(v) for v in (7, 3, 9, 1)] == [0, 1, 2, 3]
    assert mesh.face_index(5) == 0
    assert mesh.edges[mesh.edge_index(3, 0)].tolist() == [0, 3]
    with pytest.raises(MeshError, match="vertex id 0 is not in this mesh; give one of 7, 3, 9, 1"):
        mesh.vertex_index(0)
    with pytest.raises(MeshError, match="face id 0 is not in this mesh; give one of 5"):
        mesh.face_index(0)
    with pytest.raises(MeshError, match="no edge joins vertices 0 and 2"):
        mesh.edge_index(0, 2)


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        ([(0, 0), (1, NAN), (1, 1)], [(0, 1, 2)], "vertex 1 is not finite"),
        ([(0, 0), (1, float("inf")), (1, 1)], [(0, 1, 2)], "vertex 1 is not finite"),
        ([(0, 0, 0)] * 3, [(0, 1, 2)], r"shape \(3, 3\); give \(V, 2\)"),
        (SQUARE, [], "the mesh has no face"),
        (SQUARE, [(0, 1)], "face 0 has 2 vertices"),
        (SQUARE, [(0, 1, 4)], r"face 0 names a vertex outside 0\.\.3"),
        (SQUARE, [(0, 1, -1)], r"face 0 names a vertex outside 0\.\.3"),
        (SQUARE, [(0, 1, 2, 3), (0, 1, 0)], "face 1 passes through a vertex twice"),
        (SQUARE, [(0, 1, 2), (0, 1, 3)], "two faces run along edge 0-1 in the same direction"),
        ([*SQUARE, (2, 0)], [(0, 1, 2), (1, 0, 3), (0, 1, 4)], "edge 0-1 has 3 faces"),
        ([*SQUARE, (2, 2)], [(0, 1, 2, 3)], "vertex 4 belongs to no face"),
    ],
)
def test_from_faces__names_the_first_defect(vertices: list, faces: list, message: str) -> None:
    with pytest.raises(MeshError, match=message) as caught:
        PolyMesh.from_faces(vertices, faces)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("vertex_ids", "face_ids", "next_vertex_id", "message"),
    [
        ((0, 1, 2, 2), (0,), 4, "vertex id 2 stands for two elements"),
        ((0, 1, 2), (0,), 4, "3 vertex ids came for 4 elements"),
        ((0, 1, 2, 4), (0,), 4, r"vertex ids must lie in 0\.\.3"),
        ((0, 1, 2, 3), (1,), 4, r"face ids must lie in 0\.\.0"),
        ((0, 1, 2, 3), (0, 0), 4, "2 face ids came for 1 elements"),
    ],
)
def test_validate__refuses_ids_that_are_not_names(
    vertex_ids: tuple[int, ...], face_ids: tuple[int, ...], next_vertex_id: int, message: str
) -> None:
    mesh = PolyMesh(np.array(SQUARE), Topology(4, ((0, 1, 2, 3),)), vertex_ids, face_ids, next_vertex_id, 1)
    assert not is_valid(mesh)
    with pytest.raises(MeshError, match=message):
        validate(mesh)


def test_validate__allows_flipped_and_crossing_faces() -> None:
    flipped = PolyMesh.from_faces(SQUARE, [(3, 2, 1, 0)])
    crossing = PolyMesh.from_faces(SQUARE, [(0, 2, 1, 3)])
    assert is_valid(flipped)
    assert is_valid(crossing)
    assert flipped.face_areas().tolist() == [-1.0]


def test_equality__sees_positions_names_and_numbering() -> None:
    mesh = two_quads()
    assert mesh == two_quads()
    assert hash(mesh) == hash(two_quads())
    assert mesh != mesh.with_vertices(mesh.vertices + 1.0)
    assert mesh != PolyMesh(mesh.vertices, mesh.topology, (0, 1, 2, 3, 4, 9), mesh.face_ids, 10, 2)


def test_pickle__brings_back_an_equal_and_read_only_mesh() -> None:
    mesh = two_quads()
    assert mesh.edges is mesh.topology.edges  # cached, and left behind
    copy = pickle.loads(pickle.dumps(mesh))
    assert copy == mesh
    assert not copy.vertices.flags.writeable
    assert not copy.edges.flags.writeable


def renumbered(mesh: PolyMesh, rng: random.Random) -> PolyMesh:
    """The same shape with its vertices, its faces and the first corners of its faces shuffled."""
    order = rng.sample(range(len(mesh.vertices)), len(mesh.vertices))
    turns = [rng.randrange(len(face)) for face in mesh.faces]
    faces = [(*face[t:], *face[:t]) for face, t in zip(mesh.faces, turns, strict=True)]
    rng.shuffle(faces)
    return PolyMesh.from_faces(mesh.vertices[order], [[order.index(v) for v in face] for face in faces])


@pytest.mark.slow
@given(meshes(), st.randoms(use_true_random=False))
def test_canonical_hash__does_not_see_the_numbering(mesh: PolyMesh, rng: random.Random) -> None:
    assert canonical_hash(renumbered(mesh, rng)) == canonical_hash(mesh)


def test_canonical_hash__sees_moves_beyond_its_grid_and_only_those() -> None:
    mesh = PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75)
    nudge = np.zeros((4, 2))
    nudge[2, 0] = 2**-22
    assert canonical_hash(mesh.with_vertices(mesh.vertices + nudge)) == canonical_hash(mesh)
    assert canonical_hash(mesh.with_vertices(mesh.vertices + 8 * nudge)) != canonical_hash(mesh)


def test_canonical_hash__tells_a_split_quad_by_its_diagonal() -> None:
    one = PolyMesh.from_faces(SQUARE, [(0, 1, 2), (0, 2, 3)])
    other = PolyMesh.from_faces(SQUARE, [(0, 1, 3), (1, 2, 3)])
    hashes = {canonical_hash(mesh) for mesh in (one, other, PolyMesh.from_faces(SQUARE, [(0, 1, 2, 3)]))}
    assert len(hashes) == 3


@pytest.mark.slow
@given(meshes(40))
def test_boundary__is_every_half_edge_without_a_twin_in_closed_loops(mesh: PolyMesh) -> None:
    directed = {pair for face in mesh.faces for pair in pairwise((*face, face[0]))}
    lonely = {(a, b) for a, b in directed if (b, a) not in directed}
    topology = mesh.topology
    assert {tuple(row) for row in topology.boundary_half_edges.tolist()} == lonely
    assert len(topology.boundary_half_edges) == len(lonely)
    around = [pair for loop in topology.boundary_loops for pair in pairwise([*loop.tolist(), loop[0]])]
    assert around == [tuple(row) for row in topology.boundary_half_edges.tolist()]
    assert set(topology.edges[topology.is_boundary_edge].ravel().tolist()) == set(
        np.flatnonzero(topology.is_boundary_vertex).tolist()
    )


def has_pinch(mesh: PolyMesh) -> bool:
    """Whether a vertex starts more than one boundary half-edge."""
    starts = mesh.topology.boundary_half_edges[:, 0].tolist()
    return len(set(starts)) < len(starts)


def lies_flat(mesh: PolyMesh) -> bool:
    """Whether, as shapely sees it, no face is flipped or overlaps another, and edges meet in common vertices only."""
    polygons = shapely.polygons([shapely.linearrings(mesh.vertices[list(face)]) for face in mesh.faces])
    segments = shapely.linestrings(mesh.vertices[mesh.edges])
    i, j = np.triu_indices(len(segments), 1)
    is_apart = (mesh.edges[i][:, :, None] != mesh.edges[j][:, None, :]).all(axis=(1, 2))
    i, j = i[is_apart], j[is_apart]
    return bool(
        shapely.is_valid(polygons).all()
        and shapely.is_ccw(shapely.get_exterior_ring(polygons)).all()
        and not shapely.intersects(segments[i], segments[j]).any()
        and abs(shapely.union_all(polygons).area - shapely.area(polygons).sum()) < 1e-12
    )


@pytest.mark.slow
def test_components_and_holes__are_the_parts_and_interiors_of_shapelys_union() -> None:
    found = []
    for seed in range(40):
        for mesh in [transition.after for transition in random_walk(seed, n_steps=25)]:
            if has_pinch(mesh) or not lies_flat(mesh):
                continue
            union = shapely.union_all([shapely.Polygon(mesh.vertices[list(face)]) for face in mesh.faces])
            parts = shapely.get_parts(union)
            found.append((len(parts), sum(len(part.interiors) for part in parts)))
            assert (mesh.topology.n_components, mesh.topology.n_holes) == found[-1]
    assert len(found) > 300
    assert sum(n_parts > 1 for n_parts, _ in found) > 20
    assert sum(n_holes > 0 for _, n_holes in found) > 100


@given(mesh=meshes(60))
def test_large_mesh__is_asked_about_single_elements_as_in_tables_of_all(mesh: PolyMesh) -> None:
    table = mesh.topology
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(topology, "MANY", 0)
        single = Topology(table.n_vertices, table.faces)
        assert np.array_equal(single.edges, np.array(list(table.edge_lookup)))
        assert [single.sides(e) for e in range(single.n_edges)] == table.edge_half_edges
        assert [single.lone_corner(v) for v in range(table.n_vertices)] == table.lone_corners
        assert [single.first_corner(f) for f in range(table.n_faces)] == table.links.offsets[:-1]
        assert [single.corner(h)[0] for h in range(single.n_corners)] == table.links.faces
        assert [single.ends(h) for h in range(single.n_corners)] == list(
            zip(table.links.tails, table.links.heads, strict=True)
        )
        pairs = [(a, b) for a in range(table.n_vertices) for b in range(a)]
        assert [single.edge_at(a, b) for a, b in pairs] == [table.edge_lookup.get((b, a), -1) for a, b in pairs]
