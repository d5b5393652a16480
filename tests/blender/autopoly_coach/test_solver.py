"""AutoPoly run as another program: that it is asked rightly, what comes of it, and that it can be stopped."""

import sys
import time
from pathlib import Path

import pytest

from blender.autopoly_coach import solver
from blender.autopoly_coach.solver import Solver, SolverError

WRITES = """
import pathlib, sys
folder = pathlib.Path(sys.argv[2], "a")
folder.mkdir()
(folder / "lesson.json").touch()
"""
FAILS = "import sys; print('a line'); print('error: no such\\timage', flush=True); print('b'); sys.exit(2)"
DEAF = """
import signal, time
signal.signal(signal.SIGINT, signal.SIG_IGN)
print("on", flush=True)
time.sleep(600)
"""


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A module that `python -m stand_in` runs."""
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    return tmp_path / "stand_in.py"


def run(*arguments: str, seconds: float = 0.0) -> Solver:
    return Solver(sys.executable, ["stand_in", *arguments], "*/lesson.json", seconds)


def test_result__is_the_file_that_it_leaves_in_its_folder(module: Path) -> None:
    module.write_text(WRITES)
    made = run("--out", "{out}")
    path = made.result()
    assert path.name == "lesson.json" and path.is_file()
    made.clear()
    assert not path.exists() and not made.is_running


@pytest.mark.parametrize(
    ("code", "message"),
    [
        (
            "import sys; print('a line'); print('error: no such\\timage', flush=True); print('b'); sys.exit(2)",
            "error: no such image",
        ),
        ("pass", "exit code 0: it said nothing"),
        ("raise ValueError('seven')", "ValueError: seven"),
        ("import sys; sys.stdout.buffer.write(b'\\xff\\xfe error ' + b'x' * 100000)", "exit code 0: "),
    ],
)
def test_failure__is_told_in_its_own_words(module: Path, code: str, message: str) -> None:
    module.write_text(code)
    made = run()
    with pytest.raises(SolverError) as refusal:
        made.result()
    assert message in str(refusal.value) and "\n" not in str(refusal.value) and len(str(refusal.value)) < 400
    made.clear()


def test_stop__is_heeded_as_ctrl_c(module: Path) -> None:
    module.write_text("import time\nprint('begun', flush=True)\ntime.sleep(600)")
    made = run(seconds=1000.0)
    assert made.is_running and 0.0 <= made.share < 0.5 and made.words.startswith("Building: ")
    made.stop()
    assert made.words.startswith("Stopping: ")
    with pytest.raises(SolverError, match=r"^stopped; nothing was changed$"):
        made.result()
    made.clear()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows knows no SIGINT")
def test_who_does_not_stop__is_ended(module: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(solver, "PATIENCE", 0.2)
    module.write_text(DEAF)
    made = run()
    while not made._lines:
        time.sleep(0.02)
    made.stop()
    while made.is_running:
        time.sleep(0.05)
    with pytest.raises(SolverError, match=r"^stopped"):
        made.result()
    made.clear()


def test_clear__ends_it_too(module: Path) -> None:
    module.write_text("import time; time.sleep(600)")
    made = run()
    made.clear()
    assert not made.is_running


@pytest.mark.parametrize(
    ("python", "message"),
    [
        ("", "AutoPoly is not set up"),
        ("  ", "AutoPoly is not set up"),
        ("/no/python", "there is no Python at '/no/python'"),
    ],
)
def test_python_that_is_none__is_refused(python: str, message: str) -> None:
    with pytest.raises(SolverError, match=message):
        Solver(python, ["agents.solve"], "*")


def test_file_that_is_no_program__is_refused(tmp_path: Path) -> None:
    path = tmp_path / "python"
    path.write_bytes(b"\x00\x01\x02")
    path.chmod(0o755)
    with pytest.raises(SolverError, match="cannot be run"):
        Solver(str(path), ["agents.solve"], "*")
