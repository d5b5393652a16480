"""The README is true: its snippets run, its links lead somewhere, its agent is the one that is tested."""

import re

import pytest

from tests.helpers.paths import ROOT

README = (ROOT / "README.md").read_text(encoding="utf-8")
SNIPPETS = re.findall(r"```python\n(.*?)```", README, re.DOTALL)


@pytest.mark.parametrize("link", re.findall(r"\]\(([^)#]+)\)", README))
def test_links__lead_to_files(link: str) -> None:
    assert link.startswith("https://") or (ROOT / link).is_file()


def test_the_agent_shown__is_the_example() -> None:
    code = (ROOT / "examples" / "agent_in_fifteen_lines.py").read_text(encoding="utf-8")
    assert any(snippet.strip() and code.endswith(snippet) for snippet in SNIPPETS)


def test_solving_from_python__prints_what_it_promises(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    (snippet,) = (snippet for snippet in SNIPPETS if "load_silhouette" in snippet)
    exec(snippet, {})
    total, mesh = capsys.readouterr().out.split(" ", 1)
    assert float(total) > 85.0 and mesh.startswith("PolyMesh(")


def test_the_environment_snippet__plays_a_step() -> None:
    (snippet,) = (snippet for snippet in SNIPPETS if "reset(seed=7)\nobservation, reward" in snippet)
    names: dict[str, object] = {}
    exec(snippet, names)
    assert isinstance(names["reward"], float)
