"""Convex pieces, by shapely; what Tiled's and Godot's files hold, read by packages that are not ours."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import assume, given

from autopoly_env.errors import ConfigError
from autopoly_env.export.convex import MOST_CORNERS, convex_pieces, to_convex_json
from autopoly_env.export.godot import to_tscn
from autopoly_env.mesh import PolyMesh, is_sane
from autopoly_env.operators import OPERATORS
from tests.helpers.shapes import hourglass, polygon, star
from tests.helpers.strategies import meshes

QUAD = PolyMesh.rectangle(0.25, 0.125, 0.75, 0.5)
RING = OPERATORS["face_delete"].apply(PolyMesh.grid(3, 0.1, 0.1, 0.9, 0.9), 4)  # 8 quads around a hole
ELL = polygon([(0.1, 0.1), (0.4, 0.1), (0.4, 0.5), (0.9, 0.5), (0.9, 0.9), (0.1, 0.9)])
CIRCLE = polygon([(0.5 + 0.4 * np.cos(t), 0.5 + 0.4 * np.sin(t)) for t in np.arange(20) * np.pi / 10])
SHAPES = {"quad": QUAD, "ring": RING, "ell": ELL, "circle": CIRCLE, "pinch": hourglass(), "star": polygon(star(3, 17))}
ODD = '<b>"Käse\\"]\n[node & </b>'


def assert_pieces_of(mesh: PolyMesh, pieces: list[Any], scale: float = 1.0, atol: float = 1e-12) -> None:
    """Convex, small, apart from each other, and together what the faces are together."""
    shapes = [shapely.Polygon(piece) for piece in pieces]
    assert all(3 <= len(piece) <= MOST_CORNERS for piece in pieces)
    for shape in shapes:
        assert shape.convex_hull.area - shape.area <= atol * scale**2
    whole = shapely.union_all([shapely.Polygon(scale * mesh.vertices[list(face)]) for face in mesh.faces])
    assert sum(shape.area for shape in shapes) == pytest.approx(whole.area, rel=1e-6)
    assert shapely.union_all(shapes).symmetric_difference(whole).area <= 1e-6 * whole.area


@pytest.mark.parametrize("name", SHAPES)
def test_pieces__are_convex_and_cover_the_faces(name: str) -> None:
    assert_pieces_of(SHAPES[name], convex_pieces(SHAPES[name]))


def test_pieces__are_few() -> None:
    n_pieces = {name: len(convex_pieces(mesh)) for name, mesh in SHAPES.items()}
    assert (n_pieces["quad"], n_pieces["ell"], n_pieces["pinch"]) == (1, 2, 2)
    assert n_pieces["ring"] <= 8 and n_pieces["circle"] in (3, 4)  # 20 corners, 8 a piece
    assert convex_pieces(QUAD, 3) != convex_pieces(QUAD) and {len(piece) for piece in convex_pieces(QUAD, 3)} == {3}


def test_corner_on_a_straight_line__is_left_out() -> None:
    (piece,) = convex_pieces(OPERATORS["edge_subdivide"].apply(QUAD, 0))
    assert sorted(piece) == sorted(map(tuple, QUAD.vertices.tolist()))


@pytest.mark.slow
@given(meshes())
def test_pieces_of_every_sane_mesh__cover_it(mesh: PolyMesh) -> None:
    assume(is_sane(mesh))
    assert_pieces_of(mesh, convex_pieces(mesh))


@pytest.mark.parametrize("name", SHAPES)
def test_convex_json__is_a_map_of_tiled(name: str, tmp_path: Path) -> None:
    parser = pytest.importorskip("pytiled_parser", reason="pytiled-parser is not installed")
    (tmp_path / "shape.json").write_text(to_convex_json(SHAPES[name], ODD, 64.0))
    (layer,) = parser.parse_map(tmp_path / "shape.json").layers
    assert layer.name == ODD
    pieces = [[(x, y) for x, y in thing.points] for thing in layer.tiled_objects]
    assert_pieces_of(SHAPES[name], pieces, 64.0)


def test_convex_json__has_pixels_y_down() -> None:
    document = json.loads(to_convex_json(QUAD, "quad", 8.0))
    (thing,) = document["layers"][0]["objects"]
    assert (document["type"], document["tilewidth"], document["nextobjectid"]) == ("map", 8, 2)
    assert sorted((p["x"], p["y"]) for p in thing["polygon"]) == [(2, 1), (2, 4), (6, 1), (6, 4)]


def points_of(values: tuple[float, ...]) -> np.ndarray:
    return np.array(values).reshape(-1, 2)


@pytest.mark.parametrize("name", SHAPES)
def test_godot__draws_the_faces_and_collides_with_the_pieces(name: str, tmp_path: Path) -> None:
    godot = pytest.importorskip("godot_parser", reason="godot-parser is not installed (pip install godot-parser)")
    mesh = SHAPES[name]
    (tmp_path / "shape.tscn").write_text(to_tscn(mesh, ODD, 64.0), encoding="utf-8")
    body, drawn, *pieces = godot.GDScene.load(str(tmp_path / "shape.tscn")).get_nodes()
    assert (body.type, drawn.type, drawn.parent) == ("StaticBody2D", "Polygon2D", ".")
    assert not set(body.name) & set('.:@/"%\\\n') and "Käse" in body.name
    np.testing.assert_allclose(points_of(drawn.properties["polygon"].args), 64.0 * mesh.vertices, atol=1e-6)
    assert [tuple(face.args) for face in drawn.properties["polygons"]] == list(mesh.faces)
    assert {(piece.type, piece.parent) for piece in pieces} == {("CollisionPolygon2D", ".")}
    assert len({piece.name for piece in pieces}) == len(pieces)
    assert_pieces_of(mesh, [points_of(piece.properties["polygon"].args) for piece in pieces], 64.0, 1e-8)


@pytest.mark.parametrize("size", [0.0, -3.0, float("nan")])
def test_size__that_is_none_is_refused(size: float) -> None:
    for write in (to_convex_json, to_tscn):
        with pytest.raises(ConfigError, match=r"size .*: expected the side of the picture"):
            write(QUAD, "quad", size)
