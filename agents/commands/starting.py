"""Ctrl-C while a command's modules are still being imported: one line and exit code 130, as later on."""

import os
import signal
import sys
from types import FrameType
from typing import NoReturn

_LINE = b"error: stopped by Ctrl-C\n"


def is_starting() -> bool:
    """Whether `python -m` is looking for the module to run: then this package is imported for a command."""
    return sys.argv[:1] == ["-m"]


def guard_imports() -> None:
    """Until `listen`, Ctrl-C ends the process at once: nothing is done yet that could be lost."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _leave)


def listen() -> None:
    """From now on Ctrl-C is a KeyboardInterrupt, as usual."""
    if signal.getsignal(signal.SIGINT) is _leave:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _leave(_number: int, _frame: FrameType | None) -> NoReturn:
    os.write(2, _LINE)
    os._exit(130)
