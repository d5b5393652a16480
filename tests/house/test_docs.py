"""The pages are true: their Python runs, their links lead somewhere, their pictures are the ones that are drawn."""

import ast
import io
import os
import re
import subprocess
import sys
import tokenize
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


PACKAGES = ("autopoly_env", "agents", "training", "benchmarks", "docs", "examples", "tests", "configs")
FILE = re.compile(rf"(?<![\w./-])((?:{'|'.join(PACKAGES)})/[\w./-]*\w\.(?:py|yaml|md|css|js|html|svg|png))\b")
MODULE = re.compile(rf"(?<![\w./])((?:{'|'.join(PACKAGES[:-1])})(?:\.\w+)+)(?![\w*])")
PLACEHOLDER = re.compile(r"NAME|_$|\.md$")  # of a name that stands for several, or of a page


def told(path: Path) -> str:
    """What a file says to people: a page all of it, a source file in its docstrings and comments."""
    text = path.read_text(encoding="utf-8")
    if path.suffix != ".py":
        return text
    kinds = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    docstrings = [ast.get_docstring(node) or "" for node in ast.walk(ast.parse(text)) if isinstance(node, kinds)]
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    return "\n".join([*docstrings, *(token.string for token in tokens if token.type == tokenize.COMMENT)])


def is_there(name: str) -> bool:
    """Whether a dotted name is a module, or stands in the file of one."""
    parts = name.split(".")
    for k in range(len(parts), 0, -1):
        place = ROOT.joinpath(*parts[:k])
        for file in (place.with_suffix(".py"), place / "__init__.py"):
            if file.is_file():
                return k == len(parts) or re.search(rf"\b{parts[k]}\b", file.read_text(encoding="utf-8")) is not None
    return False


@pytest.mark.slow
@pytest.mark.parametrize("package", ["pages", "autopoly_env", "agents", "training", "benchmarks", "docs", "examples"])
def test_files_and_modules_that_are_named__are_there(package: str) -> None:
    for path in PAGES.values() if package == "pages" else sorted((ROOT / package).rglob("*.py")):
        if path.name == "CHANGELOG.md":  # which also names what was there
            continue
        text = told(path)
        files = [name for name in FILE.findall(text) if not PLACEHOLDER.search(name.removesuffix(".md"))]
        # tests are named from their folder on, too
        lost = [name for name in files if not (ROOT / name).exists() and not (ROOT / "tests" / name).exists()]
        lost += [name for name in MODULE.findall(text) if not PLACEHOLDER.search(name) and not is_there(name)]
        assert not lost, f"{path}: {lost}"


def headings(path: Path) -> set[str]:
    """The anchors of a page's headings, as GitHub names them."""
    found = re.findall(r"^#+ (.+)$", path.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in found}


def test_pictures_of_guidance__are_those_that_the_text_shows() -> None:
    text = (draw_guidance.PICTURES.parent / "guidance.md").read_text(encoding="utf-8")
    drawn = {f"guidance-{name}.png" for name in draw_guidance.DRAWINGS}
    assert drawn == {path.name for path in draw_guidance.PICTURES.glob("guidance-*.png")}
    assert all(f"(pictures/{name})" in text for name in drawn)
