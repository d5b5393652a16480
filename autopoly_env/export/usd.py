"""USD by usd-core (the extra `usd`): the last mesh, or its solid, in quads and triangles, never subdivided."""

import os
import tempfile
from pathlib import Path
from typing import Any

from autopoly_env.errors import ConfigError
from autopoly_env.export.extras import need
from autopoly_env.export.formats import Export, Format, register_format
from autopoly_env.export.replay import finite_meshes, sequence_name
from autopoly_env.export.solid import quads_and_triangles, to_solid
from autopoly_env.files import write_atomically
from autopoly_env.mesh import PolyMesh

SUFFIXES = (".usda", ".usdc")  # text and binary


def save_usd(mesh: PolyMesh, path: str | os.PathLike[str], depth: float = 0.0, name: str = "AutoPoly") -> Path:
    """Write a mesh as a USD layer: text for the suffix .usda, binary for .usdc.

    One Mesh of convex quads and triangles, x right, y up, z towards the viewer, in metres, `subdivisionScheme` none;
    `depth` (units of the unit square) makes it a closed solid behind z = 0. Raises ConfigError without usd-core, for
    another suffix or a depth that is none, OutputError if the file cannot be written.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise ConfigError(f"{path}: expected a file name that ends in .usda (text) or .usdc (binary)")
    need("pxr.Usd", "usd-core", "usd")
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder, f"layer{suffix}")
        _save(mesh, str(made), depth, name)
        return write_atomically(path, made.read_bytes())


def _save(mesh: PolyMesh, path: str, depth: float, name: str) -> None:
    from pxr import Gf, Tf, Usd, UsdGeom, Vt

    solid = to_solid(mesh, depth)
    faces = quads_and_triangles(solid)
    stage: Any = Usd.Stage.CreateNew(path)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    shape = UsdGeom.Mesh.Define(stage, f"/{Tf.MakeValidIdentifier(name)}")
    stage.SetDefaultPrim(shape.GetPrim())
    shape.GetPrim().SetDisplayName(name)
    points = Vt.Vec3fArray.FromNumpy(solid.vertices.astype("float32"))
    shape.CreatePointsAttr(points)
    shape.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(points))
    shape.CreateFaceVertexCountsAttr([len(face) for face in faces])
    shape.CreateFaceVertexIndicesAttr([v for face in faces for v in face])
    shape.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    shape.CreateDoubleSidedAttr(not depth)
    shape.CreateDisplayColorAttr([Gf.Vec3f(0.32, 0.47, 0.76)])
    stage.GetRootLayer().Save()


def _write(export: Export, path: Path) -> Path:
    mesh = finite_meshes(export.sequence)[-1]
    return save_usd(mesh, path, export.depth, sequence_name(export.sequence))


register_format(Format("usd", SUFFIXES, "the last mesh in quads and triangles (extra usd)", _write, shows_depth=True))
