"""Draws variants and retargeted constructions into docs/pictures: `python docs/draw_variations.py [FOLDER]` (a minute).

Nothing is random but for fixed seeds: the objects are those of examples/ and two that are drawn from their seeds.
"""

import sys
from itertools import islice
from pathlib import Path

import numpy as np
from PIL import Image

from agents.budget import Budget
from agents.registry import make_agent
from agents.retell.retargeting import retarget
from agents.retell.variants import draw_variants
from autopoly_env.arrays import ByteArray
from autopoly_env.export.sheet import save_png
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import Silhouette, load_silhouette
from autopoly_env.simulator import Simulator
from autopoly_env.targets import ObjectTargets, split_seed
from autopoly_env.viewer import draw_mesh

SIZE = 220  # pixels on a side of one mesh
AMOUNT = 0.12
VARIED = {"chair": 0, "teapot": 0, "key": 0, "padlock": 0}  # with the seed of the variants
RETARGETED = {"chair": 3, "mug": 1}  # with the number of the drawn object of that family
ROOT = Path(__file__).parent.parent
PICTURES = ROOT / "docs" / "pictures"


def solved(name: str) -> ConstructionSequence:
    """What `climb` makes of an example."""
    return make_agent("climb").solve(Simulator(load_silhouette(ROOT / "examples" / f"{name}.png"))).sequence


def variations() -> ByteArray:
    """A row for each object: the mesh as it was, and five variants of it."""
    rows = []
    for name, seed in VARIED.items():
        sequence = solved(name)
        cells = [draw_mesh(sequence.final(), size=SIZE, caption=f"{name}\n{len(sequence.steps)} steps")]
        found = (variant for variant in draw_variants(sequence, 50, AMOUNT, seed) if variant is not None)
        for variant in islice(found, 5):
            caption = f"edited after step {variant.step}\n{len(variant.moved)} vertices pulled"
            cells.append(draw_mesh(variant.sequence.final(), size=SIZE, caption=caption))
        rows.append(np.hstack(cells))
    return np.vstack(rows)


def retargeting() -> ByteArray:
    """A row for each object: its mesh, the new target, the same steps refitted, and the result."""
    return np.vstack([_retargeted(solved(name), drawn(name, number)) for name, number in RETARGETED.items()])


def drawn(family: str, number: int) -> Silhouette:
    return ObjectTargets(family).sample(split_seed("test", number))


def _retargeted(sequence: ConstructionSequence, target: Silhouette) -> ByteArray:
    done = retarget(Simulator(target), sequence, Budget(refits=300))
    same = done.aligned
    kept = f"{done.n_kept} of {len(sequence.steps)} steps kept, {done.n_added} added"
    cells = (
        draw_mesh(sequence.final(), size=SIZE, caption=f"the old mesh\n{len(sequence.steps)} steps"),
        draw_mesh(sequence.final(), target, size=SIZE, caption=f"on the new target\nr_all {done.before.total:.1f}"),
        draw_mesh(same, target, size=SIZE, caption=f"the same steps refitted\nr_all {done.refitted.total:.1f}"),
        draw_mesh(done.solution.mesh, target, size=SIZE, caption=f"r_all {done.solution.score.total:.1f}\n{kept}"),
    )
    return np.hstack(cells)


DRAWINGS = {"variations": variations, "retargeting": retargeting}


def main(folder: Path = PICTURES) -> None:
    """Write every picture as `<name>.png`."""
    for name, draw in DRAWINGS.items():
        save_png(Image.fromarray(draw()), folder / f"{name}.png")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
