"""Meshes compared: what fits whoever numbered it, and what differs, in words."""

import random
from math import cos, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from blender.autopoly_coach.comparing import Shape, differences, partners, shape_of, summary
from tests.helpers.sequences import walked

TOLERANCE = 0.01
SQUARE = {0: (0.0, 0.0), 1: (1.0, 0.0), 2: (1.0, 1.0), 3: (0.0, 1.0)}
WANTED = shape_of({**SQUARE, 4: (2.0, 0.0), 5: (2.0, 1.0)}, {0: (0, 1, 2, 3), 1: (1, 4, 5, 2)})  # two quads


def changed(shape: Shape, places: dict[int, tuple[float, float, float]]) -> Shape:
    return Shape({**shape.places, **places}, shape.edges, shape.faces)


def renumbered(shape: Shape, seed: int, by: float = 0.0) -> Shape:
    """The same mesh as Blender may have it: other numbers, faces either way round, vertices a little off."""
    dice = random.Random(seed)
    names = dict(zip(shape.places, dice.sample(range(100, 1000), len(shape.places)), strict=True))
    places = {
        names[v]: (x + dice.uniform(-by, by), y + dice.uniform(-by, by), z) for v, (x, y, z) in shape.places.items()
    }
    rings = [tuple(names[v] for v in ring) for ring in shape.faces.values()]
    turned = [ring[k:] + ring[:k] for ring in rings for k in [dice.randrange(len(ring))]]
    faces = dict(enumerate(ring if dice.random() < 0.5 else ring[::-1] for ring in dice.sample(turned, len(turned))))
    edges = frozenset((min(names[a], names[b]), max(names[a], names[b])) for a, b in shape.edges)
    return Shape(dict(dice.sample(list(places.items()), len(places))), edges, faces)


@given(st.integers(0, 300), st.sampled_from([0.0, 0.006]))
def test_same_mesh__fits_whoever_numbered_it(seed: int, by: float) -> None:
    assert differences(renumbered(WANTED, seed, by), WANTED, TOLERANCE) == []


@pytest.mark.parametrize("seed", range(12))
def test_mesh_of_a_walk__fits_itself_and_no_other_of_the_walk(seed: int) -> None:
    meshes = walked(seed, 25, 0.0, ("full", "modeller")[seed % 2]).meshes()
    shapes = []
    for mesh in meshes:
        ids = mesh.vertex_ids
        rings = {name: tuple(ids[v] for v in ring) for name, ring in zip(mesh.face_ids, mesh.faces, strict=True)}
        shapes.append(shape_of({v: (x, y) for v, (x, y) in zip(ids, mesh.vertices.tolist(), strict=True)}, rings))
    for number, shape in enumerate(shapes):
        assert differences(renumbered(shape, number), shape, 1e-4) == []
        if number:
            assert differences(renumbered(shape, number), shapes[number - 1], 1e-4)


def test_vertices_in_one_place__get_the_faces_that_hang_on_them() -> None:
    """Two triangles that touch in a point, where each has a vertex of its own; as far as places go either will do."""
    vertices = {0: (0.0, 0.0), 1: (1.0, 0.0), 2: (0.5, 0.5), 3: (0.5, 0.5), 4: (1.0, 1.0), 5: (0.0, 1.0)}
    shape = shape_of(vertices, {0: (0, 1, 2), 1: (3, 4, 5)})
    for seed in range(20):
        assert differences(renumbered(shape, seed), shape, TOLERANCE) == []
    joined = shape_of({v: at for v, at in vertices.items() if v != 3}, {0: (0, 1, 2), 1: (2, 4, 5)})
    assert differences(joined, shape, TOLERANCE)[0] == "1 vertex too few."


@given(st.sampled_from(sorted(WANTED.places)), st.floats(0.011, 0.4), st.floats(0.0, 6.28), st.integers(0, 50))
def test_vertex_off__is_named_with_the_way_back(vertex: int, far: float, angle: float, seed: int) -> None:
    x, y, _ = WANTED.places[vertex]
    found = renumbered(changed(WANTED, {vertex: (x + far * cos(angle), y + far * sin(angle), 0.0)}), seed)
    (told,) = differences(found, WANTED, TOLERANCE)
    assert told.startswith(f"Vertex {vertex} is {far:.3f} from its place ({x:.3f}, {y:.3f}): move it there, G ")
    typed = told.split(" G ")[1].removesuffix(" Enter.").split(" Tab ")
    assert [float(number) for number in typed] == pytest.approx([-far * cos(angle), -far * sin(angle)], abs=0.00051)


def test_tolerance__is_a_distance() -> None:
    for away, n in ((0.0099, 0), (0.0101, 1)):
        assert len(differences(changed(WANTED, {5: (2.0, 1.0, away)}), WANTED, TOLERANCE)) == n
    (told,) = differences(changed(WANTED, {5: (2.0, 1.0, 0.5)}), WANTED, TOLERANCE)
    assert told == "Vertex 5 is 0.500 from its place (2.000, 1.000): move it there, G 0 Tab 0 Tab -0.5 Enter."


def test_vertex_that_is_nowhere__is_named() -> None:
    (told,) = differences(changed(WANTED, {5: (float("nan"), 1.0, 0.0)}), WANTED, TOLERANCE)
    assert told.startswith("Vertex 5 is inf from its place")


def test_what_is_too_many_or_too_few__is_counted_and_named() -> None:
    one = shape_of(SQUARE, {0: (0, 1, 2, 3)})
    assert differences(one, WANTED, TOLERANCE) == [
        "2 vertices too few, 3 edges too few, 1 face too few.",
        "There is no vertex 4 at (2.000, 0.000).",
        "There is no vertex 5 at (2.000, 1.000).",
        "Edge 1–4 is missing.",
        "Edge 2–5 is missing.",
        "Edge 4–5 is missing.",
        "Face 1 between 1, 2, 5, 4 is missing.",
    ]
    assert differences(WANTED, one, TOLERANCE) == [
        "2 vertices too many, 3 edges too many, 1 face too many.",
        "The vertex at (2.000, 0.000) should not be there.",
        "The vertex at (2.000, 1.000) should not be there.",
    ]


def test_extrusion_that_was_cancelled__is_told_from_a_stray_vertex() -> None:
    places = {**WANTED.places, 6: (2.0, 0.0, 0.0), 7: (2.0, 1.0, 0.0)}
    found = Shape(places, WANTED.edges | {(4, 6), (5, 7), (6, 7)}, {**WANTED.faces, 2: (4, 6, 7, 5)})
    told = differences(found, WANTED, TOLERANCE)
    assert told[0] == "2 vertices too many, 3 edges too many, 1 face too many."
    assert told[1:3] == [
        "A vertex too many lies on vertex 4: select both, M, By Distance.",
        "A vertex too many lies on vertex 5: select both, M, By Distance.",
    ]


def test_other_edge__is_named_where_all_counts_and_places_agree() -> None:
    split = shape_of(SQUARE, {0: (0, 1, 2), 1: (0, 2, 3)})
    other = shape_of(SQUARE, {0: (0, 1, 3), 1: (1, 2, 3)})
    assert differences(other, split, TOLERANCE)[:2] == ["Edge 0–2 is missing.", "There should be no edge 1–3."]


def test_face_that_crosses_itself__is_another_face() -> None:
    bow = Shape(WANTED.places, WANTED.edges, {0: (0, 1, 2, 3), 1: (1, 5, 4, 2)})
    assert differences(bow, WANTED, TOLERANCE) == [
        "Face 1 between 1, 2, 5, 4 is missing.",
        "There should be no face between 1, 2, 4, 5.",
    ]


def test_partners__are_the_nearest_first() -> None:
    found = Shape({7: (0.004, 0.0, 0.0), 8: (0.001, 0.0, 0.0)}, frozenset(), {})
    wanted = Shape({0: (0.0, 0.0, 0.0), 1: (0.006, 0.0, 0.0)}, frozenset(), {})
    assert partners(found, wanted, TOLERANCE) == {0: 8, 1: 7}


def test_summary__tells_the_first_and_counts_the_others() -> None:
    assert summary(["a.", "b."]) == "a. b."
    assert summary(f"{k}." for k in range(6)) == "0. 1. 2. 3. And 2 more."
