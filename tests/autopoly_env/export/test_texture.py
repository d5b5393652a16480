"""The picture on the mesh: places in it, and glTF and OBJ as trimesh reads them."""

import io
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from autopoly_env.errors import SilhouetteError
from autopoly_env.export.gltf import save_gltf
from autopoly_env.export.obj import save_textured_obj
from autopoly_env.export.texture import load_texture
from autopoly_env.mesh import PolyMesh
from autopoly_env.sequence import ConstructionSequence
from tests.helpers.sequences import SCORE

SQUARE = PolyMesh.rectangle(0.0, 0.0, 1.0, 1.0)
DEPTHS = (0.0, 0.25)


def four_colours(width: int = 64, height: int = 64, mode: str = "RGB") -> Image.Image:
    """Red above left, green above right, blue below left, white below right, which is clear where there is alpha."""
    picture = Image.new("RGBA", (width, height), (255, 255, 255, 0))
    for colour, x, y in (("red", 0, 0), ("lime", 1, 0), ("blue", 0, 1)):
        picture.paste(colour, (x * width // 2, y * height // 2, (x + 1) * width // 2, (y + 1) * height // 2))
    return picture if mode == "RGBA" else picture.convert(mode)


def colours_at(mesh: Any) -> dict[tuple[float, float], tuple[int, ...]]:
    """The colour that each vertex of a textured mesh of trimesh has, by its place; its uv is u right, v up."""
    uv, material = mesh.visual.uv, mesh.visual.material
    picture = np.asarray(getattr(material, "baseColorTexture", None) or material.image)
    height, width = picture.shape[:2]
    found = {}
    for (x, y, _), (u, v) in zip(mesh.vertices.tolist(), uv.tolist(), strict=True):
        column, row = (min(max(int(share * n), 0), n - 1) for share, n in ((u, width), (1.0 - v, height)))
        found[(round(x, 4), round(y, 4))] = tuple(picture[row, column].tolist())
    return found


def test_places__are_the_pictures_own() -> None:
    wide, tall = (load_texture(four_colours(*size)) for size in ((64, 32), (32, 64)))
    assert (wide.shape, tall.shape) == ((32, 64), (64, 32))
    np.testing.assert_allclose(wide.places(np.array([(0, 0.25), (1, 0.75), (0.5, 0.5)])), [(0, 0), (1, 1), (0.5, 0.5)])
    np.testing.assert_allclose(tall.places(np.array([(0.25, 0), (0.75, 1), (0, 0)])), [(0, 0), (1, 1), (-0.5, 0)])


@pytest.mark.parametrize("mode", ["RGB", "L", "1"])
def test_texture__keeps_colours(mode: str) -> None:
    read = Image.open(io.BytesIO(load_texture(four_colours(mode=mode)).png))
    assert read.mode == "RGB"
    np.testing.assert_allclose(np.asarray(read), np.asarray(four_colours(mode=mode).convert("RGB"), int), atol=1)


def test_what_is_clear__takes_the_nearest_colour() -> None:
    read = Image.open(io.BytesIO(load_texture(four_colours(mode="RGBA")).png))
    assert read.mode == "RGB" and read.getpixel((40, 63)) == (0, 0, 255) and read.getpixel((63, 40)) == (0, 255, 0)
    nothing = Image.new("RGBA", (8, 8), (9, 9, 9, 0))
    assert load_texture(nothing).shape == (8, 8)


@pytest.mark.parametrize("depth", DEPTHS)
@pytest.mark.parametrize("suffix", [".gltf", ".glb"])
def test_gltf__has_each_vertex_at_its_place_in_the_picture(suffix: str, depth: float, tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed (pip install trimesh)")
    still = ConstructionSequence.record({}, SQUARE, SCORE, [])
    texture = load_texture(four_colours())
    scene = trimesh.load_scene(save_gltf(still, tmp_path / f"square{suffix}", depth, texture), process=False)
    (mesh,) = scene.geometry.values()
    mesh.apply_transform(scene.graph.get(scene.graph.nodes_geometry[0])[0])
    assert colours_at(mesh) == {
        (0, 1): (255, 0, 0), (1, 1): (0, 255, 0), (0, 0): (0, 0, 255), (1, 0): (255, 255, 255)
    }  # fmt: skip


@pytest.mark.parametrize("depth", DEPTHS)
@pytest.mark.parametrize("triangles", [False, True])
def test_obj__has_each_vertex_at_its_place_in_the_picture(depth: float, triangles: bool, tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed (pip install trimesh)")
    texture = load_texture(four_colours())
    path = save_textured_obj(SQUARE, tmp_path / "a <b> & c.obj", texture, depth, triangles=triangles)
    assert {file.name for file in tmp_path.iterdir()} == {"a <b> & c.obj", "a_<b>_&_c.mtl", "a_<b>_&_c.texture.png"}
    mesh = trimesh.load_mesh(path, process=False)
    assert colours_at(mesh) == {
        (0, 1): (255, 0, 0), (1, 1): (0, 255, 0), (0, 0): (0, 0, 255), (1, 0): (255, 255, 255)
    }  # fmt: skip


def test_texture__that_is_no_picture_is_refused(tmp_path: Path) -> None:
    (tmp_path / "text.png").write_text("no image")
    with pytest.raises(SilhouetteError, match=re.escape("is not an image that can be read")):
        load_texture(tmp_path / "text.png")
