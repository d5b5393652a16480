"""Halves of symmetric meshes: by hand, and by shapely for outlines and cuts of every kind; what OBJ and glTF say."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from autopoly_env.errors import ConfigError, OutputError
from autopoly_env.export.blender import blender_script
from autopoly_env.export.gltf import save_gltf
from autopoly_env.export.half import halved
from autopoly_env.export.obj import to_obj
from autopoly_env.mesh import PolyMesh
from autopoly_env.sequence import ConstructionSequence
from tests.helpers.sequences import SCORE
from tests.helpers.shapes import hourglass, polygon, star
from tests.helpers.vases import symmetric_meshes

OUTER = [(0.1, 0.1), (0.3, 0.1), (0.7, 0.1), (0.9, 0.1), (0.9, 0.9), (0.7, 0.9), (0.3, 0.9), (0.1, 0.9)]
INNER = [(0.3, 0.3), (0.7, 0.3), (0.7, 0.7), (0.3, 0.7)]
# Around a hole two faces: the left one reaches across the axis x = 0.5, above the hole and below it.
RING = PolyMesh.from_faces([*OUTER, *INNER], [(0, 1, 2, 9, 8, 11, 10, 5, 6, 7), (2, 3, 4, 5, 10, 9)])


def shape_of(mesh: PolyMesh) -> Any:
    return shapely.union_all([shapely.Polygon(mesh.vertices[list(face)]) for face in mesh.faces])


def test_half_of_a_ring__has_the_far_face_in_two_pieces() -> None:
    half, axis = halved(RING)
    assert axis == 0.5 and half.counts == (10, 12, 3)
    assert sorted(map(len, half.faces)) == [4, 4, 6]
    assert shape_of(half).equals(shapely.box(0.5, 0.1, 0.9, 0.9) - shapely.box(0.5, 0.3, 0.7, 0.7))


@given(symmetric_meshes())
def test_half_and_its_image__are_the_whole(mesh: PolyMesh) -> None:
    half, axis = halved(mesh)
    assert half.vertices[:, 0].min() == axis
    assert 2.0 * half.face_areas().sum() == pytest.approx(mesh.face_areas().sum(), rel=1e-9)
    image = shapely.transform(shape_of(half), lambda points: points * (-1.0, 1.0) + (2.0 * axis, 0.0))
    assert (shape_of(half) | image).symmetric_difference(shape_of(mesh)).area <= 1e-9
    wholes = [shapely.Polygon(mesh.vertices[list(face)]).buffer(1e-9) for face in mesh.faces]
    parts = [shapely.Polygon(half.vertices[list(face)]) for face in half.faces]
    assert all(any(whole.covers(part) for whole in wholes) for part in parts)


@given(symmetric_meshes(), st.booleans())
def test_obj_of_a_half__has_the_axis_at_0_and_says_so(mesh: PolyMesh, triangles: bool) -> None:
    text = to_obj(mesh, triangles=triangles, half=True)
    xs = [float(line.split()[1]) for line in text.splitlines() if line.startswith("v ")]
    assert min(xs) == 0.0 and max(xs) == pytest.approx(0.5 * np.ptp(mesh.vertices[:, 0]), abs=1e-12)
    assert "# half of a mesh, cut at x = " in text


@pytest.mark.parametrize("mesh", [hourglass(), polygon(star(3, 17))], ids=["hourglass", "star"])
def test_mesh_that_is_not_symmetric__is_one_line(tmp_path: Path, mesh: PolyMesh) -> None:
    sequence = ConstructionSequence({}, mesh, SCORE)
    for write in (
        lambda: to_obj(mesh, half=True),
        lambda: save_gltf(sequence, tmp_path / "a.glb", half=True),
        lambda: blender_script(sequence, half=True),
    ):
        with pytest.raises(OutputError, match=r"not its own mirror image about x = .* --symmetry best$"):
            write()
    assert not list(tmp_path.iterdir())


def test_half_with_thickness_or_keyframes__is_refused(tmp_path: Path) -> None:
    sequence = ConstructionSequence({}, PolyMesh.rectangle(0.0, 0.0, 1.0, 1.0), SCORE)
    with pytest.raises(ConfigError, match=r"^half with depth 0\.1: halves are flat"):
        save_gltf(sequence, tmp_path / "a.glb", 0.1, half=True)
    with pytest.raises(ConfigError, match=r"^half with depth 0\.1: halves are flat"):
        blender_script(sequence, depth=0.1, half=True)
    with pytest.raises(ConfigError, match=r"^half with keyframes: "):
        blender_script(sequence, keyframes=True, half=True)
    assert not list(tmp_path.iterdir())
