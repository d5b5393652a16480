"""What Blender makes of files, as `readers.py` tells it: `blender -b --python in_blender.py -- ANSWER FILE...`.

Where Blender is a package, `python in_blender.py -- ANSWER FILE...`.
"""

import json
import sys
import tempfile
from pathlib import Path
from typing import Any

import bpy

SIDE = 512  # user units of our drawings
SQUARE = f'<svg xmlns="http://www.w3.org/2000/svg" width="{SIDE}" height="{SIDE}" viewBox="0 0 {SIDE} {SIDE}">'
SQUARE += f'<path id="face-0" d="M 0 0 L {SIDE} 0 L {SIDE} {SIDE} L 0 {SIDE} Z"/></svg>'


def read(path: str) -> dict[str, object]:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    ending = Path(path).suffix
    if ending == ".obj":
        bpy.ops.wm.obj_import(filepath=path, forward_axis="Y", up_axis="Z")
    elif ending == ".stl":
        (bpy.ops.wm.stl_import if bpy.app.version >= (4, 2, 0) else bpy.ops.import_mesh.stl)(filepath=path)
    elif ending == ".usdc":
        bpy.ops.wm.usd_import(filepath=path)
    elif ending == ".glb":
        bpy.ops.import_scene.gltf(filepath=path, import_shading="FLAT")
        bpy.context.scene.frame_set(round(max(action.frame_range[1] for action in bpy.data.actions)))
    elif ending == ".svg":
        bpy.ops.import_curve.svg(filepath=path)
    area = volume = 0.0
    if ending == ".svg":
        return {"area": area_of_curves() * SIDE**2 / square()}
    for thing in bpy.context.scene.objects:
        if thing.type != "MESH":
            continue
        shape = thing.to_mesh()
        shape.transform(thing.matrix_world)
        area += sum(polygon.area for polygon in shape.polygons)
        shape.calc_loop_triangles()
        for triangle in shape.loop_triangles:
            a, b, c = (shape.vertices[k].co for k in triangle.vertices)
            volume += a.dot(b.cross(c)) / 6.0
    return {"area": area, "volume": volume}


def area_of_curves() -> float:
    faces = [thing for thing in bpy.context.scene.objects if thing.type == "CURVE" and "face-" in thing.name]
    return sum(inside(spline, face.matrix_world) for face in faces for spline in face.data.splines)


def square() -> float:
    """What a drawing of one square as large as ours has: the importer's units are nearly, not quite, 1/90 inch."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "square.svg").write_text(SQUARE)
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.import_curve.svg(filepath=str(Path(folder, "square.svg")))
        return area_of_curves()


def inside(spline: Any, to_world: Any) -> float:
    """The area in a curve of straight lines."""
    ring = [to_world @ point.co for point in spline.bezier_points]
    return 0.5 * abs(sum(a.x * b.y - b.x * a.y for a, b in zip(ring, ring[1:] + ring[:1], strict=True)))


def main(answer: str, paths: list[str]) -> None:
    found = []
    for path in paths:
        try:
            found.append(read(path))
        except Exception as error:
            found.append({"error": str(error).strip().splitlines()[-1][:200]})
    Path(answer).write_text(json.dumps({"version": bpy.app.version_string, "found": found}))


at = sys.argv.index("--")
main(sys.argv[at + 1], sys.argv[at + 2 :])
