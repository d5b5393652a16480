"""What Python packages make of files: `python readers.py READER FILE...` prints JSON. Runs alone, in any environment.

`area` is what the reader has for the surface, in squares of its own units, `volume` for a solid, `box` its corners.
"""

import json
import sys
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any

Measured = dict[str, Any]


def trimesh(path: str) -> Measured:
    package = import_module("trimesh")
    scene = package.load_scene(path)
    mesh = scene.to_mesh()
    found = {"area": float(mesh.area), "box": scene.bounds.tolist()}
    return found | ({"volume": float(mesh.volume)} if mesh.is_watertight else {})


def meshio(path: str) -> Measured:
    """It measures nothing itself: the shoelace formula over its cells, n-gons among them."""
    np = import_module("numpy")
    mesh = import_module("meshio").read(path)
    area = volume = 0.0
    for block in mesh.cells:
        for cell in block.data:
            ring = np.asarray(mesh.points)[cell]
            normal = sum(np.cross(ring[k] - ring[0], ring[k + 1] - ring[0]) for k in range(1, len(ring) - 1))
            area += 0.5 * float(np.linalg.norm(normal))
            volume += float(ring[0] @ normal) / 6.0
    return {"area": area, "volume": volume, "box": [mesh.points.min(0).tolist(), mesh.points.max(0).tolist()]}


def pyvista(path: str) -> Measured:
    read = import_module("pyvista").read(path)
    mesh = read if hasattr(read, "area") else read.combine().extract_surface()
    x0, x1, y0, y1, z0, z1 = mesh.bounds
    return {"area": float(mesh.area), "volume": float(mesh.volume), "box": [[x0, y0, z0], [x1, y1, z1]]}


def open3d(path: str) -> Measured:
    mesh = import_module("open3d").io.read_triangle_mesh(path)
    mesh.merge_close_vertices(1e-9)
    low, high = mesh.get_min_bound(), mesh.get_max_bound()
    found: Measured = {"area": float(mesh.get_surface_area()), "box": [low.tolist(), high.tolist()]}
    return found | ({"volume": float(mesh.get_volume())} if mesh.is_watertight() else {})


def pymeshlab(path: str) -> Measured:
    meshes = import_module("pymeshlab").MeshSet()
    meshes.load_new_mesh(path)
    meshes.meshing_merge_close_vertices(threshold=import_module("pymeshlab").PureValue(1e-9))
    values = meshes.get_geometric_measures()
    box = meshes.current_mesh().bounding_box()
    found: Measured = {"area": float(values["surface_area"]), "box": [box.min().tolist(), box.max().tolist()]}
    return found | ({"volume": float(values["mesh_volume"])} if "mesh_volume" in values else {})


def igl(path: str) -> Measured:
    package = import_module("igl")
    np = import_module("numpy")
    vertices, faces = package.read_triangle_mesh(path)[:2]
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    volume = float(np.linalg.det(np.stack((a, b, c), axis=1)).sum() / 6.0)
    area = float(np.asarray(package.doublearea(vertices, faces)).sum() / 2.0)
    return {"area": area, "volume": volume, "box": [vertices.min(0).tolist(), vertices.max(0).tolist()]}


def manifold3d(path: str) -> Measured:
    """Of a 3MF, which trimesh reads for it."""
    np, package = import_module("numpy"), import_module("manifold3d")
    mesh = import_module("trimesh").load_mesh(path)
    solid = package.Manifold(package.Mesh(np.asarray(mesh.vertices, "f4"), np.asarray(mesh.faces, "u4")))
    if solid.status() != package.Error.NoError:
        raise ValueError(str(solid.status()))
    return {"area": float(solid.surface_area()), "volume": float(solid.volume())}


def svgelements(path: str) -> Measured:
    """The area of everything filled that it lists, by the shoelace formula over the ends of its segments."""
    package = import_module("svgelements")
    area = 0.0
    for element in package.SVG.parse(path).elements():
        if isinstance(element, package.Path) and element.fill.value is not None:
            points = [(segment.end.x, segment.end.y) for segment in element if segment.end is not None]
            area += 0.5 * abs(
                sum(p[0] * q[1] - q[0] * p[1] for p, q in zip(points, points[1:] + points[:1], strict=True))
            )
    return {"area": area}


def svgpathtools(path: str) -> Measured:
    package = import_module("svgpathtools")
    paths, attributes = package.svg2paths(path)
    faces = [p for p, a in zip(paths, attributes, strict=True) if "face-" in a.get("id", "") and p.isclosed()]
    return {"area": float(sum(abs(face.area()) for face in faces))}


def ezdxf(path: str) -> Measured:
    """The area between the outlines: they run round the material, holes the other way. It has nothing to repair."""
    np = import_module("numpy")
    drawing = import_module("ezdxf").readfile(path)
    audit = drawing.audit()
    if audit.errors or audit.fixes:
        raise ValueError(f"{len(audit.errors)} errors, {len(audit.fixes)} repaired")
    total = 0.0
    for line in drawing.modelspace().query("LWPOLYLINE[layer=='CUT']"):
        x, y = np.array([point[:2] for point in line]).T
        total += 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
    return {"area": abs(total)}


def usd(path: str) -> Measured:
    """None of its validators has anything to say."""
    package, np = import_module("pxr.UsdGeom"), import_module("numpy")
    stage = import_module("pxr.Usd").Stage.Open(path)
    validation = import_module("pxr.UsdValidation")
    validators = validation.ValidationRegistry().GetOrLoadAllValidators()
    if said := validation.ValidationContext(validators).Validate(stage):
        raise ValueError(said[0].GetMessage())
    area = volume = 0.0
    for prim in stage.Traverse():
        if not prim.IsA(package.Mesh):
            continue
        mesh = package.Mesh(prim)
        points = np.array(mesh.GetPointsAttr().Get(), float)
        corners = np.array(mesh.GetFaceVertexIndicesAttr().Get())
        at = 0
        for n in mesh.GetFaceVertexCountsAttr().Get():
            ring = points[corners[at : at + n]]
            at += n
            normal = sum(np.cross(ring[k] - ring[0], ring[k + 1] - ring[0]) for k in range(1, n - 1))
            area += 0.5 * float(np.linalg.norm(normal))
            volume += float(ring[0] @ normal) / 6.0
    return {"area": area, "volume": volume}


def pytiled_parser(path: str) -> Measured:
    (layer,) = import_module("pytiled_parser").parse_map(Path(path)).layers
    rings = [[(point.x, point.y) for point in thing.points] for thing in layer.tiled_objects]
    return {"area": 0.5 * sum(abs(_shoelace(ring)) for ring in rings)}


def godot_parser(path: str) -> Measured:
    """The collision shapes."""
    nodes = import_module("godot_parser").GDScene.load(path).get_nodes()
    flat = [node.properties["polygon"].args for node in nodes if node.type == "CollisionPolygon2D"]
    return {"area": 0.5 * sum(abs(_shoelace(list(zip(ring[::2], ring[1::2], strict=True)))) for ring in flat)}


def _shoelace(points: list[tuple[float, float]]) -> float:
    return sum(p[0] * q[1] - q[0] * p[1] for p, q in zip(points, points[1:] + points[:1], strict=True))


PACKAGES = {  # what each is called on PyPI
    trimesh: "trimesh", meshio: "meshio", pyvista: "pyvista", open3d: "open3d", pymeshlab: "pymeshlab", igl: "libigl",
    manifold3d: "manifold3d", svgelements: "svgelements", svgpathtools: "svgpathtools", ezdxf: "ezdxf", usd: "usd-core",
    pytiled_parser: "pytiled-parser", godot_parser: "godot-parser",
}  # fmt: skip


def main(name: str, paths: list[str]) -> None:
    (read, package) = next((read, package) for read, package in PACKAGES.items() if read.__name__ == name)
    found = []
    for path in paths:
        try:
            found.append(read(path) if Path(path).exists() else {"error": "no such file"})
        except Exception as error:
            found.append({"error": f"{type(error).__name__}: {error}"[:200]})
    print("\n" + json.dumps({"version": version(package), "found": found}))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
