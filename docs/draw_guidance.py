"""Draws what guidance does into docs/pictures: `python docs/draw_guidance.py [FOLDER]` (about a minute).

Each picture is a row of meshes that the agents really build from pictures in examples/; nothing is random.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from agents.budget import Budget
from agents.registry import make_agent
from agents.solution import Solution
from autopoly_env.arrays import ByteArray, FloatArray
from autopoly_env.export.sheet import save_png
from autopoly_env.mesh import PolyMesh
from autopoly_env.score import ScoreWeights
from autopoly_env.silhouette import Silhouette, load_silhouette
from autopoly_env.simulator import Simulator
from autopoly_env.viewer import CHANGED, MARGIN, MATCH, OVERSAMPLING, PAPER, Highlight, draw_mesh

SIZE = 300  # pixels on a side of one mesh
ROOT = Path(__file__).parent.parent
PICTURES = ROOT / "docs" / "pictures"


def example(name: str) -> Silhouette:
    return load_silhouette(ROOT / "examples" / f"{name}.png")


def solved(
    agent: str, target: Silhouette, *, refits: int | None = None, w_sc: float = 0.3, **guidance: Any
) -> Solution:
    game = Simulator(target, weights=ScoreWeights(w_sc=w_sc), **guidance)
    return make_agent(agent).solve(game, Budget(refits=refits))


def frame(mesh: PolyMesh, target: Silhouette, caption: str, green: Highlight | None = None) -> ByteArray:
    n_vertices, n_edges, n_faces = mesh.counts
    facts = f"{n_vertices} vertices, {n_edges} edges, {n_faces} face" + ("s" if n_faces > 1 else "")
    return draw_mesh(mesh, target, size=SIZE, highlight=green, caption=f"{caption}\n{facts}")


def importance() -> ByteArray:
    """A key of which the bit has to open something."""
    target = example("key")
    weights = bright_disk(target.resolution, centre=(0.86, 0.36), radius=0.13, elsewhere=0.2)
    plain = solved("climb", target, w_sc=0.5)
    guided = solved("climb", target, w_sc=0.5, importance=weights)
    return np.hstack(
        (
            frame(plain.mesh, target, "without: few vertices, all of the key alike"),
            weight_frame(weights, target),
            frame(guided.mesh, target, "with it: the vertices go where it is white"),
        )
    )


def bright_disk(size: int, centre: tuple[float, float], radius: float, elsewhere: float) -> FloatArray:
    """A weight image (size, size): 1 in a disk of the unit square, less and less outside of it."""
    x, y = np.meshgrid(*2 * [(np.arange(size) + 0.5) / size])
    away = np.maximum(np.hypot(x - centre[0], y - centre[1]) - radius, 0.0)
    return elsewhere + (1.0 - elsewhere) * np.exp(-((away / 0.05) ** 2))


def weight_frame(weights: FloatArray, target: Silhouette) -> ByteArray:
    """The weight image with a hint of the object in it, where `draw_mesh` would have the unit square."""
    grey = np.repeat(255.0 * weights[..., None], 3, axis=2)
    grey[target.mask] = 0.5 * grey[target.mask] + 0.5 * np.array(MATCH)
    margin = round(MARGIN * SIZE)
    side = SIZE - 2 * margin
    picture = Image.fromarray(grey.astype(np.uint8)).resize((side, side), Image.Resampling.BOX)
    page = draw_mesh(
        PolyMesh.rectangle(0.0, 0.0, 1.0, 1.0), size=SIZE, caption="the weight image, the key faint in it\n"
    )
    page[:SIZE] = PAPER
    page[margin : margin + side, margin : margin + side] = np.asarray(picture)
    return page


def start() -> ByteArray:
    """A table that somebody began by hand, with the ends of its top where they belong."""
    target = example("table")
    x0, x1, y = 31 / 512, 481 / 512, 145 / 512
    outline = [(x0, y), (x1, y), (0.9, 0.8), (0.8, 0.8), (0.72, 0.5), (0.28, 0.5), (0.2, 0.8), (0.1, 0.8)]
    begun, ends = PolyMesh.from_faces(outline, [range(8)]), (0, 1)
    game: dict[str, Any] = {"start": begun, "refits": 600}
    return np.hstack(
        (
            frame(begun, target, "the start mesh"),
            frame(solved("greedy", target, **game).mesh, target, "gone on from it"),
            frame(
                solved("greedy", target, locked=ends, **game).mesh,
                target,
                "upper corners locked",
                Highlight(vertices=ends),
            ),
        )
    )


def symmetry() -> ByteArray:
    """Scissors, whose halves are alike."""
    target = example("scissors")
    plain = solved("beam", target, refits=2000)
    game = Simulator(target, symmetry=True)
    guided = make_agent("beam").solve(game, Budget(refits=2000))
    assert game.guidance.axis is not None
    return np.hstack(
        (
            frame(plain.mesh, target, "beam"),
            with_axis(frame(guided.mesh, target, "beam, symmetric"), game.guidance.axis),
        )
    )


def with_axis(page: ByteArray, axis: float) -> ByteArray:
    """The frame with a dashed line where the axis is."""
    picture = Image.fromarray(page)
    pen = ImageDraw.Draw(picture)
    x = round(SIZE * (MARGIN + (1.0 - 2.0 * MARGIN) * axis))
    for y in range(0, SIZE, 3 * OVERSAMPLING):
        pen.line([(x, y), (x, y + OVERSAMPLING)], fill=CHANGED)
    return np.asarray(picture)


DRAWINGS = {"importance": importance, "start": start, "symmetry": symmetry}


def main(folder: Path = PICTURES) -> None:
    """Write every picture as `guidance-<name>.png`."""
    for name, draw in DRAWINGS.items():
        save_png(Image.fromarray(draw()), folder / f"guidance-{name}.png")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
