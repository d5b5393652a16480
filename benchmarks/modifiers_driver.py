"""Runs inside Blender: what its modifiers make of meshes. `blender -b --python modifiers_driver.py -- MESHES ANSWERS`.

MESHES is a JSON list of meshes, each a dict with "whole" and, where it has one, "half", [points, faces] both; ANSWERS
becomes a list of what came of each: by the modifiers' name area, volume, faces turned over, and open edges.
"""

import json
import sys

import bpy  # first: where Blender is a module of Python (pip install bpy), it brings bmesh along

# isort: split
import bmesh

THICKNESS, BEVEL = 0.05, 0.004  # units of the unit square

Modifier = tuple[str, dict[str, object]]
Shape = tuple[list[list[float]], list[list[int]]]

CATMULL_CLARK: Modifier = ("SUBSURF", {"levels": 1})
SIMPLE: Modifier = ("SUBSURF", {"levels": 1, "subdivision_type": "SIMPLE"})
SOLIDIFY: Modifier = ("SOLIDIFY", {"thickness": THICKNESS})
BEVELLED: Modifier = ("BEVEL", {"width": BEVEL, "segments": 2})
MIRROR: Modifier = ("MIRROR", {})  # as it comes, like the others but for what stands here


def modified(shape: Shape, *modifiers: Modifier) -> dict[str, float]:
    """What comes out of the modifiers, one after the other."""
    mesh = bpy.data.meshes.new("mesh")
    mesh.from_pydata(shape[0], [], shape[1])
    thing = bpy.data.objects.new("mesh", mesh)
    bpy.context.scene.collection.objects.link(thing)
    for kind, values in modifiers:
        modifier = thing.modifiers.new(kind, kind)
        for name, value in values.items():
            setattr(modifier, name, value)
    result = bmesh.new()
    result.from_object(thing, bpy.context.evaluated_depsgraph_get())
    result.normal_update()
    found = {
        "area": sum(face.calc_area() for face in result.faces),
        "volume": result.calc_volume(signed=True),
        "turned": sum(face.normal.z < 0.0 for face in result.faces),
        "open": sum(len(edge.link_faces) != 2 for edge in result.edges),
    }
    result.free()
    bpy.data.objects.remove(thing)
    bpy.data.meshes.remove(mesh)
    return found


def answer(asked: dict[str, Shape]) -> dict[str, dict[str, float]]:
    """What comes of a mesh."""
    whole = asked["whole"]
    found = {
        "simple": modified(whole, SIMPLE),
        "smooth": modified(whole, CATMULL_CLARK),
        "solid": modified(whole, SOLIDIFY),
        "bevelled": modified(whole, SOLIDIFY, BEVELLED),
    }
    return found | ({"mirrored": modified(asked["half"], MIRROR)} if "half" in asked else {})


if __name__ == "__main__":
    questions, answers = sys.argv[sys.argv.index("--") + 1 :]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with open(questions, encoding="utf-8") as stream:
        meshes = json.load(stream)
    with open(answers, "w", encoding="utf-8") as stream:
        json.dump([answer(asked) for asked in meshes], stream)
