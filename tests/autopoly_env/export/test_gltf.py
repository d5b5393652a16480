"""glTF: what is in the file by hand-written reading, and what trimesh, an independent reader, makes of it."""

import base64
import json
import re
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from autopoly_env.errors import ConfigError, SequenceError
from autopoly_env.export.gltf import save_gltf
from autopoly_env.export.solid import APART
from autopoly_env.mesh import PolyMesh
from autopoly_env.sequence import ConstructionSequence
from tests.helpers.sequences import SCORE, gabled, walked

SEQUENCES = [gabled(), walked(1, 20, 0.002), walked(2, 30), walked(3, 30, 0.02)]
COMPONENTS = {"SCALAR": 1, "VEC3": 3}


def read_file(path: Path) -> tuple[dict[str, Any], bytes]:
    """The JSON and the buffer of a .gltf or .glb file."""
    content = path.read_bytes()
    if path.suffix == ".gltf":
        document = json.loads(content)
        return document, base64.b64decode(document["buffers"][0]["uri"].split(",")[1])
    magic, version, length, n_text, kind = struct.unpack_from("<4sIII4s", content)
    assert (magic, version, length, kind) == (b"glTF", 2, len(content), b"JSON") and n_text % 4 == 0
    n_data, kind = struct.unpack_from("<I4s", content, 20 + n_text)
    assert kind == b"BIN\0" and n_data % 4 == 0 and 28 + n_text + n_data == length
    return json.loads(content[20 : 20 + n_text]), content[28 + n_text :]


def values(document: dict[str, Any], data: bytes, accessor: int) -> np.ndarray:
    """What an accessor stands for, its bounds and alignment checked."""
    entry = document["accessors"][accessor]
    view = document["bufferViews"][entry["bufferView"]]
    kind = {5126: "<f4", 5125: "<u4"}[entry["componentType"]]
    n = COMPONENTS[entry["type"]]
    assert view["byteOffset"] % 4 == 0 and view["byteLength"] == 4 * n * entry["count"]
    array = np.frombuffer(data, kind, n * entry["count"], view["byteOffset"]).reshape(entry["count"], n)
    np.testing.assert_array_equal(array.min(axis=0), np.array(entry["min"], kind))
    np.testing.assert_array_equal(array.max(axis=0), np.array(entry["max"], kind))
    return array[:, 0] if n == 1 else array


@pytest.mark.parametrize("suffix", [".gltf", ".glb"])
@pytest.mark.parametrize("depth", [0.0, 0.25])
@pytest.mark.parametrize("sequence", SEQUENCES, ids=lambda sequence: sequence.settings["target"])
def test_every_step__has_the_area_of_its_mesh(
    tmp_path: Path, sequence: ConstructionSequence, depth: float, suffix: str
) -> None:
    document, data = read_file(save_gltf(sequence, tmp_path / f"mesh{suffix}", depth))
    meshes = sequence.meshes()
    assert [shape["name"] for shape in document["meshes"][len(meshes) :]] in ([], [f"{len(meshes) - 1} done"])
    assert document["buffers"][0]["byteLength"] <= len(data)
    for mesh, shape, node in zip([*meshes, meshes[-1]], document["meshes"], document["nodes"], strict=False):
        (primitive,) = shape["primitives"]
        points = values(document, data, primitive["attributes"]["POSITION"]) + np.array(node["translation"])
        points = np.where(np.abs(points[:, 2:]) < 1e-6, points * (1, 1, 0), points)
        a, b, c = (points[corners] for corners in values(document, data, primitive["indices"]).reshape(-1, 3).T)
        towards_viewer = np.cross(b - a, c - a)[:, 2][(a[:, 2] == 0) & (b[:, 2] == 0) & (c[:, 2] == 0)]
        assert 0.5 * towards_viewer.sum() == pytest.approx(mesh.face_areas().sum(), abs=1e-6)
        assert set(np.unique(points[:, 2])) == {0.0, -depth}
        gaps = points[:, None, :2] - (mesh.vertices * (1, -1) + (0, 1))
        assert np.linalg.norm(gaps, axis=2).min(axis=1).max() < 2 * APART


def test_house__shows_one_step_a_second(tmp_path: Path) -> None:
    document, data = read_file(save_gltf(gabled(), tmp_path / "house.glb"))
    (animation,) = document["animations"]
    shown: dict[int, list[tuple[float, float]]] = {}
    for channel in animation["channels"]:
        sampler = animation["samplers"][channel["sampler"]]
        if channel["target"]["path"] == "scale":
            assert sampler["interpolation"] == "STEP"
            keys = values(document, data, sampler["input"]), values(document, data, sampler["output"])[:, 0]
            shown[channel["target"]["node"]] = [(float(t), float(s)) for t, s in zip(*keys, strict=True)]
    assert shown == {
        0: [(0, 1), (1, 0)],
        1: [(0, 0), (1, 1), (2, 0)],
        2: [(0, 0), (2, 1), (3, 0)],
        3: [(0, 0), (3, 1), (pytest.approx(3.6), 0)],
        4: [(0, 0), (pytest.approx(3.6), 1), (4, 1)],
    }
    assert [node.get("scale") for node in document["nodes"]] == [[0, 0, 0]] * 4 + [None, None]
    assert [node.get("translation") for node in document["nodes"]] == [[0.5625, 0.5625, 0]] * 5 + [None]
    assert [node["name"] for node in document["nodes"]][-3:] == ["3 edge_extrude", "3 done", "house"]
    (extruded, done) = (shape["primitives"][0] for shape in document["meshes"][-2:])
    assert "targets" in extruded and "targets" not in done and extruded["attributes"] == done["attributes"]


def test_house__moves_its_vertices_from_where_the_operator_left_them(tmp_path: Path) -> None:
    document, data = read_file(save_gltf(gabled(), tmp_path / "house.gltf", depth=0.1))
    targets = [shape["primitives"][0].get("targets") for shape in document["meshes"][:-1]]
    offsets = [values(document, data, target[0]["POSITION"]).tolist() if target else None for target in targets]
    gable = [[0, 0, 0]] * 4 + [[0, -0.125, 0]]
    wall = [[0, 0, 0]] * 5 + [[-0.125, 0, 0]] * 2
    assert offsets == [None, 2 * gable, None, 2 * wall]
    weights = [c["target"]["node"] for c in document["animations"][0]["channels"] if c["target"]["path"] == "weights"]
    assert weights == [1, 3] and document["meshes"][1]["weights"] == [0.0]


@pytest.mark.parametrize("depth", [0.0, 0.25])
@pytest.mark.parametrize("suffix", [".gltf", ".glb"])
def test_trimesh__reads_the_same_shapes(tmp_path: Path, suffix: str, depth: float) -> None:
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed (pip install trimesh)")
    for sequence in (gabled(), walked(2, 30)):  # without a face that crosses itself
        scene = trimesh.load_scene(save_gltf(sequence, tmp_path / f"mesh{suffix}", depth), process=False)
        names = [f"{k} {s}" for k, s in enumerate(["start", *(step.operator for step in sequence.steps)])]
        assert {name for name in scene.geometry if not name.endswith(" done")} == set(names)
        for name, mesh in zip(names, sequence.meshes(), strict=True):
            edges = mesh.vertices[mesh.topology.boundary_half_edges]
            rim = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1).sum()
            area = mesh.face_areas().sum()
            shape = scene.geometry[name]
            assert shape.area == pytest.approx((2 * area + depth * rim) if depth else area, rel=1e-4)
            if depth:
                assert shape.is_watertight and shape.volume == pytest.approx(area * depth, rel=1e-4)


@pytest.mark.parametrize("depth", [0.0, 0.25])
def test_box_in_trimesh__is_that_of_the_last_mesh(tmp_path: Path, depth: float) -> None:
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed (pip install trimesh)")
    for sequence in SEQUENCES:
        scene = trimesh.load_scene(save_gltf(sequence, tmp_path / "mesh.glb", depth), process=False)
        places = sequence.final().vertices * (1, -1) + (0, 1)
        expected = [[*places.min(axis=0), -depth], [*places.max(axis=0), 0.0]]
        np.testing.assert_allclose(scene.bounds, expected, atol=1e-5)


def test_start_alone__is_a_still(tmp_path: Path) -> None:
    still = ConstructionSequence.record({}, PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75), SCORE, [])
    document, _ = read_file(save_gltf(still, tmp_path / "still.glb"))
    assert [node["name"] for node in document["nodes"]] == ["0 start", "AutoPoly"]


def test_name__may_hold_anything(tmp_path: Path) -> None:
    document, _ = read_file(save_gltf(gabled('"},\n<script>é\ud800\x00'), tmp_path / "house.gltf"))
    assert document["nodes"][-1]["name"] == '"}, <script>é'


@pytest.mark.parametrize("name", ["house.obj", "house", "house.gltf.txt"])
def test_another_suffix__is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(ConfigError, match=re.escape("expected a file name that ends in .gltf (text) or .glb (binary)")):
        save_gltf(gabled(), tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_vertex_that_is_not_finite__is_refused(tmp_path: Path) -> None:
    mesh = PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75)
    broken = ConstructionSequence({}, mesh.with_vertices(mesh.vertices * np.nan), SCORE)
    with pytest.raises(SequenceError, match="step 0: a vertex is not finite"):
        save_gltf(broken, tmp_path / "mesh.glb")
    assert not list(tmp_path.iterdir())
