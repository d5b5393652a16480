"""Draws docs/pictures/blender-next.png: `python docs/draw_next.py [FOLDER]`, which needs Blender.

The example silhouette of a padlock is solved in the modeller's style, which makes it symmetric. Its half goes to
Blender as OBJ, where it gets Mirror, then others of Blender's modifiers; each picture is rendered there.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

from agents.registry import make_agent
from autopoly_env import viewer
from autopoly_env.errors import OutputError
from autopoly_env.export.blender import find_blender
from autopoly_env.export.obj import to_obj
from autopoly_env.export.sheet import save_png
from autopoly_env.mesh import PolyMesh
from autopoly_env.silhouette import load_silhouette
from autopoly_env.simulator import Simulator

SIZE, LINE = 300, 22  # pixels: a side of a picture, and the height of its caption
SILHOUETTE = Path(__file__).parents[1] / "examples" / "padlock.png"
PICTURES = Path(__file__).parent / "pictures"

SMOOTH = ["SUBSURF", {"levels": 2, "render_levels": 2}]
SOLID = ["SOLIDIFY", {"thickness": 0.12}]
BEVELLED = ["BEVEL", {"width": 0.012, "segments": 3}]
MIRROR = ["MIRROR", {}]
STACKS = {
    "--half": [],
    "Mirror": [MIRROR],
    "Mirror, Subdivision": [MIRROR, SMOOTH],
    "Mirror, Solidify": [MIRROR, SOLID],
    "Mirror, Solidify, Bevel": [MIRROR, SOLID, BEVELLED],
    "Mirror, Solidify, Subdivision": [MIRROR, SOLID, SMOOTH],
}

IN_BLENDER = """
import json, sys, bpy
from mathutils import Vector
source, stacks, size = sys.argv[sys.argv.index("--") + 1 :]


def material(name, colour, roughness):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value, shader.inputs["Roughness"].default_value = colour, roughness
    return made


bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.wm.obj_import(filepath=source, forward_axis="Y", up_axis="Z")
scene = bpy.context.scene
(thing,) = scene.objects
lines = thing.copy()
lines.data = thing.data.copy()
scene.collection.objects.link(lines)
for which, colour, roughness in ((thing, (0.32, 0.47, 0.76, 1), 0.6), (lines, (0.01, 0.015, 0.03, 1), 1.0)):
    which.data.materials.clear()
    which.data.materials.append(material(which.name, colour, roughness))
camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
camera.location, camera.data.lens = (0.75, -0.85, 2.0), 84
camera.rotation_euler = (Vector((-0.02, 0.45, -0.05)) - camera.location).to_track_quat("-Z", "Y").to_euler()
light = bpy.data.objects.new("light", bpy.data.lights.new("light", "SUN"))
light.data.energy, light.rotation_euler = 2.2, (0.5, 0.35, 0.0)
for made in (camera, light):
    scene.collection.objects.link(made)
world = scene.world = bpy.data.worlds.new("world")
world.use_nodes = True
world.node_tree.nodes["Background"].inputs[0].default_value = (1, 1, 1, 1)
world.node_tree.nodes["Background"].inputs[1].default_value = 0.45
scene.camera, scene.render.engine = camera, "CYCLES"
scene.cycles.samples, scene.cycles.use_denoising = 48, False
scene.render.resolution_x = scene.render.resolution_y = int(size)
scene.render.film_transparent, scene.view_settings.view_transform = True, "Standard"
with open(stacks) as stream:
    asked = json.load(stream)
for picture, stack in asked:
    for which in (thing, lines):
        which.modifiers.clear()
        for kind, values in stack:
            modifier = which.modifiers.new(kind, kind)
            for name, value in values.items():
                setattr(modifier, name, value)
    wires = lines.modifiers.new("wires", "WIREFRAME")
    wires.thickness, wires.use_even_offset, wires.offset = 0.006, False, 0.0
    scene.render.filepath = picture
    bpy.ops.render.render(write_still=True)
"""


def main(folder: Path = PICTURES) -> None:
    """Write the picture: three columns, a caption below each."""
    simulator = Simulator(load_silhouette(SILHOUETTE), operators="modeller", faces="quads", symmetry="auto", align=True)
    frames = rendered(make_agent("quads").solve(simulator).mesh)
    page = Image.new("RGBA", (3 * SIZE, 2 * (SIZE + LINE)), viewer.PAPER)
    for k, (caption, frame) in enumerate(zip(STACKS, frames, strict=True)):
        x, y = k % 3 * SIZE, k // 3 * (SIZE + LINE)
        page.alpha_composite(frame, (x, y))
        letters = ImageFont.load_default(14)
        left = x + (SIZE - letters.getlength(caption)) / 2
        ImageDraw.Draw(page).text((left, y + SIZE), caption, viewer.SOFT_INK, letters)
    save_png(page.convert("RGB"), folder / "blender-next.png")


def rendered(mesh: PolyMesh) -> list[Image.Image]:
    """What Blender makes of the mesh's half, a picture (RGBA) for each stack of modifiers."""
    with tempfile.TemporaryDirectory() as name:
        source, stacks, script = Path(name, "half.obj"), Path(name, "stacks.json"), Path(name, "script.py")
        pictures = [Path(name, f"{k}.png") for k in range(len(STACKS))]
        source.write_text(to_obj(mesh, half=True))
        stacks.write_text(json.dumps(list(zip(map(str, pictures), STACKS.values(), strict=True))))
        script.write_text(IN_BLENDER)
        told = [find_blender(), "-b", "--factory-startup", "--python", str(script), "--"]
        subprocess.run([*told, str(source), str(stacks), str(SIZE)], check=True, capture_output=True)
        if not all(picture.exists() for picture in pictures):
            raise OutputError("Blender made no pictures")
        return [Image.open(picture).convert("RGBA") for picture in pictures]


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
