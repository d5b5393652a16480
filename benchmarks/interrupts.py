"""Ctrl-C at random moments of every command: `python -m benchmarks.interrupts [--only NAME ...] [--n 30] --folder DIR`.

Each command runs `n` times in a session of its own, and its whole group gets SIGINT at a moment drawn between its start
and its usual end, as a terminal does it. It has to end within `PATIENCE` seconds with exit code 130, one line about it
and no traceback, and to leave no process behind. `--folder` has what `benchmarks.silence --folder` has written.
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from benchmarks.small_jobs import ROOT, SmallJob, small_jobs

PATIENCE = 30.0  # seconds
EARLIEST = 0.4  # seconds after the start: before it reads the first line of ours, Python tells of Ctrl-C by itself
LATEST = 12.0
LINE = "stopped by Ctrl-C"


def main(arguments: Sequence[str] | None = None) -> int:
    """Interrupt the jobs and print a line for each."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.interrupts", description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", default=(), help="names of commands, or parts of them")
    parser.add_argument("--n", type=int, default=30, help="how often each is interrupted")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--latest", type=float, default=LATEST, help="seconds after the start")
    parser.add_argument("--folder", type=Path, required=True, help="which `benchmarks.silence` has written into")
    given = parser.parse_args(arguments)
    rng = np.random.default_rng(given.seed)
    is_sound = True
    for number, name in enumerate(job.name for job in small_jobs(given.folder)):
        if given.only and not any(part in name for part in given.only):
            continue
        counts: Counter[str] = Counter()
        for moment in rng.uniform(EARLIEST, given.latest, given.n):
            folder = Path(tempfile.mkdtemp(prefix="interrupts-"))
            job = list(small_jobs(folder, given.folder))[number]
            faults = list(interrupted(job, folder, float(moment)))
            counts.update(faults)
            for fault in set(faults) - {"ended before"}:
                print(f"  {name} at {moment:.2f} s: {fault}", flush=True)
        is_sound &= not set(counts) - {"ended before"}
        print(f"{name:34} {given.n} times, {dict(counts) or 'all sound'}", flush=True)
    return int(not is_sound)


def interrupted(job: SmallJob, folder: Path, moment: float) -> Iterator[str]:
    """What was not as it has to be; "ended before" where the command was over at that moment."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "80"}
    if job.compiles:
        environment["NUMBA_CACHE_DIR"] = str(folder / "kernels")
    with (folder / "output").open("w+", errors="replace") as output:
        child = subprocess.Popen(
            job.words,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
            env=environment,
            start_new_session=True,
            restore_signals=True,
        )
        time.sleep(moment)
        if child.poll() is not None:
            yield "ended before"
            return
        os.killpg(child.pid, signal.SIGINT)
        try:
            code = child.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            yield f"goes on after {PATIENCE:.0f} s"
            os.killpg(child.pid, signal.SIGKILL)
            child.wait()
            return
        said = (folder / "output").read_text(errors="replace")
    if code != 130:
        yield f"exit code {code}: {said[-300:]!r}"
    if said.count(LINE) != 1:
        yield f"{said.count(LINE)} lines: {said[-300:]!r}"
    if "Traceback" in said:
        yield f"a traceback: {said[-1200:]!r}"
    time.sleep(0.1)
    if _is_group_alive(child.pid) and not _ends(child.pid, 3.0):
        yield "processes are left"
        os.killpg(child.pid, signal.SIGKILL)


def _ends(group: int, within: float) -> bool:
    """Whether a group of processes is gone in time."""
    until = time.monotonic() + within
    while _is_group_alive(group):
        if time.monotonic() > until:
            return False
        time.sleep(0.05)
    return True


def _is_group_alive(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


if __name__ == "__main__":
    sys.exit(main())
