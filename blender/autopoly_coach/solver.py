"""AutoPoly itself, run as another program: what it is doing, and how it is stopped. Nothing of it is imported."""

import os
import shutil
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

PATIENCE = 5.0  # seconds that it has to end after it was asked to
LINES_KEPT = 50


class SolverError(Exception):
    """It could not be run, or failed; one line says why."""


class Solver:
    """A run of AutoPoly in a folder of its own, which goes with it."""

    def __init__(self, python: str, arguments: Sequence[str], expected: str, seconds: float = 0.0) -> None:
        """Start `python -m ...`; "{out}" in an argument is the folder, in which it is expected to leave a file.

        `seconds` is how long it may search, for the share that is done. Raises SolverError if it does not start.
        """
        self._seconds, self._begin, self._expected = seconds, time.monotonic(), expected
        self._asked_to_stop = 0.0
        if not python.strip() or shutil.which(python) is None:
            raise SolverError(
                f"there is no Python at {python!r}; set the path of one that has AutoPoly, in the preferences"
                if python.strip()
                else "AutoPoly is not set up: give the path of a Python that has it, in the preferences of this add-on"
            )
        self._folder = tempfile.mkdtemp(prefix="autopoly-coach-")
        command = [python, "-m", *(argument.replace("{out}", self._folder) for argument in arguments)]
        group = {"creationflags": 0x200} if os.name == "nt" else {"start_new_session": True}
        try:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                encoding="utf-8",
                errors="replace",
                env=_environment(),
                **group,
            )
        except OSError as error:
            self.clear()
            raise SolverError(f"{python} cannot be run ({error.strerror}); set another in the preferences") from None
        self._lines: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def is_running(self) -> bool:
        """Whether it still works; who was asked to stop and does not is ended."""
        if self._asked_to_stop and time.monotonic() - self._asked_to_stop > PATIENCE and self._process.poll() is None:
            _kill(self._process)
        return self._process.poll() is None

    @property
    def share(self) -> float:
        """How much of its time is over, 0 to 1."""
        return min(1.0, (time.monotonic() - self._begin) / self._seconds) if self._seconds else 0.0

    @property
    def words(self) -> str:
        """How long it has worked."""
        verb = "Stopping" if self._asked_to_stop else "Building"
        return f"{verb}: {time.monotonic() - self._begin:.0f} s"

    def stop(self) -> None:
        """Ask it to end, as Ctrl-C does."""
        if self.is_running and not self._asked_to_stop:
            self._asked_to_stop = time.monotonic()
            if os.name == "nt":
                self._process.terminate()
            else:
                self._process.send_signal(signal.SIGINT)

    def result(self) -> Path:
        """The file that it has left. Raises SolverError, with its own last line, where there is none."""
        code = self._process.wait()
        self._reader.join(PATIENCE)
        if self._asked_to_stop:
            raise SolverError("stopped; nothing was changed")
        found = sorted(Path(self._folder).glob(self._expected))
        if not found:
            told = [line for line in self._lines if line.strip()]
            errors = [line for line in told if "error" in line.lower()]
            last = (errors or told or ["it said nothing"])[-1]
            raise SolverError(f"AutoPoly ended with exit code {code}: {' '.join(last.split())[:300]}")
        return found[0]

    def clear(self) -> None:
        """Take its folder away, and end it if it still works."""
        if hasattr(self, "_process") and self._process.poll() is None:
            _kill(self._process)
            self._process.wait()
        shutil.rmtree(self._folder, ignore_errors=True)

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._lines = [*self._lines[1 - LINES_KEPT :], line]
        self._process.stdout.close()


def _environment() -> dict[str, str]:
    """What says where Blender's Python lies is not meant for another one."""
    return {name: value for name, value in os.environ.items() if name != "PYTHONHOME"}


def _kill(process: "subprocess.Popen[str]") -> None:
    """End it with the processes that it has started."""
    if os.name == "nt":
        process.kill()
    else:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
