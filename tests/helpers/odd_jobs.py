"""What workers are given in the tests of `map_tasks`: plain sums, and all that can go wrong with one."""

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

Job = tuple[str, Any]


def do(job: Job) -> Any:
    """Do a job: what, and with what."""
    what, given = job
    return JOBS[what](given)


def _fail(text: str) -> None:
    raise ValueError(text)


def _die_once(flag: str) -> str:
    """Leave a file behind and die; do nothing where the file is there already."""
    if not Path(flag).exists():
        Path(flag).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return "survived"


def _slow_square(x: int) -> int:
    time.sleep(0.5)
    return x * x


def _threads(_: None) -> tuple[str, int]:
    import torch

    return os.environ["AUTOPOLY_THREADS"], torch.get_num_threads()


def _linger(pid_file: str) -> None:
    """Tell who does it, and take far too long."""
    Path(pid_file).write_text(str(os.getpid()))
    time.sleep(600.0)


JOBS: dict[str, Callable[[Any], Any]] = {
    "square": lambda x: x * x,
    "slow square": _slow_square,
    "fail": _fail,
    "exit": os._exit,
    "die once": _die_once,
    "threads": _threads,
    "variable": os.environ.get,
    "linger": _linger,
    "sleep": time.sleep,
    "length": len,
    "lambda": lambda _: lambda: None,
}
