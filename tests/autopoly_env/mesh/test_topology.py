"""What follows from the faces of a mesh: by hand on an L, and beside dictionaries on any mesh."""

import pickle

import numpy as np
import pytest
from hypothesis import given

from autopoly_env.errors import MeshError
from autopoly_env.mesh import PolyMesh, Topology
from tests.helpers.strategies import meshes


def test_arrays__of_two_quads_side_by_side() -> None:
    # 0 1 2   faces 0 1 4 3 and 1 2 5 4: the half-edge 1-4 of the first meets 4-1 of the second
    # 3 4 5
    topology = Topology(6, ((0, 1, 4, 3), (1, 2, 5, 4)))
    arrays = topology.arrays
    assert arrays.edges.tolist() == [[0, 1], [0, 3], [1, 2], [1, 4], [2, 5], [3, 4], [4, 5]]
    assert arrays.twins.tolist() == [-1, 7, -1, -1, -1, -1, -1, 1]
    assert arrays.sides.tolist() == [[0, -1], [3, -1], [4, -1], [1, 7], [5, -1], [2, -1], [6, -1]]
    assert arrays.edge_of.tolist() == [0, 3, 5, 1, 2, 4, 6, 3]
    assert arrays.rim.tolist() == [0, 4, 5, 6, 2, 3]
    assert arrays.loop_ends.tolist() == [6]
    assert arrays.outer.tolist() == [0, 1, 2, 5, 4, 3]
    assert arrays.loops.tolist() == [[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [5, 0]]
    assert arrays.inner.tolist() == arrays.neighbours.tolist() == []


def test_arrays__say_what_is_joined_to_a_vertex_inside() -> None:
    arrays = PolyMesh.grid(2, 0.0, 0.0, 1.0, 1.0).topology.arrays
    assert arrays.inner.tolist() == [4]
    assert arrays.neighbours.tolist() == [1, 3, 5, 7]
    assert arrays.neighbour_offsets.tolist() == [0, 4]


def test_arrays__of_a_ring_have_two_loops() -> None:
    ring = [(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    topology = Topology(8, tuple(ring))
    assert [loop.tolist() for loop in topology.boundary_loops] == [[0, 1, 2, 3], [5, 4, 7, 6]]
    assert topology.n_holes == 1


@given(meshes())
def test_arrays__are_those_of_dictionaries(mesh: PolyMesh) -> None:
    topology, arrays = mesh.topology, mesh.topology.arrays
    pairs = [(a, b) for face in mesh.faces for a, b in zip(face, (*face[1:], face[0]), strict=True)]
    at = {pair: h for h, pair in enumerate(pairs)}
    edges = sorted({(min(pair), max(pair)) for pair in pairs})
    assert arrays.half_edges.tolist() == list(map(list, pairs))
    assert arrays.twins.tolist() == [at.get((b, a), -1) for a, b in pairs]
    assert arrays.edges.tolist() == list(map(list, edges))
    assert [edges[e] for e in arrays.edge_of.tolist()] == [(min(pair), max(pair)) for pair in pairs]
    sides = [sorted(h for h in (at.get((a, b)), at.get((b, a))) if h is not None) for a, b in edges]
    assert arrays.sides.tolist() == [[*side, -1][:2] for side in sides]
    assert sorted(arrays.rim.tolist()) == [h for h, twin in enumerate(arrays.twins.tolist()) if twin < 0]
    for loop in topology.boundary_loops:
        steps = zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True)
        assert all(pair in at and pair[::-1] not in at for pair in steps)
    assert sorted(arrays.outer.tolist() + arrays.inner.tolist()) == list(range(topology.n_vertices))
    assert (arrays.outer[arrays.loops] == topology.boundary_half_edges).all()
    for k, v in enumerate(arrays.inner.tolist()):
        joined = arrays.neighbours[arrays.neighbour_offsets[k] : arrays.neighbour_offsets[k + 1]].tolist()
        assert joined == [a + b - v for a, b in edges if v in (a, b)]


@pytest.mark.parametrize("vertex", [-1, 3, 2**40])
def test_topology__with_a_vertex_that_there_is_not_is_refused(vertex: int) -> None:
    with pytest.raises(MeshError, match="a face has a vertex beyond the 3 that there are"):
        _ = Topology(3, ((0, 1, vertex),)).edges


@given(meshes())
def test_topology__of_what_a_kernel_made_is_that_of_the_faces(mesh: PolyMesh) -> None:
    plain = Topology(mesh.topology.n_vertices, mesh.faces)
    packed = Topology.of_packed(plain.n_vertices, plain.packed.copy())
    assert packed.n_faces == len(mesh.faces) and packed.n_corners == plain.n_corners
    assert packed == plain and hash(packed) == hash(plain)
    assert packed.faces == mesh.faces and pickle.loads(pickle.dumps(packed)) == plain
    assert packed != Topology(plain.n_vertices + 1, mesh.faces) and packed != mesh.faces


def test_topology__has_no_other_attributes() -> None:
    with pytest.raises(AttributeError, match="a Topology has no 'corner_count'"):
        _ = Topology(3, ((0, 1, 2),)).corner_count
