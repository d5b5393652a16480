"""Draws docs/pictures/textured.png: `python docs/draw_textured.py [FOLDER]`, which needs Blender.

The example silhouette of a teapot is coloured in stripes, solved, written as glTF with that picture on it, and rendered
by Blender from aside: the sprite on the left, the mesh of it on the right.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

from agents.registry import make_agent
from autopoly_env import viewer
from autopoly_env.errors import OutputError
from autopoly_env.export.blender import find_blender
from autopoly_env.export.gltf import save_gltf
from autopoly_env.export.sheet import save_png
from autopoly_env.export.texture import load_texture
from autopoly_env.score import ScoreWeights
from autopoly_env.silhouette import load_silhouette
from autopoly_env.simulator import Simulator

SIZE = 360  # pixels a side of each of the two
DEPTH = 0.15
SILHOUETTE = Path(__file__).parents[1] / "examples" / "teapot.png"
PICTURES = Path(__file__).parent / "pictures"
STRIPES = ((222, 104, 75), (250, 196, 92), (86, 150, 160), (245, 236, 214))

IN_BLENDER = """
import sys, bpy
from mathutils import Vector
source, picture, size = sys.argv[sys.argv.index("--") + 1 :]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=source, import_shading="FLAT")
scene = bpy.context.scene
scene.frame_set(round(max(action.frame_range[1] for action in bpy.data.actions)))
camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
camera.location, camera.data.lens = (1.25, -1.95, 0.95), 70
camera.rotation_euler = (Vector((0.5, 0.05, 0.5)) - camera.location).to_track_quat("-Z", "Y").to_euler()
light = bpy.data.objects.new("light", bpy.data.lights.new("light", "SUN"))
light.data.energy, light.rotation_euler = 3.0, (0.7, 0.2, 0.5)
for thing in (camera, light):
    scene.collection.objects.link(thing)
world = scene.world = bpy.data.worlds.new("world")
world.use_nodes = True
world.node_tree.nodes["Background"].inputs[0].default_value = (1, 1, 1, 1)
world.node_tree.nodes["Background"].inputs[1].default_value = 0.6
scene.camera, scene.render.engine = camera, "CYCLES"
scene.cycles.samples, scene.cycles.use_denoising = 64, False
scene.render.resolution_x = scene.render.resolution_y = int(size)
scene.render.film_transparent, scene.view_settings.view_transform = True, "Standard"
scene.render.filepath = picture
bpy.ops.render.render(write_still=True)
"""


def main(folder: Path = PICTURES) -> None:
    """Write the picture."""
    drawn = sprite(load_silhouette(SILHOUETTE).mask)
    solution = make_agent("climb").solve(Simulator(load_silhouette(drawn), weights=ScoreWeights(w_sc=0.1)))
    with tempfile.TemporaryDirectory() as name:
        source = save_gltf(solution.sequence, Path(name, "teapot.glb"), DEPTH, load_texture(drawn))
        script, picture = Path(name, "script.py"), Path(name, "frame.png")
        script.write_text(IN_BLENDER)
        told = [find_blender(), "-b", "--factory-startup", "--python", str(script), "--"]
        subprocess.run([*told, str(source), str(picture), str(SIZE)], check=True, capture_output=True)
        if not picture.exists():
            raise OutputError("Blender made no picture")
        pair = [drawn.resize((SIZE, SIZE), Image.Resampling.LANCZOS), Image.open(picture).convert("RGBA")]
        page = Image.new("RGBA", (2 * SIZE, SIZE), viewer.PAPER)
        for k, half in enumerate(pair):
            page.alpha_composite(half, (k * SIZE, 0))
    save_png(page.convert("RGB"), folder / "textured.png")


def sprite(mask: np.ndarray) -> Image.Image:
    """The object in slanting stripes on nothing."""
    rows, columns = np.indices(mask.shape)
    colours = np.array(STRIPES, np.uint8)[(rows + columns // 2) * 12 // len(mask) % len(STRIPES)]
    return Image.fromarray(np.dstack((colours, np.where(mask, 255, 0).astype(np.uint8))))


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
