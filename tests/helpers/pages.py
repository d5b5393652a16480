"""Python in the pages of the documentation, and the files that it takes to be there."""

import re
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from textwrap import dedent
from typing import Any

import numpy as np
from PIL import Image

from autopoly_env.files import write_atomically
from autopoly_env.targets.shapenet import SYNSETS
from tests.helpers.paths import DOCS, EXAMPLES, ROOT
from training.evaluate import main as evaluate
from training.make_dataset import main as make_dataset


def _files() -> list[Path]:
    return sorted([*ROOT.glob("*.md"), *DOCS.glob("*.md"), *ROOT.glob("[be]*/README.md")])


PAGES = {path.relative_to(ROOT).as_posix(): path for path in _files()}
_BLOCK = re.compile(
    r"(?:<!-- not run: (?P<reason>[^>]*) -->\n+)?^(?P<indent> *)```python\n(?P<code>.*?)^(?P=indent)```$",
    re.DOTALL | re.MULTILINE,
)


@dataclass(frozen=True)
class Snippet:
    """A block of Python: its text, the line above it, and why it is not run, if it is not."""

    code: str
    line: int
    reason: str | None


def snippets(page: str) -> list[Snippet]:
    text = PAGES[page].read_text(encoding="utf-8")
    found = [(dedent(m["code"]), text.count("\n", 0, m.start("code")), m["reason"]) for m in _BLOCK.finditer(text)]
    return [Snippet(*each) for each in found]


def run_page(page: str, folder: Path) -> dict[str, Any]:
    """Run a page's snippets in their order and in one namespace, which is returned. `folder` is the one to be in."""
    (folder / "examples").symlink_to(EXAMPLES)
    PREPARED.get(page, _nothing)(folder)
    names: dict[str, Any] = {"__name__": page}
    for snippet in snippets(page):
        if snippet.reason is None:  # the line numbers of an error are those of the page
            exec(compile("\n" * snippet.line + snippet.code, page, "exec"), names)
    return names


# --- what the pages say is there already: small, and made by the commands that the pages name ---


def _nothing(folder: Path) -> None:
    pass


def _sequence(path: str) -> Callable[[Path], None]:
    """The example of docs/sequence-format.md, at a place."""

    def prepare(folder: Path) -> None:
        text = PAGES["docs/sequence-format.md"].read_text(encoding="utf-8")
        write_atomically(folder / path, text.split("```json\n")[1].split("```")[0])

    return prepare


def _evaluated(folder: Path) -> None:
    suite = folder / "small.yaml"
    targets, agents = "{kind: construction, n: 2, resolution: 32}", "[{agent: trace}, {agent: dr-simple}]"
    suite.write_text(f"targets: {targets}\nresolution: 32\nbaseline: trace\nagents: {agents}\n")
    assert evaluate([str(suite), "--out", "out/evaluate/paper", "--engine", "serial", "--quiet"]) == 0


def data_sets(folder: Path) -> None:
    """Two constructions, and the same box as every model of a folder that is laid out as ShapeNet's."""
    made = ["constructions", "--n", "2", "--resolution", "64", "--engine", "serial", "--out", "data/train"]
    assert make_dataset(made) == 0
    box = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nv 0 0 1\nv 2 0 1\nv 2 1 1\nv 0 1 1\n"
    box += "f 1 2 3 4\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"
    for synset, n in ((SYNSETS["chair"], 20), ("03636649", 1)):
        for k in range(n):
            path = folder / "ShapeNetCore.v2" / synset / f"{k:032x}" / "models" / "model_normalized.obj"
            path.parent.mkdir(parents=True)
            path.write_text(box)


def _weights(folder: Path) -> None:
    """A weight image that is brightest on the left."""
    Image.fromarray(np.tile(np.linspace(255, 60, 64).astype(np.uint8), (64, 1))).save(folder / "bit.png")


def _modules_named_in_agents(folder: Path) -> None:
    """The page's first block as the file that it says it is, where it can be imported from."""
    write_atomically(folder / "hasty.py", snippets("docs/agents.md")[0].code)
    sys.path.insert(0, str(folder))


PREPARED: dict[str, Callable[[Path], None]] = {
    "CONTRIBUTING.md": _sequence("house.json"),
    "docs/agents.md": _modules_named_in_agents,
    "docs/blender.md": _sequence("out/chair/sequence.json"),
    "docs/comparing.md": _evaluated,
    "docs/datasets.md": data_sets,
    "docs/guidance.md": _weights,
    "docs/lessons.md": _sequence("house.json"),
    "docs/player.md": _sequence("out/padlock/sequence.json"),
    "docs/sequence-format.md": _sequence("house.json"),
    "docs/variations.md": _sequence("house.json"),
}
