"""Two revisions in turn: whose files run, what pairs say, what a revision that lacks something costs."""

import json
import subprocess
from pathlib import Path

import pytest

from autopoly_env.errors import ConfigError
from benchmarks.against import __main__ as against
from benchmarks.against import rows, trees, turns
from benchmarks.against.paired import spread_of
from benchmarks.against.rows import Group, Row
from tests.helpers.paths import ROOT

PROBE = """
class Probe:
    def __init__(self, settings):
        from autopoly_env import WHO
        self.who = WHO

    def measure(self, turn):
        if turn == {breaks_at}:
            raise ValueError("no such\\nthing")
        return {{"who": self.who, "turn": turn}}
"""


def repository(folder: Path) -> Path:
    """Two commits of a package that says which of them it is, 1 or 2."""
    package = folder / "autopoly_env"
    package.mkdir(parents=True)
    for who in (1, 2):
        (package / "__init__.py").write_text(f"WHO = {who}\n")
        for words in (("init", "-q"), ("add", "."), ("commit", "-qm", f"{who}")):
            name = ("-c", "user.name=nobody", "-c", "user.email=nobody@example.org", "-c", "commit.gpgsign=false")
            subprocess.run(["git", *name, *words], cwd=folder, check=True)
    return folder


@pytest.fixture
def probes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder for probes in place of the real one, with the real driver beside it."""
    (tmp_path / "probes").mkdir()
    (tmp_path / "driver.py").write_text((turns.HERE / "driver.py").read_text())
    monkeypatch.setattr(turns, "HERE", tmp_path)
    return tmp_path / "probes"


def test_trees__are_measured_in_turn_each_with_its_own_files(tmp_path: Path, probes: Path) -> None:
    root = repository(tmp_path / "repository")
    (probes / "who.py").write_text(PROBE.format(breaks_at=-1))
    with trees.tree_of(trees.commit_of("HEAD~1", root), root) as tree:
        found = list(turns.take_turns((tree, root), "who", ({}, {}), 3))
    assert not tree.exists()
    assert [pair for pair, _ in found] == [({"who": 1, "turn": k}, {"who": 2, "turn": k}) for k in range(3)]
    assert found[-1][1] == ("", "")


@pytest.mark.parametrize("afresh", [False, True])
def test_turns__go_on_without_whom_cannot_measure(tmp_path: Path, probes: Path, afresh: bool) -> None:
    root = repository(tmp_path / "repository")
    (root / "autopoly_env" / "__init__.py").write_text("")  # it has no WHO
    (probes / "who.py").write_text(PROBE.format(breaks_at=1))
    with trees.tree_of(trees.commit_of("HEAD", root), root) as tree:
        found = list(turns.take_turns((tree, root), "who", ({}, {}), 3, afresh=afresh))
    assert [pair for pair, _ in found] == [({"who": 2, "turn": 0}, {}), ({}, {})]  # the rest would be empty
    there, here = found[-1][1]
    assert there == "ValueError: no such thing"
    assert here.startswith("ImportError: cannot import name 'WHO'")


def test_spread__of_nine_values_is_between_the_second_and_the_eighth() -> None:
    # of nine coins at most one falls on a side in (1 + 9) / 512 of all cases, at most two in 46 / 512
    spread = spread_of([float(k) for k in (9, 1, 8, 2, 7, 3, 6, 4, 5)])
    assert (spread.middle, spread.low, spread.high) == (5.0, 2.0, 8.0)


def test_spread__of_few_values_is_their_range() -> None:
    spread = spread_of([1.0, 4.0, 2.0])
    assert (spread.middle, spread.low, spread.high) == (2.0, 1.0, 4.0)


def test_cells__are_a_ratio_or_a_difference_or_a_dash() -> None:
    pairs = [({"a": 2.0, "b": 50.0}, {"a": 3.0, "b": 50.5}), ({"a": 4.0, "b": 60.0}, {"a": 6.0, "b": 60.5})]
    assert against._cells(Row("a", "rate", "/s"), pairs)[1:4] == ("3 /s", "4.5 /s", "1.5x")
    assert against._cells(Row("b", "r_all", "", rows.DIFFERENCE), pairs)[3:5] == ("+0.500", "+0.500 to +0.500")
    assert against._cells(Row("c", "nothing", "s"), pairs)[1:] == ("-", "-", "-", "-", "0")


def test_command__tells_what_a_revision_lacks_and_keeps_the_pairs(
    tmp_path: Path, probes: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    root = repository(tmp_path / "repository")
    (probes / "who.py").write_text(PROBE.format(breaks_at=2))
    group = Group("who", lambda given: ({}, {}), (Row("who", "which one", ""),), 2)
    monkeypatch.setattr(against, "ROOT", root)
    monkeypatch.setattr(against, "commit_of", lambda revision: trees.commit_of(revision, root))
    monkeypatch.setattr(against, "tree_of", lambda commit: trees.tree_of(commit, root))
    monkeypatch.setattr(against, "GROUPS", {"env": group})
    kept = tmp_path / "pairs.jsonl"
    arguments = ["HEAD~1", "--only", "env", "--json", str(kept), "--silhouettes", str(ROOT / "examples")]
    assert against.main(arguments) == 0
    assert "2x" in capsys.readouterr().out
    assert json.loads(kept.read_text())["pairs"] == [[1, 2], [1, 2]]
    assert against.main([*arguments, "--rounds", "3"]) == 1
    assert "- env, this one: ValueError: no such thing" in capsys.readouterr().out


@pytest.mark.parametrize("revision", ["no-such-revision", "--help-me", "", "HEAD:README.md"])
def test_revision__that_is_none_is_refused_in_a_line(
    revision: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert against.main(["--", revision]) == 2
    said = capsys.readouterr().err
    assert said.startswith("error: revision ") and "expected a commit, branch or tag" in said
    assert said.count("\n") == 1


def test_folder__that_is_no_checkout_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="is no checkout of it: clone the repository"):
        trees.commit_of("HEAD", tmp_path)
