"""The pages are true: their Python runs, their links lead somewhere, their pictures are the ones that are drawn."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from docs import draw_guidance
from tests.helpers.pages import PAGES, run_page, snippets
from tests.helpers.paths import ROOT

WITH_PYTHON = [page for page in PAGES if snippets(page) and page != "README.md"]  # which has tests of its own
REGISTERING = {"CONTRIBUTING.md"}  # agents, families and formats, which no other test shall meet
LINK = re.compile(r"\]\(([^)\s]+)\)")


@pytest.mark.slow
@pytest.mark.parametrize("page", WITH_PYTHON)
def test_python__runs_as_it_stands(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    if page in REGISTERING:
        code = f"import tests.helpers.pages as p, pathlib; p.run_page({page!r}, pathlib.Path())"
        env = os.environ | {"PYTHONPATH": str(ROOT)}
        done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
    else:
        run_page(page, tmp_path)


def test_python_that_is_not_run__is_little_and_says_why() -> None:
    reasons = {page: [s.reason for s in snippets(page) if s.reason is not None] for page in PAGES}
    assert {page: found for page, found in reasons.items() if found} == {
        "docs/blender.md": ["lines of a script that is written for Blender"]
    }


def test_python__is_found_in_every_block() -> None:
    for page, path in PAGES.items():
        text = path.read_text(encoding="utf-8")
        assert len(re.findall(r"```python", text)) == len(snippets(page)), page


@pytest.mark.parametrize("page", PAGES)
def test_links__lead_to_files_and_headings(page: str) -> None:
    for link in LINK.findall(PAGES[page].read_text(encoding="utf-8")):
        if link.startswith("https://"):
            continue
        name, _, anchor = link.partition("#")
        path = (PAGES[page].parent / name).resolve() if name else PAGES[page]
        assert path.exists(), link
        assert not anchor or anchor in headings(path), link


def headings(path: Path) -> set[str]:
    """The anchors of a page's headings, as GitHub names them."""
    found = re.findall(r"^#+ (.+)$", path.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in found}


def test_pictures_of_guidance__are_those_that_the_text_shows() -> None:
    text = (draw_guidance.PICTURES.parent / "guidance.md").read_text(encoding="utf-8")
    drawn = {f"guidance-{name}.png" for name in draw_guidance.DRAWINGS}
    assert drawn == {path.name for path in draw_guidance.PICTURES.glob("guidance-*.png")}
    assert all(f"(pictures/{name})" in text for name in drawn)
