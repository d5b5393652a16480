"""DXF and USD, read back with the packages that write them; and what is said where they are not installed."""

import sys
from pathlib import Path

import numpy as np
import pytest

from autopoly_env.errors import ConfigError
from autopoly_env.export.dxf import FOLDS, LAYER, to_dxf
from autopoly_env.export.usd import save_usd
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import OPERATORS
from tests.helpers.shapes import hourglass, polygon, star

QUAD = PolyMesh.rectangle(0.25, 0.125, 0.75, 0.5)
RING = OPERATORS["face_delete"].apply(PolyMesh.grid(3, 0.1, 0.1, 0.9, 0.9), 4)  # 8 quads around a hole
SHAPES = {"quad": QUAD, "ring": RING, "pinch": hourglass(), "star": polygon(star(3, 17))}
ODD = '<b>"Käse\\" & </b>'


def shoelace(points: np.ndarray) -> float:
    x, y = points.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


@pytest.mark.parametrize("name", SHAPES)
def test_dxf__has_the_outlines_in_millimetres(name: str, tmp_path: Path) -> None:
    ezdxf = pytest.importorskip("ezdxf", reason="ezdxf is not installed (pip install ezdxf)")
    mesh = SHAPES[name]
    (tmp_path / "shape.dxf").write_text(to_dxf(mesh, 80.0), encoding="utf-8")
    drawing = ezdxf.readfile(tmp_path / "shape.dxf")
    assert drawing.units == ezdxf.units.MM and not drawing.audit().has_errors
    lines = drawing.modelspace().query("LWPOLYLINE")
    loops = [np.array([point[:2] for point in line]) for line in lines]
    assert all(line.closed and line.dxf.layer == LAYER for line in lines)
    areas = [shoelace(loop) for loop in loops]
    assert sum(areas) == pytest.approx(80.0**2 * mesh.face_areas().sum()) and max(areas) > 0.0
    assert sum(area < 0.0 for area in areas) == mesh.topology.n_holes
    low = np.vstack(loops).min(axis=0)
    np.testing.assert_allclose(low, 80.0 * np.array((mesh.vertices[:, 0].min(), 1.0 - mesh.vertices[:, 1].max())))


def test_dxf_with_layers__has_inner_edges_on_one_that_is_off(tmp_path: Path) -> None:
    ezdxf = pytest.importorskip("ezdxf", reason="ezdxf is not installed (pip install ezdxf)")
    (tmp_path / "ring.dxf").write_text(to_dxf(RING, layers=True), encoding="utf-8")
    drawing = ezdxf.readfile(tmp_path / "ring.dxf")
    lines = drawing.modelspace().query("LINE")
    assert {line.dxf.layer for line in lines} == {FOLDS} and len(lines) == 8
    assert drawing.layers.get(FOLDS).is_off() and not drawing.layers.get(LAYER).is_off()


@pytest.mark.parametrize("suffix", [".usda", ".usdc"])
@pytest.mark.parametrize("depth", [0.0, 0.25])
@pytest.mark.parametrize("name", SHAPES)
def test_usd__has_quads_and_triangles_that_stay_as_they_are(
    name: str, depth: float, suffix: str, tmp_path: Path
) -> None:
    pytest.importorskip("pxr", reason="usd-core is not installed (pip install usd-core)")
    from pxr import Usd, UsdGeom

    mesh = SHAPES[name]
    stage = Usd.Stage.Open(str(save_usd(mesh, tmp_path / f"shape{suffix}", depth, ODD)))
    assert UsdGeom.GetStageUpAxis(stage) == "Y" and UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    prim = stage.GetDefaultPrim()
    shape = UsdGeom.Mesh(prim)
    assert prim.GetDisplayName() == ODD and shape.GetSubdivisionSchemeAttr().Get() == "none"
    points = np.array(shape.GetPointsAttr().Get(), np.float64)
    counts = list(shape.GetFaceVertexCountsAttr().Get())
    corners = np.split(np.array(shape.GetFaceVertexIndicesAttr().Get()), np.cumsum(counts)[:-1])
    assert set(counts) <= {3, 4}
    assert UsdGeom.Mesh.ValidateTopology(np.concatenate(corners).tolist(), counts, len(points))[0]
    fans = [(face[0], face[k], face[k + 1]) for face in corners for k in range(1, len(face) - 1)]
    area = mesh.face_areas().sum()
    if depth:
        assert np.linalg.det(points[fans]).sum() / 6.0 == pytest.approx(area * depth, rel=1e-5)
    else:
        assert sum(shoelace(points[face, :2]) for face in corners) == pytest.approx(area, rel=1e-5)
        assert all(shoelace(points[list(fan), :2]) > 0.0 for fan in fans)
    extent = np.array(shape.GetExtentAttr().Get())
    np.testing.assert_allclose(extent, (points.min(axis=0), points.max(axis=0)))


def test_usd__is_the_same_twice_and_refuses_other_endings(tmp_path: Path) -> None:
    pytest.importorskip("pxr", reason="usd-core is not installed (pip install usd-core)")
    one, two = (save_usd(QUAD, tmp_path / name).read_bytes() for name in ("one.usdc", "two.usdc"))
    assert one == two
    with pytest.raises(ConfigError, match=r"expected a file name that ends in \.usda \(text\) or \.usdc"):
        save_usd(QUAD, tmp_path / "quad.usdz")
    with pytest.raises(ConfigError, match="depth -1"):
        save_usd(QUAD, tmp_path / "quad.usda", -1.0)


def test_format_without_its_package__is_one_line_with_the_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in ("ezdxf", "pxr", "pxr.Usd"):
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(ConfigError, match=r"^dxf needs the package ezdxf, .* pip install -e '\.\[dxf\]'"):
        to_dxf(QUAD)
    with pytest.raises(ConfigError, match=r"^usd needs the package usd-core, .* pip install -e '\.\[usd\]'"):
        save_usd(QUAD, tmp_path / "quad.usda")
    assert not list(tmp_path.iterdir())
