"""Photographs the player for docs/player.md into docs/pictures: `python docs/draw_player.py [FOLDER]`.

It needs Chromium, and looks best where the fonts Inter or Noto Sans are installed.
"""

import io
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from PIL import Image

from agents.registry import make_agent
from autopoly_env.export import save_html, save_png
from autopoly_env.silhouette import load_silhouette
from autopoly_env.simulator import Simulator
from tests.helpers.browser import Browser

HERE = Path(__file__).parent
SHAPE = HERE.parent / "examples" / "padlock.png"
WIDE, PHONE = (1200, 800), (360, 760)  # CSS pixels
GAP = 24  # pixels between pictures side by side
N_COLOURS = 256


def photograph(
    browser: Browser, page: Path, step: int, size: tuple[int, int], *, dark: bool = False, part: str = "body"
) -> Image.Image:
    """The player at a step, or one part of it, as it looks on a screen of that size."""
    tab = browser.open(f"{page.as_uri()}#step-{step}", width=size[0], height=size[1], dark=dark)
    box = tab.evaluate(
        f"(box => [box.x, box.y, box.right, box.bottom])(document.querySelector('{part}').getBoundingClientRect())"
    )
    picture = Image.open(io.BytesIO(tab.screenshot())).convert("RGB")
    tab.close()
    return picture.crop((round(box[0]), round(box[1]), round(box[2]), min(round(box[3]), size[1])))


def side_by_side(pictures: Sequence[Image.Image]) -> Image.Image:
    """Pictures of one height in a row on white."""
    width = sum(picture.width for picture in pictures) + GAP * (len(pictures) - 1)
    page, left = Image.new("RGB", (width, pictures[0].height), "white"), 0
    for picture in pictures:
        page.paste(picture, (left, 0))
        left += picture.width + GAP
    return page


def main(folder: Path = HERE / "pictures") -> None:
    """Write `player-light.png`, `player-dark.png`, `player-steps.png` and `player-phone.png`."""
    silhouette = load_silhouette(SHAPE)
    sequence = make_agent("greedy").solve(Simulator(silhouette)).sequence
    last = len(sequence.steps)
    with tempfile.TemporaryDirectory() as scratch, Browser() as browser:
        page = save_html(sequence, Path(scratch) / "player.html", silhouette)
        pictures = {
            "light": photograph(browser, page, 2, WIDE),
            "dark": photograph(browser, page, last, WIDE, dark=True),
            "steps": side_by_side([photograph(browser, page, k, (380, 620), part="#stage") for k in (1, 2, 5)]),
            "phone": side_by_side([photograph(browser, page, 6, PHONE, dark=dark) for dark in (False, True)]),
        }
    for name, picture in pictures.items():
        save_png(picture.quantize(N_COLOURS, dither=Image.Dither.NONE), folder / f"player-{name}.png")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
