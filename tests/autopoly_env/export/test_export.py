"""Writers: OBJ and SVG read back, contact sheets counted."""

import base64
import io
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from autopoly_env import viewer
from autopoly_env.errors import ConfigError, MeshError
from autopoly_env.export import contact_sheet, from_obj, load_obj, save_png, sheet, to_obj, to_svg
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import OPERATORS, Action
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import Silhouette
from tests.helpers.shapes import hourglass, polygon, star
from tests.helpers.tables import table

QUAD = PolyMesh.rectangle(0.25, 0.125, 0.75, 0.5)
RING = OPERATORS["face_delete"].apply(PolyMesh.grid(3, 0.1, 0.1, 0.9, 0.9), 4)  # 8 quads around a hole


def read_obj(text: str) -> tuple[np.ndarray, list[list[int]]]:
    rows = [line.split() for line in text.splitlines()]
    points = np.array([[float(value) for value in row[1:]] for row in rows if row[0] == "v"])
    return points, [[int(index) - 1 for index in row[1:]] for row in rows if row[0] == "f"]


def shoelace(points: np.ndarray) -> float:
    x, y = points.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


# --- OBJ ---


def test_obj__of_a_quad_is_y_up_with_its_first_corner_first() -> None:
    assert to_obj(QUAD) == (
        "# AutoPoly: 4 vertices, 4 edges, 1 face; unit square, y up\n"
        "v 0.25 0.875 0\nv 0.75 0.875 0\nv 0.75 0.5 0\nv 0.25 0.5 0\n"
        "f 1 4 3 2\n"
    )


def test_obj__of_a_mesh_with_a_hole_keeps_every_quad() -> None:
    points, faces = read_obj(to_obj(RING))
    assert points.shape == (16, 3) and [len(face) for face in faces] == [4] * 8
    np.testing.assert_array_equal(points[:, :2], RING.vertices * (1, -1) + (0, 1))
    assert not points[:, 2].any()
    np.testing.assert_allclose([shoelace(points[face, :2]) for face in faces], 0.8 * 0.8 / 9)


ELL = PolyMesh.from_faces([(0.1, 0.1), (0.4, 0.1), (0.4, 0.5), (0.9, 0.5), (0.9, 0.9), (0.1, 0.9)], [range(6)])


def test_obj__keeps_a_concave_face_whole_and_says_so() -> None:
    _, faces = read_obj(to_obj(ELL))
    assert faces == [[0, 5, 4, 3, 2, 1]]
    says = "# 1 of them concave, which some readers fan from a corner: agents.export --to obj --triangles cuts them"
    assert to_obj(ELL).splitlines()[1] == says and "concave" not in to_obj(QUAD) + to_obj(ELL, triangles=True)


@pytest.mark.parametrize("mesh", [ELL, RING, hourglass(), polygon(star(5, 31))], ids=["ell", "ring", "pinch", "star"])
def test_obj_in_triangles__has_the_right_area_in_trimesh(mesh: PolyMesh, tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed (pip install trimesh)")
    (tmp_path / "mesh.obj").write_text(to_obj(mesh, triangles=True))
    read = trimesh.load_mesh(tmp_path / "mesh.obj")
    assert read.area == pytest.approx(mesh.face_areas().sum(), rel=1e-9) and (read.face_normals[:, 2] > 0.0).all()
    assert len(read.faces) == sum(len(face) - 2 for face in mesh.faces)
    np.testing.assert_allclose(from_obj(to_obj(mesh, triangles=True)).vertices, mesh.vertices, atol=1e-15)


@given(st.lists(st.floats(0, 1), min_size=8, max_size=8))
def test_obj__keeps_every_digit_and_the_sign_of_the_area(numbers: list[float]) -> None:
    mesh = QUAD.with_vertices(np.reshape(numbers, (4, 2)))
    points, faces = read_obj(to_obj(mesh))
    np.testing.assert_array_equal(points[:, 0], mesh.vertices[:, 0])
    np.testing.assert_array_equal(points[:, 1], 1.0 - mesh.vertices[:, 1])
    assert shoelace(points[faces[0], :2]) == pytest.approx(mesh.face_areas()[0], abs=1e-12)


# --- SVG ---

NAMESPACE = "{http://www.w3.org/2000/svg}"


def group_ids(root: ET.Element, name: str) -> list[str | None]:
    (group,) = (g for g in root.iter(f"{NAMESPACE}g") if g.get("id") == name)
    return [element.get("id") for element in group]


def test_svg__has_every_element_by_its_id() -> None:
    house = OPERATORS["edge_subdivide"].apply(QUAD, QUAD.edge_index(0, 1))
    house = OPERATORS["vertex_dissolve"].apply(house, house.vertex_index(2))
    root = ET.fromstring(to_svg(house))
    assert root.get("viewBox") == "0 0 512 512"
    assert [child.get("id") for child in root] == ["faces", "edges", "vertices"]
    assert group_ids(root, "faces") == ["face-0"]
    assert group_ids(root, "vertices") == ["vertex-0", "vertex-1", "vertex-3", "vertex-4"]
    assert group_ids(root, "edges") == ["edge-0-3", "edge-0-4", "edge-1-3", "edge-1-4"]


def test_svg__places_the_unit_square_on_size_units_with_y_down() -> None:
    root = ET.fromstring(to_svg(QUAD, size=200))
    (face,) = (path for path in root.iter(f"{NAMESPACE}path") if path.get("id") == "face-0")
    assert face.get("d") == "M 50 25 L 150 25 L 150 100 L 50 100 Z"
    first = next(root.iter(f"{NAMESPACE}circle"))
    assert (first.get("cx"), first.get("cy")) == ("50", "25")


def test_svg__of_a_ring_counts_its_elements() -> None:
    root = ET.fromstring(to_svg(RING))
    assert tuple(len(group_ids(root, name)) for name in ("vertices", "edges", "faces")) == RING.counts == (16, 24, 8)


def test_svg__holds_the_target_as_a_picture() -> None:
    mask = np.zeros((6, 6), np.bool_)
    mask[1:3, 2:5] = True
    root = ET.fromstring(to_svg(QUAD, target=Silhouette(mask)))
    (image,) = root.iter(f"{NAMESPACE}image")
    kind, data = (image.get("href") or "").split(",")
    assert kind == "data:image/png;base64"
    pixels = np.asarray(Image.open(io.BytesIO(base64.b64decode(data))).convert("RGBA"))
    np.testing.assert_array_equal(pixels[..., 3] == 255, mask)
    assert tuple(pixels[1, 2, :3]) == viewer.BARE


# --- contact sheet ---


def score(total: float) -> dict[str, Any]:
    return {"iou": 0.5, "complexity": 9, "self_intersections": 0, "total": total}


def sequence_of(n_steps: int, best: int) -> ConstructionSequence:
    """A rectangle whose edges are subdivided, with the highest total after step `best`."""
    mesh, transitions = QUAD, []
    for step in range(1, n_steps + 1):
        action = Action("edge_subdivide", step % mesh.topology.n_edges)
        mesh = OPERATORS[action.operator].apply(mesh, action.element)
        transitions.append((action, None, mesh, score(90.0 if step == best else 50.0)))
    return ConstructionSequence.record({}, QUAD, score(90.0 if best == 0 else 50.0), transitions)


def target() -> Silhouette:
    mask = np.zeros((32, 32), np.bool_)
    mask[8:24, 8:24] = True
    return Silhouette(mask, "a box")


def cells_of(page: Image.Image, n_columns: int, cell: int) -> list[np.ndarray]:
    """The cells of a sheet, row by row, as (H, W, 3) pixels; blank ones at the end too."""
    pixels, height = np.asarray(page), cell + viewer.caption_height(cell, 2)
    grid = pixels[sheet.BORDER + sheet.HEADER : -sheet.BORDER, sheet.BORDER : sheet.BORDER + n_columns * cell]
    assert len(grid) % height == 0
    return [part for row in range(0, len(grid), height) for part in np.split(grid[row : row + height], n_columns, 1)]


def has_colour(pixels: np.ndarray, colour: tuple[int, int, int]) -> bool:
    return bool((pixels == colour).all(axis=-1).any())


def test_sheet__has_a_cell_for_the_start_and_one_for_each_step() -> None:
    cells = cells_of(contact_sheet(sequence_of(6, best=3), target(), columns=4), 4, 220)
    assert [bool((cell != 255).any()) for cell in cells] == [True] * 7 + [False]
    assert [has_colour(cell, sheet.ACCENT) for cell in cells] == [step == 3 for step in range(8)]
    assert [has_colour(cell, viewer.CHANGED) for cell in cells] == [1 <= step <= 6 for step in range(8)]
    assert all(has_colour(cell, viewer.MATCH) and has_colour(cell, viewer.EXCESS) for cell in cells[:7])


def test_sheet_of_a_start_alone__is_one_cell_marked_best() -> None:
    page = contact_sheet(sequence_of(0, best=0))
    cells = cells_of(page, 1, 220)
    assert len(cells) == 1 and has_colour(cells[0], sheet.ACCENT)
    assert not has_colour(np.asarray(page), viewer.BARE), "no legend for a target that is not there"


def test_sheet__names_the_part_of_each_step_where_there_are_several(monkeypatch: pytest.MonkeyPatch) -> None:
    captions: list[str] = []

    def noted(*drawn: Any, caption: str, **how: Any) -> np.ndarray:
        captions.append(caption)
        return draw_mesh(*drawn, caption=caption, **how)

    draw_mesh = viewer.draw_mesh
    monkeypatch.setattr(viewer, "draw_mesh", noted)
    contact_sheet(table())
    assert [caption.split("\n")[:2] for caption in captions] == [
        ["0  start", "body"],
        ["1  edge_subdivide", "body"],
        ["2  edge_subdivide", "body"],
        ["3  edge_extrude", "lower right, 1 of 2"],
        ["4  edge_extrude", "lower left, 2 of 2"],
    ]
    captions.clear()
    contact_sheet(table().trim(2))
    assert [len(caption.split("\n")) for caption in captions] == [2, 2, 2]


@pytest.mark.parametrize(("n_steps", "cell"), [(40, 40), (41, 30)])
def test_sheet__gets_smaller_cells_beyond_forty_steps(n_steps: int, cell: int) -> None:
    page = contact_sheet(sequence_of(n_steps, best=1), columns=10, cell=40)
    assert sum(bool((part != 255).any()) for part in cells_of(page, 10, cell)) == n_steps + 1


def test_sheet__stays_within_four_thousand_pixels() -> None:
    page = contact_sheet(sequence_of(12, best=1), columns=1, cell=500)
    assert 3700 < page.height <= 4000 and page.width <= 4000


@pytest.mark.parametrize("options", [{"columns": 0}, {"cell": 10}, {"columns": 1, "cell": 15}])
def test_sheet__refuses_cells_that_cannot_be_drawn(options: dict[str, int]) -> None:
    with pytest.raises(ConfigError):
        contact_sheet(sequence_of(2, best=1), **options)


def test_png__comes_back_as_it_was_saved(tmp_path: Path) -> None:
    page = contact_sheet(sequence_of(1, best=1), target(), cell=64)
    path = save_png(page, tmp_path / "new" / "sheet.png")
    with Image.open(path) as saved:
        np.testing.assert_array_equal(np.asarray(saved), np.asarray(page))


# --- OBJ, read ---


def test_obj__comes_back_with_its_polygons() -> None:
    for mesh in (PolyMesh.grid(2, 0.1, 0.2, 0.8, 0.9), hourglass(), polygon(star(3, 9))):
        read = from_obj(to_obj(mesh))
        assert read.faces == mesh.faces
        np.testing.assert_allclose(read.vertices, mesh.vertices, rtol=0, atol=1e-15)


def test_obj__of_other_programs_is_read() -> None:
    text = "mtllib a.mtl\no quad\nv 0.1 0.1 5\nv .9 .1 0 1.0\nv 0.9 0.9 0\nv 1e-1 0.9 0\nvn 0 0 1\nvt 0 0\ns off\n"
    for face in ("f 1/1/1 2/1/1 3/1/1 4/1/1", "f -4 -3 -2 -1", "f 4//1 3//1 2//1 1//1 # seen from behind"):
        mesh = from_obj(text + face)
        assert mesh.face_areas().tolist() == [pytest.approx(0.64)]
        assert mesh.vertices[0].tolist() == [0.1, 0.9]


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "0 vertices and 0 faces"),
        ("v 0 0 0\nf 1 2 3", "line 2 of the OBJ text, 'f 1 2 3': vertex 2 is not among the 1 so far"),
        ("v 0 0", "expected v x y z"),
        ("v 0 zero 0", "could not convert"),
        ("v 0 0 0\nv 1 0 0\nf 1 2", "at least 3 corners"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 0 1 2", "vertex 0 is not among"),
        ("v nan 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3", "vertex 0 is not finite"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3", "vertex 3 belongs to no face"),
    ],
)
def test_obj__that_is_broken_is_refused_in_one_line(text: str, complaint: str, tmp_path: Path) -> None:
    (tmp_path / "broken.obj").write_text(text)
    with pytest.raises(MeshError, match=complaint) as caught:
        load_obj(tmp_path / "broken.obj")
    assert "\n" not in str(caught.value) and "broken.obj" in str(caught.value)
