"""Draws how quads are modelled into docs/pictures: `python docs/draw_modelling.py [FOLDER]` (about a minute).

The meshes are those that `agents.solve` makes of pictures in examples/, in both styles, with 1,500 refits each.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

from agents.budget import Budget
from agents.commands.styles import style_named
from agents.registry import make_agent
from agents.solution import Solution
from autopoly_env.arrays import ByteArray
from autopoly_env.export.sheet import save_png
from autopoly_env.mesh import PolyMesh, face_rule
from autopoly_env.sequence import Lesson
from autopoly_env.silhouette import Silhouette, load_silhouette
from autopoly_env.simulator import Simulator
from autopoly_env.viewer import draw_mesh

SIZE = 230  # pixels on a side of one mesh
REFITS = 1500
COLUMNS = 7
ROOT = Path(__file__).parent.parent
PICTURES = ROOT / "docs" / "pictures"


def solved(style: str, target: Silhouette) -> Solution:
    chosen = style_named(style)
    symmetry = None if chosen.symmetry == "off" else chosen.symmetry
    game = Simulator(
        target, operators=chosen.operators, faces=face_rule(chosen.faces), symmetry=symmetry, align=chosen.align
    )
    return make_agent(chosen.agent).solve(game, Budget(REFITS))


def frame(mesh: PolyMesh, target: Silhouette, caption: str) -> ByteArray:
    return draw_mesh(mesh, target, size=SIZE, caption=caption)


def both_styles(names: list[str]) -> ByteArray:
    """Of each picture the mesh of either style."""
    rows = []
    for style in ("paper", "modeller"):
        row = []
        for name in names:
            target = load_silhouette(ROOT / "examples" / f"{name}.png")
            solution = solved(style, target)
            lesson = Lesson.of(solution.sequence)
            caption = f"{style}: r_all {solution.score.total:.1f}\n{lesson.effort:.0f} s by hand"
            row.append(frame(solution.mesh, target, caption))
        rows.append(np.hstack(row))
    return np.vstack(rows)


def construction(name: str) -> ByteArray:
    """Every mesh of the modeller's construction of a picture."""
    target = load_silhouette(ROOT / "examples" / f"{name}.png")
    sequence = solved("modeller", target).sequence
    captions = ["begin with\nthe body", *(step.operator.replace("_", " ") + "\n" for step in sequence.steps)]
    frames = [frame(mesh, target, caption) for mesh, caption in zip(sequence.meshes(), captions, strict=True)]
    frames += [np.full_like(frames[0], 255)] * (-len(frames) % COLUMNS)
    return np.vstack([np.hstack(frames[k : k + COLUMNS]) for k in range(0, len(frames), COLUMNS)])


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    save_png(Image.fromarray(both_styles(["chair", "mug", "key", "teapot"])), folder / "modelling-styles.png")
    for name in ("chair", "mug", "key"):
        save_png(Image.fromarray(construction(name)), folder / f"modelling-{name}.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else PICTURES)
