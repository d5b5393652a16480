"""Draws docs/pictures/blender-frame.png: `python docs/draw_blender.py [FOLDER]`, which needs Blender.

The example silhouette of a padlock is solved, its Blender script run, and what Blender renders put beside our own
picture of the same mesh.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

from agents.registry import make_agent
from autopoly_env import viewer
from autopoly_env.arrays import ByteArray
from autopoly_env.errors import OutputError
from autopoly_env.export.blender import Job, run_in_blender, save_blender_script
from autopoly_env.export.sheet import save_png
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import load_silhouette
from autopoly_env.simulator import Simulator

SIZE = 360  # pixels on a side of one mesh
GAP = 24  # between the two
SILHOUETTE = Path(__file__).parents[1] / "examples" / "padlock.png"
PICTURES = Path(__file__).parent / "pictures"


def main(folder: Path = PICTURES) -> None:
    """Write the picture: Blender's on the left, ours on the right."""
    solution = make_agent("trace").solve(Simulator(load_silhouette(SILHOUETTE)))
    counts = "V {}, E {}, F {}".format(*solution.mesh.counts)
    ours, theirs = (
        viewer.draw_mesh(solution.mesh, size=SIZE, caption=f"{who}\n{counts}")
        for who in ("AutoPoly", "Blender, rebuilt by the script")
    )
    theirs[:SIZE] = rendered(solution.sequence)
    gap = np.full((len(ours), GAP, 3), 255, np.uint8)
    save_png(Image.fromarray(np.hstack((theirs, gap, ours))), folder / "blender-frame.png")


def rendered(sequence: ConstructionSequence) -> ByteArray:
    """(SIZE, SIZE, 3) what Blender renders of the last step, on white, framed as `draw_mesh` frames it."""
    margin = viewer.MARGIN / (1.0 - 2.0 * viewer.MARGIN)
    with tempfile.TemporaryDirectory() as name:
        script, picture = Path(name, "script.py"), Path(name, "frame.png")
        save_blender_script(sequence, script)
        options = ("--render", str(picture), "--size", str(SIZE), "--margin", str(margin), "--edges")
        (problem,) = run_in_blender([Job(script, options)])
        if problem:
            raise OutputError(f"Blender could not run the script: {problem}")
        with Image.open(picture) as frame:
            paper = Image.new("RGBA", frame.size, viewer.PAPER)
            return np.asarray(Image.alpha_composite(paper, frame.convert("RGBA")).convert("RGB"))


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
