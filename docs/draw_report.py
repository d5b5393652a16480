"""Photographs a report for docs/comparing.md into docs/pictures: `python docs/draw_report.py [FOLDER]`.

It runs four agents on the examples, with few refits, which takes a minute or two, and needs Chromium.
"""

import io
import sys
import tempfile
from pathlib import Path

from PIL import Image

from tests.helpers.browser import Browser, Page
from training.compare import main as compare
from training.evaluate import main as evaluate

HERE = Path(__file__).parent
AGENTS = "random,greedy,beam,trace"
WIDTH = 1240  # CSS pixels
SECTIONS = {"scores": (1, 2, 3), "work": (4,), "targets": (5,)}  # which of the page's sections a picture shows
HEIGHTS = {"targets": 860}  # CSS pixels at most


def photograph(page: Page, numbers: tuple[int, ...], height: int) -> Image.Image:
    """Some sections of the page, one below the other."""
    first, last = (f"document.querySelector('main section:nth-child({n})')" for n in (numbers[0], numbers[-1]))
    top = page.evaluate(f"{first}.getBoundingClientRect().top + scrollY")
    bottom = page.evaluate(f"{last}.getBoundingClientRect().bottom + scrollY")
    picture = Image.open(io.BytesIO(page.screenshot(whole=True))).convert("RGB")
    return picture.crop((0, round(top) - 12, WIDTH, round(min(bottom + 12, top + height))))


def main(folder: Path = HERE / "pictures") -> None:
    """Write `report-scores.png`, `report-work.png` and `report-targets.png`."""
    with tempfile.TemporaryDirectory() as scratch, Browser() as browser:
        run, report = str(Path(scratch) / "run"), str(Path(scratch) / "report.html")
        evaluate([str(HERE.parent / "examples"), "--agents", AGENTS, "--budget", "refits=300", "--out", run])
        compare([run, "--baseline", "greedy", "--out", report])
        page = browser.open(report, width=WIDTH)
        page.evaluate("document.getElementById('chips').style.position = 'static'")
        for name, numbers in SECTIONS.items():
            picture = photograph(page, numbers, HEIGHTS.get(name, 5000))
            picture.save(folder / f"report-{name}.png", optimize=True)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
