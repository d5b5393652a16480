"""How long commands are silent: `python -m benchmarks.silence [--terminal] [--only NAME ...]`.

Every command does a small job of its own, its output into a pipe, as into a log, or into a terminal, where bars move.
Counted is the longest time without a letter of output, from the start to the end. Exit code 1 if it is over the bound.
"""

import argparse
import os
import pty
import select
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.small_jobs import ROOT, SmallJob, small_jobs

MOST_SILENT = 5.0  # seconds
_ENOUGH = 65536  # bytes of output that are read at once


@dataclass(frozen=True)
class Heard:
    """What was heard of a command."""

    seconds: float
    silence: float  # the longest, seconds
    after: str  # what was said before it
    code: int


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the jobs and print a line for each."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.silence", description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", default=(), help="names of commands, or parts of them")
    parser.add_argument("--folder", type=Path, help="where what is written is kept")
    parser.add_argument("--terminal", action="store_true", help="into a terminal, not into a pipe")
    given = parser.parse_args(arguments)
    folder = given.folder or Path(tempfile.mkdtemp(prefix="silence-"))
    longest = 0.0
    for job in small_jobs(folder):
        if given.only and not any(part in job.name for part in given.only):
            continue
        heard = listen(job, folder, in_terminal=given.terminal)
        longest = max(longest, heard.silence)
        row = f"{job.name:34} exit {heard.code:3} {heard.seconds:6.1f} s, silent {heard.silence:4.1f} s"
        print(f"{row} after {heard.after!r}", flush=True)
    print(f"longest silence: {longest:.1f} s")
    return int(longest > MOST_SILENT)


def listen(job: SmallJob, folder: Path, *, in_terminal: bool) -> Heard:
    """Run a command to its end and listen to all that it says."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "80", "TERM": "xterm"}
    if job.compiles:
        environment["NUMBA_CACHE_DIR"] = tempfile.mkdtemp(prefix="kernels-", dir=folder)
    reader, writer = pty.openpty() if in_terminal else os.pipe()
    began = last = time.monotonic()
    child = subprocess.Popen(job.words, stdin=subprocess.DEVNULL, stdout=writer, stderr=writer, env=environment)
    os.close(writer)
    silence, said, after = 0.0, "", ""
    is_open = True
    while is_open:
        ready, _, _ = select.select([reader], [], [], 1.0)
        if ready:
            heard = _read(reader)
            now, is_open = time.monotonic(), bool(heard)
            if now - last > silence:
                silence, after = now - last, said.strip()[-60:]
            last, said = now, (said + heard)[-200:]
    os.close(reader)
    return Heard(time.monotonic() - began, silence, after, child.wait())


def _read(reader: int) -> str:
    """What there is; nothing at the end, which a terminal tells by an error."""
    try:
        return os.read(reader, _ENOUGH).decode(errors="replace")
    except OSError:
        return ""


if __name__ == "__main__":
    sys.exit(main())
