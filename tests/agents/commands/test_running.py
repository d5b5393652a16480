"""What every command does at its end: errors in one line, exit codes, outputs that take nothing, odd encodings."""

import io
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
import typer

from agents.commands.running import FAILURE, TOLD, USAGE_ERROR, run_command
from agents.commands.starting import INTERRUPTED
from autopoly_env.errors import AutoPolyError, ConfigError
from tests.helpers.paths import ROOT


def run(does: Callable[[], int]) -> int:
    """The exit code of a command that does no more than this."""
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    app.command()(lambda: does())
    return run_command(app, [], "python -m nothing")


def raising(error: BaseException) -> Callable[[], int]:
    def does() -> int:
        raise error

    return does


@pytest.mark.parametrize(
    ("does", "code", "line"),
    [
        (raising(ConfigError("width 0: give 1")), USAGE_ERROR, "error: width 0: give 1\n"),
        (raising(AutoPolyError("a\x1b[2J")), FAILURE, "error: a\\x1b[2J\n"),
        (raising(KeyboardInterrupt()), INTERRUPTED, "error: stopped by Ctrl-C\n"),
        (lambda: TOLD, INTERRUPTED, ""),
        (lambda: 0, 0, ""),
        (
            raising(OSError(28, "No space left on device")),
            FAILURE,
            "error: cannot print the results (No space left on device); give them another place to go\n",
        ),
    ],
)
def test_command__ends_with_a_code_and_one_line(
    does: Callable[[], int], code: int, line: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stdout", sys.stdout)  # which a command that cannot print gives up
    assert run(does) == code
    assert capsys.readouterr().err == line


def test_full_stdout__is_told_though_it_shows_at_the_end_only(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    class Full(io.StringIO):
        def flush(self) -> None:
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(sys, "stdout", Full())
    assert run(lambda: print("done") or 0) == FAILURE
    assert "cannot print the results" in capsys.readouterr().err


def test_ascii_terminal__gets_what_it_lacks_written_out(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    monkeypatch.setattr(sys, "stdout", terminal)
    assert run(lambda: print("3–1") or 0) == 0
    assert terminal.buffer.getvalue() == b"3\\u20131\n"  # type: ignore[attr-defined]


@pytest.mark.slow
@pytest.mark.parametrize("module", ["agents.solve", "agents.export", "training.evaluate"])
def test_ctrl_c__while_modules_are_imported_is_one_line(module: str, tmp_path: Path) -> None:
    """The process says that it has begun by the file that its first import of typer opens."""
    mark = tmp_path / "begun"
    (tmp_path / "typer").mkdir()
    (tmp_path / "typer" / "__init__.py").write_text(
        f"import pathlib, time\npathlib.Path({str(mark)!r}).touch()\ntime.sleep(60)\n"
    )
    path = os.pathsep.join((str(tmp_path), str(ROOT)))
    process = subprocess.Popen(
        [sys.executable, "-m", module, "x"],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": path},
        stderr=subprocess.PIPE,
        text=True,
    )
    while not mark.exists() and process.poll() is None:
        time.sleep(0.02)
    process.send_signal(2)
    _, said = process.communicate(timeout=30)
    assert (process.returncode, said) == (INTERRUPTED, "error: stopped by Ctrl-C\n")


ODD_COMMAND = """
from agents.commands.starting import guard_imports

guard_imports()
import sys
import typer
from agents.commands.running import run_command

app = typer.Typer()

@app.command()
def odd():
    exec("import os, signal\\nos.kill(os.getpid(), signal.SIGINT)\\nfor _ in range(10**6): pass")

sys.exit(run_command(app, [], "odd"))
"""


@pytest.mark.slow
def test_ctrl_c__in_an_exec_of_text_leaves_the_exit_code_alone(tmp_path: Path) -> None:
    """Of itself `python -m` ends by the signal there, though the KeyboardInterrupt was caught."""
    (tmp_path / "odd.py").write_text(ODD_COMMAND)
    path = os.pathsep.join((str(tmp_path), str(ROOT)))
    command = [sys.executable, "-m", "odd"]
    done = subprocess.run(command, env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (INTERRUPTED, "error: stopped by Ctrl-C\n")
