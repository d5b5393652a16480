"""The README is true: its snippets run and print what it promises, its agent is the one that is tested."""

import contextlib
import io
from typing import Any

import pytest

from tests.helpers.pages import run_page, snippets
from tests.helpers.paths import EXAMPLES

pytestmark = pytest.mark.slow  # the page solves and plays as a reader would


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], str]:
    """The names that the snippets leave behind, and what they print."""
    folder, printed = tmp_path_factory.mktemp("readme"), io.StringIO()
    with contextlib.chdir(folder), contextlib.redirect_stdout(printed):
        return run_page("README.md", folder), printed.getvalue()


def test_the_agent_shown__is_the_example() -> None:
    code = (EXAMPLES / "agent_in_fifteen_lines.py").read_text(encoding="utf-8")
    assert any(snippet.code.strip() and code.endswith(snippet.code) for snippet in snippets("README.md"))


def test_solving_from_python__prints_what_it_promises(played: tuple[dict[str, Any], str]) -> None:
    total, mesh = played[1].split(" ", 1)
    assert float(total) > 85.0 and mesh.startswith("PolyMesh(")


def test_the_environment_snippet__plays_a_step(played: tuple[dict[str, Any], str]) -> None:
    assert isinstance(played[0]["reward"], float)


def test_the_agent_shown__gains_on_eight_targets(played: tuple[dict[str, Any], str]) -> None:
    gains = [line for line in played[1].splitlines() if line.startswith("target ")]
    assert len(gains) == 8 and all(float(line.split("+")[1]) >= 0.0 for line in gains)
