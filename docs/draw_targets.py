"""Draws what the target sources give, into docs/pictures: `python docs/draw_targets.py [FOLDER]`.

Shapes of the construction simulator by difficulty, how one of them was made, and things of every family. All are
test targets, from the start of the test split on, so that the same pixels come out each time.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from autopoly_env.export.sheet import contact_sheet, save_png
from autopoly_env.silhouette import Silhouette
from autopoly_env.targets import ConstructionTargets, ObjectTargets, TargetSource, split_seed
from autopoly_env.targets.families import FAMILIES
from autopoly_env.viewer import INK, OVERSAMPLING, PAPER, SOFT_INK, font

PICTURES = Path(__file__).parent / "pictures"
CELL = 78  # pixels on a side of one shape
GAP = 6
LINE = 20  # pixels of height for a caption
COLOURS = 64  # of a page
DIFFICULTIES = range(1, 6)
N_SHAPES = 12  # of each difficulty
N_THINGS = 3  # of each family
N_FAMILIES = 6  # in a row
STORY = "full", 4, 368  # operators, difficulty and number of the target whose construction is shown


def tile(silhouette: Silhouette) -> Image.Image:
    """The silhouette dark on a light page, CELL pixels a side."""
    covered = silhouette.target(CELL).coverage[:, :, None]
    colours = (1.0 - covered) * np.array(PAPER) + covered * np.array(INK)
    return Image.fromarray(np.round(colours).astype(np.uint8))


def strip(source: TargetSource, n: int, first: int) -> Image.Image:
    """n test targets side by side, from number `first` on."""
    page = Image.new("RGB", (n * (CELL + GAP), CELL), PAPER)
    for i in range(n):
        page.paste(tile(source.sample(split_seed("test", first + i))), (i * (CELL + GAP), 0))
    return page


def captioned(picture: Image.Image, words: str) -> Image.Image:
    """The picture with a line of words above it."""
    page = Image.new("RGB", (picture.width, picture.height + LINE), PAPER)
    page.paste(picture, (0, LINE))
    text = Image.new("RGB", (OVERSAMPLING * page.width, OVERSAMPLING * LINE), PAPER)
    ImageDraw.Draw(text).text((4 * OVERSAMPLING, 2 * OVERSAMPLING), words, SOFT_INK, font(12))
    page.paste(text.reduce(OVERSAMPLING), (0, 0))
    return page


def rows_of(pictures: list[Image.Image], n_columns: int) -> Image.Image:
    """Pictures of one size in rows."""
    width, height = pictures[0].width + 2 * GAP, pictures[0].height + 2 * GAP
    n_rows = -(-len(pictures) // n_columns)
    page = Image.new("RGB", (n_columns * width, n_rows * height), PAPER)
    for i, picture in enumerate(pictures):
        page.paste(picture, (i % n_columns * width + GAP, i // n_columns * height + GAP))
    return page


def constructions() -> Image.Image:
    """A row of shapes of each difficulty."""
    rows = [
        captioned(strip(ConstructionTargets(difficulty), N_SHAPES, N_SHAPES * difficulty), f"difficulty {difficulty}")
        for difficulty in DIFFICULTIES
    ]
    return rows_of(rows, 1)


def story() -> Image.Image:
    """How one shape was made."""
    operators, difficulty, index = STORY
    source, seed = ConstructionTargets(difficulty, operators), split_seed("test", index)
    return contact_sheet(source.sample_sequence(seed), source.sample(seed), cell=180)


def things() -> Image.Image:
    """A few things of each family."""
    groups = [captioned(strip(ObjectTargets((name,)), N_THINGS, 0), name) for name in FAMILIES]
    return rows_of(groups, N_FAMILIES)


def main(folder: Path = PICTURES) -> None:
    """Write every picture as `targets_<what>.png`, with few colours."""
    pages = {"construction": constructions(), "sequence": story(), "objects": things()}
    for name, page in pages.items():
        save_png(page.quantize(COLOURS, dither=Image.Dither.NONE), folder / f"targets_{name}.png")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
