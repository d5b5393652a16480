"""Ctrl-C while a command's modules are still being imported: one line and exit code 130, as later on.

`python -m` forgets the exit code where a KeyboardInterrupt came up in an `exec` of text, as when a dataclass is made,
though it was caught: it ends itself by SIGINT. So what was interrupted leaves by itself, when all else has been done.
"""

import atexit
import gc
import os
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import NoReturn

_LINE = b"error: stopped by Ctrl-C\n"
INTERRUPTED = 130
BEGAN = time.monotonic()  # when the command did, nearly
_is_command = _is_interrupted = False


def is_starting() -> bool:
    """Whether `python -m` is looking for the module to run: then this package is imported for a command."""
    return sys.argv[:1] == ["-m"]


def guard_imports() -> None:
    """Until `listen`, Ctrl-C ends the process at once: nothing is done yet that could be lost."""
    global _is_command
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _leave)
    if not _is_command:
        _is_command = True
        atexit.register(_leave_interrupted)  # before anybody else's, hence called after them


@contextmanager
def loading() -> Iterator[None]:
    """Where modules are imported: nothing of that is garbage, and to look for some takes a twentieth of a start."""
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()


def listen() -> None:
    """From now on Ctrl-C is a KeyboardInterrupt, as usual."""
    if signal.getsignal(signal.SIGINT) is _leave:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def note_interrupt() -> None:
    """The command ends by Ctrl-C: with exit code 130, whatever Python makes of it."""
    global _is_interrupted
    _is_interrupted = True


def _leave_interrupted() -> None:
    if not _is_interrupted:
        return
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError, AttributeError):
            stream.flush()
    os._exit(INTERRUPTED)


def _leave(_number: int, _frame: FrameType | None) -> NoReturn:
    os.write(2, _LINE)
    os._exit(INTERRUPTED)
