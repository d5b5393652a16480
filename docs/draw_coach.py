"""Draws docs/pictures/coach.png: `python -m docs.draw_coach [FOLDER]`, which needs Blender and a screen, or Xvfb.

The example silhouette of a chair is solved, and its lesson taught by the coach in a Blender with a window.
"""

import os
import sys
import tempfile
from pathlib import Path

from PIL import Image

from agents.registry import make_agent
from autopoly_env.errors import ConfigError
from autopoly_env.export.blender import ask_blender
from autopoly_env.export.byhand import find_screen
from autopoly_env.export.coach import save_lesson
from autopoly_env.export.sheet import save_png
from autopoly_env.silhouette import load_silhouette
from autopoly_env.simulator import Simulator
from blender.build import build

WINDOW = 1500, 950  # pixels
SHOWN = 1236, 858  # of these, from the lower left corner: the view and its sidebar
COLOURS = 256
STEP = 9
SILHOUETTE = Path(__file__).parents[1] / "examples" / "chair.png"
PICTURES = Path(__file__).parent / "pictures"
INSIDE = Path(__file__).with_name("coach_window.py")


def main(folder: Path = PICTURES) -> None:
    """Write the picture."""
    silhouette = load_silhouette(SILHOUETTE)
    simulator = Simulator(silhouette, operators="modeller", faces="quads", align=True)
    sequence = make_agent("quads").solve(simulator).sequence
    screen = find_screen()
    if not screen:
        raise ConfigError("there is no screen; apt-get install xvfb, or set DISPLAY")
    look = ("--enable-event-simulate", "--window-geometry", "0", "0", *map(str, WINDOW))
    with tempfile.TemporaryDirectory() as name:
        own, picture = Path(name), Path(name, "coach.png")
        os.environ |= {"BLENDER_USER_RESOURCES": name, "BLENDER_USER_SCRIPTS": name, "LIBGL_ALWAYS_SOFTWARE": "1"}
        lesson = save_lesson(sequence, own / "lesson.json", silhouette)
        question = {"zip": str(build(own)), "lesson": str(lesson), "step": STEP, "picture": str(picture)}
        print(ask_blender(INSIDE, question, what="lessons", seconds=120.0, screen=screen, look=look, ends_well=False))
        with Image.open(picture) as window:
            left, top = 0, window.height - SHOWN[1] - 66
            shown = window.convert("RGB").crop((left, top, left + SHOWN[0], top + SHOWN[1]))
        save_png(shown.quantize(COLOURS, Image.Quantize.FASTOCTREE), folder / "coach.png")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
