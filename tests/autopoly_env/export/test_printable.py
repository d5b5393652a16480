"""STL and 3MF: what trimesh and manifold3d make of the files, and what is refused before it is written."""

import re
import shutil
import struct
import subprocess
import zipfile
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import assume, given

from autopoly_env.errors import ConfigError, OutputError
from autopoly_env.export.printable import TOLERANCE, Body, to_body
from autopoly_env.export.stl import save_stl, to_stl
from autopoly_env.export.threemf import MODEL, save_3mf
from autopoly_env.mesh import PolyMesh, is_sane
from autopoly_env.operators import OPERATORS
from tests.helpers.shapes import hourglass, polygon, star
from tests.helpers.strategies import meshes

QUAD = PolyMesh.rectangle(0.25, 0.125, 0.75, 0.5)
RING = OPERATORS["face_delete"].apply(PolyMesh.grid(3, 0.1, 0.1, 0.9, 0.9), 4)
SHAPES = {"quad": QUAD, "ring": RING, "pinch": hourglass(), "star": polygon(star(3, 17))}
SAVERS = {".stl": save_stl, ".3mf": save_3mf}


def read(path: Path) -> Any:
    """The mesh in a file, by trimesh, which merges the corners of STL by their places."""
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed (pip install trimesh)")
    if path.suffix == ".3mf":
        pytest.importorskip("lxml", reason="lxml, for trimesh's reader of 3MF, is not installed (pip install lxml)")
    return trimesh.load_mesh(path)


@pytest.mark.parametrize("suffix", SAVERS)
@pytest.mark.parametrize("name", SHAPES)
def test_solid__is_watertight_in_trimesh_and_of_the_right_volume(name: str, suffix: str, tmp_path: Path) -> None:
    mesh = SHAPES[name]
    body = read(SAVERS[suffix](to_body(mesh, 0.25, 80.0), tmp_path / f"body{suffix}"))
    assert body.is_watertight and body.is_winding_consistent
    assert body.volume == pytest.approx(mesh.face_areas().sum() * 80.0**2 * 20.0, rel=1e-5)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    expected = [[80 * low[0], 80 * (1 - high[1]), 0.0], [80 * high[0], 80 * (1 - low[1]), 20.0]]
    np.testing.assert_allclose(body.bounds, expected, atol=1e-3)


@pytest.mark.parametrize("suffix", SAVERS)
@pytest.mark.parametrize("name", SHAPES)
def test_flat__is_the_mesh_looking_up(name: str, suffix: str, tmp_path: Path) -> None:
    mesh = SHAPES[name]
    sheet = read(SAVERS[suffix](to_body(mesh), tmp_path / f"sheet{suffix}"))
    assert sheet.area == pytest.approx(mesh.face_areas().sum() * 1e4, rel=1e-5)
    assert not sheet.vertices[:, 2].any() and (sheet.face_normals[:, 2] > 0.0).all()


@pytest.mark.parametrize("name", SHAPES)
def test_solid__is_a_manifold_for_manifold3d(name: str) -> None:
    manifold3d = pytest.importorskip("manifold3d", reason="manifold3d is not installed (pip install manifold3d)")
    body = to_body(SHAPES[name], 0.1, 50.0)
    solid = manifold3d.Manifold(manifold3d.Mesh(body.vertices.astype(np.float32), body.triangles.astype(np.uint32)))
    assert solid.status() == manifold3d.Error.NoError
    assert solid.volume() == pytest.approx(SHAPES[name].face_areas().sum() * 50.0**2 * 5.0, rel=1e-5)


@pytest.mark.parametrize("name", SHAPES)
def test_solid__has_nothing_for_admesh_to_repair(name: str, tmp_path: Path) -> None:
    admesh = shutil.which("admesh")
    if admesh is None:
        pytest.skip("admesh is not installed (apt-get install admesh)")
    path = save_stl(to_body(SHAPES[name], 0.1, 50.0), tmp_path / "body.stl")
    said = subprocess.run([admesh, str(path)], capture_output=True, text=True, check=True).stdout
    told = {what.strip(): float(value) for what, value in re.findall(r"([A-Z][a-z ]+?) *: *(-?[\d.]+)", said)}
    repairs = ("Degenerate facets", "Edges fixed", "Facets removed", "Facets added", "Facets reversed", "Normals fixed")
    assert {what: told[what] for what in repairs} == dict.fromkeys(repairs, 0.0)
    assert told["Volume"] == pytest.approx(SHAPES[name].face_areas().sum() * 50.0**2 * 5.0, rel=1e-4)


@pytest.mark.slow
@given(meshes())
def test_every_sane_mesh__makes_a_closed_body(mesh: PolyMesh) -> None:
    assume(is_sane(mesh))
    body = to_body(mesh, 0.1)
    assert body.is_closed and body.volume == pytest.approx(mesh.face_areas().sum() * 1e5, rel=TOLERANCE)


def test_stl__is_laid_out_as_the_format_says() -> None:
    data = to_stl(to_body(QUAD, 0.5, 8.0))
    assert len(data) == 84 + 50 * 12 and struct.unpack_from("<I", data, 80) == (12,) and data[:5] != b"solid"
    normals = np.array([struct.unpack_from("<3f", data, 84 + 50 * k) for k in range(12)])
    assert sorted(map(tuple, normals.tolist())) == sorted(
        tuple(float(sign * (axis == k)) for k in range(3)) for axis in range(3) for sign in (1, -1) for _ in range(2)
    )


def test_3mf__says_millimetres_and_whether_it_is_solid(tmp_path: Path) -> None:
    kinds = []
    for depth in (0.0, 0.1):
        with zipfile.ZipFile(save_3mf(to_body(QUAD, depth), tmp_path / "quad.3mf", '<b>"&')) as package:
            root = ElementTree.fromstring(package.read(MODEL))
            assert package.testzip() is None and "[Content_Types].xml" in package.namelist()
        (made,) = root.iter("{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}object")
        assert root.get("unit") == "millimeter" and made.get("name") == '<b>"&'
        kinds.append(made.get("type"))
    assert kinds == ["surface", "model"]


def test_open_body__is_not_closed() -> None:
    whole = to_body(QUAD, 0.5)
    assert whole.is_closed and not Body(whole.vertices, whole.triangles[1:]).is_closed
    assert not Body(whole.vertices, whole.triangles[:, ::-1][[0, *range(12)]]).is_closed


@pytest.mark.parametrize("size", [0.0, -1.0, float("nan"), float("inf"), 2e6])
def test_size__that_is_none_is_refused(size: float) -> None:
    with pytest.raises(ConfigError, match=r"size .*: expected the side of the picture, above 0 and at most 1000000"):
        to_body(QUAD, 0.1, size)


def test_body__that_is_not_the_mesh_is_refused() -> None:
    flipped = QUAD.with_vertices(QUAD.vertices[[1, 0, 3, 2]])
    for depth, what in ((0.0, "area"), (0.2, "volume")):
        with pytest.raises(OutputError, match=rf"^the {what} would be -[\d.e+]+ mm., expected -.*; give a larger size"):
            to_body(flipped, depth)
    lying = PolyMesh.from_faces([*QUAD.vertices, *QUAD.vertices], [(0, 1, 2, 3), (4, 5, 6, 7)])
    with pytest.raises(OutputError, match="the solid is not watertight"):
        to_body(lying, 0.1)
