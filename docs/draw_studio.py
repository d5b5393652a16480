"""Photographs the studio for docs/studio.md into docs/pictures: `python docs/draw_studio.py [FOLDER]`.

Every picture shows the same moment light, dark and on a phone. It needs Chromium, and looks best where the fonts Inter
or Noto Sans are installed.
"""

import io
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from PIL import Image

from autopoly_env.export import save_png
from tests.helpers.browser import Browser, Page
from tests.helpers.studio import example, middle, serving, solved, vertex

HERE = Path(__file__).parent
EXAMPLES = HERE.parent / "examples"
WIDE, PHONE = (1200, 800), (360, 800)  # CSS pixels
HEIGHT, GAP = 520, 16  # of a picture, and between its parts, in pixels
N_COLOURS = 160


def drop(page: Page) -> None:
    """A picture that was dropped, and what is taken for the object in it."""
    example(page, "padlock")
    solved(page)
    page.click("#tab-picture")


def search(page: Page) -> None:
    """A search at work."""
    example(page, "bicycle")
    page.evaluate(
        "(one => { one.value = 30; one.dispatchEvent(new Event('change')); })(document.getElementById('seconds'))"
    )
    page.wait_for("/searching: \\d{3,} refits/.test(document.getElementById('count').textContent)")
    page.click("#play")
    page.wait_for("document.getElementById('count').textContent.startsWith('paused')")


def hand(page: Page) -> None:
    """What matters is painted, a vertex pulled."""
    example(page, "mug")
    solved(page)
    page.click("#tab-hand")
    page.click('input[name="tool"][value="paint"]')
    x, y = middle(page, "#target")
    side = page.evaluate("document.getElementById('target').getBoundingClientRect().width")
    page.drag((x + 0.3 * side, y - 0.12 * side), (x + 0.34 * side, y + 0.12 * side))
    page.wait_for("document.getElementById('command').textContent.includes('--importance')")
    page.click('input[name="tool"][value="pull"]')
    x, y = vertex(page, 3)
    page.drag((x, y), (x + 6, y - 6))
    page.wait_for("document.getElementById('locks').textContent !== ''")


def take(page: Page) -> None:
    """All the formats, and the command."""
    example(page, "teapot")
    solved(page)
    page.click("#tab-take")


def folder(page: Page) -> None:
    """Several pictures at once."""
    names = ("aeroplane", "bed", "bottle", "chair", "floor_lamp", "hammer", "key", "table")
    page.drop(*(EXAMPLES / f"{name}.png" for name in names), x=100)
    page.wait_for("document.querySelectorAll('#list li.done').length >= 5")
    page.click("#list li:nth-child(2) .open")
    page.wait_for("document.querySelectorAll('#faces g').length > 0")
    page.evaluate("scrollTo(0, document.body.scrollHeight)")


def welcome(page: Page) -> None:
    """The page as it is opened."""
    page.wait_for("[...document.images].filter(one => one.complete && one.naturalWidth).length > 8")


MOMENTS: dict[str, Callable[[Page], None]] = {
    "welcome": welcome,
    "drop": drop,
    "search": search,
    "hand": hand,
    "take": take,
    "folder": folder,
}


def photograph(
    browser: Browser, address: str, moment: Callable[[Page], None], size: tuple[int, int], dark: bool
) -> Image.Image:
    """The studio at a moment, on a screen of that size; its pictures are closed again."""
    page = browser.open(address, width=size[0], height=size[1], dark=dark)
    page.wait_for("document.querySelectorAll('#examples button').length > 0")
    moment(page)
    page.move_to("#name" if size == WIDE else "body")
    if moment is not folder:
        page.evaluate("scrollTo(0, 0)")
    page.evaluate("new Promise(done => setTimeout(done, 400))")
    picture = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    page.evaluate(
        """Promise.all([...document.querySelectorAll("#list li")]
        .map(line => fetch(`pictures/${line.dataset.id}`, { method: "DELETE" })))"""
    )
    page.close()
    return picture.resize((round(picture.width * HEIGHT / picture.height), HEIGHT), Image.Resampling.LANCZOS)


def side_by_side(pictures: list[Image.Image]) -> Image.Image:
    """Pictures of one height in a row on white."""
    page = Image.new("RGB", (sum(one.width + GAP for one in pictures) - GAP, HEIGHT), "white")
    left = 0
    for one in pictures:
        page.paste(one, (left, 0))
        left += one.width + GAP
    return page


def main(folder: Path = HERE / "pictures") -> None:
    """Write `studio-NAME.png` for each of MOMENTS."""
    with tempfile.TemporaryDirectory() as out, serving(out=Path(out)) as studio, Browser() as browser:
        for name, moment in MOMENTS.items():
            views = ((WIDE, False), (WIDE, True), (PHONE, False))
            pictures = [photograph(browser, studio.address, moment, size, dark) for size, dark in views]
            sheet = side_by_side(pictures).quantize(N_COLOURS, dither=Image.Dither.NONE)
            save_png(sheet, folder / f"studio-{name}.png")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
