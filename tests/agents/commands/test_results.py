"""Where results go: folders that killed runs have left, names with line ends, folders in a file's way."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

from agents import solve
from agents.commands.results import claim_folder
from tests.helpers.commands import runner


def test_claim__sweeps_what_killed_runs_have_left(tmp_path: Path) -> None:
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    for name in (f".solve-{gone.pid}-a.tmp", f".solve-{os.getpid()}-b.tmp", ".solve-old.tmp", "mine"):
        (tmp_path / name / "inner").mkdir(parents=True)
        os.utime(tmp_path / name, (0, 0))
    (tmp_path / f".solve-{gone.pid}-new.tmp").mkdir()  # perhaps of another machine
    claim_folder(tmp_path)
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {f".solve-{os.getpid()}-b.tmp", "mine", f".solve-{gone.pid}-new.tmp"}


@pytest.mark.slow  # three images are solved
def test_one_bad_item__never_ends_the_batch(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    picture = Image.new("L", (64, 64))
    picture.paste(255, (8, 8, 40, 56))
    names = ["a", "b\nc\x1b[2J", "d" * 251]
    for name in names:
        picture.save(f"{name}.png")
    Path("out/a/player.html").mkdir(parents=True)
    done = runner(solve.main, capsys)(*(f"{name}.png" for name in names), "--agent", "trace", "--resolution", "64")
    assert done.code == 1
    assert done.err == "error: a.png: cannot write out/a/player.html (a folder is in its place); move that away\n"
    assert os.listdir("out/a") == ["player.html"]  # all of its files or none
    assert sorted(os.listdir("out")) == sorted(["a", names[1], "d" * 200, "overview.png"])
    assert all(line.isprintable() for line in done.out.splitlines())
    assert r"b\nc\x1b[2J" in done.out
