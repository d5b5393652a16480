"""Where results go: folders that killed runs have left, names with line ends, folders in a file's way."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

from agents import solve
from agents.commands import results
from agents.commands.results import claim_folder
from tests.helpers.commands import runner

_KILLED_WHILE_IT_WRITES = """
import os, signal, sys
from agents import solve
from agents.commands import results
results.save_png = lambda *_: os.kill(os.getpid(), signal.SIGKILL)
sys.exit(solve.main(sys.argv[1:]))
"""


@pytest.mark.slow  # an image is solved
def test_claim__sweeps_what_a_killed_run_has_left(tmp_path: Path) -> None:
    picture = Image.new("L", (64, 64))
    picture.paste(255, (8, 8, 40, 56))
    picture.save(tmp_path / "a.png")
    words = (str(tmp_path / "a.png"), "--out", str(tmp_path / "out"), "--agent", "trace", "--resolution", "64")
    killed = subprocess.run([sys.executable, "-c", _KILLED_WHILE_IT_WRITES, *words], check=False, capture_output=True)
    assert killed.returncode == -signal.SIGKILL
    assert [path.name[:7] for path in (tmp_path / "out").iterdir()] == [".solve-"]
    claim_folder(tmp_path / "out")
    assert not list((tmp_path / "out").iterdir())


def test_claim__leaves_what_others_are_writing(tmp_path: Path) -> None:
    mine = f"{results._STAGING}{results._MACHINE}{os.getpid()}-a.tmp"
    for name in (mine, ".solve-elsewhere-1-a.tmp", ".solve-elsewhere-2-a.tmp", "mine"):
        (tmp_path / name / "inner").mkdir(parents=True)
    os.utime(tmp_path / ".solve-elsewhere-2-a.tmp", (0, 0))
    claim_folder(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {mine, ".solve-elsewhere-1-a.tmp", "mine"}


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
