"""What all commands do with errors: one line on stderr and an exit code."""

import errno
import io
import os
import sys

import typer

from agents.commands.starting import INTERRUPTED, listen, note_interrupt
from autopoly_env.errors import AutoPolyError, ConfigError
from autopoly_env.shown import told

FAILURE, USAGE_ERROR = 1, 2
TOLD = -INTERRUPTED  # what a command returns that has told of its Ctrl-C itself
STOPPED = "stopped by Ctrl-C"
GOES_ON = "stopped by Ctrl-C; the same command goes on from what was saved last"


def run_command(app: typer.Typer, arguments: list[str] | None, name: str, *, stopped: str = STOPPED) -> int:
    """Run a typer command; whatever is wrong is told in one line on stderr.

    Returns the exit code. 0: all is well, 1: something failed, 2: wrong usage or settings, 130: Ctrl-C, of which
    `stopped` tells, unless the command returns `TOLD`.
    """
    _print_whatever()
    listen()
    try:
        code: int = app(arguments, prog_name=name, standalone_mode=False) or 0
    except ConfigError as error:
        return complain(str(error), USAGE_ERROR)
    except AutoPolyError as error:
        return complain(str(error), FAILURE)
    except KeyboardInterrupt:
        code = INTERRUPTED
    except OSError as error:
        if error.errno == errno.EPIPE:  # whoever read the results wants no more
            raise
        return _unprinted(error)
    except Exception as error:
        if not hasattr(error, "format_message"):  # which typer's own usage errors have
            raise
        return complain(f"{error.format_message()} (see --help)", USAGE_ERROR)
    if code in (TOLD, INTERRUPTED):
        note_interrupt()
    if code == TOLD:
        return INTERRUPTED
    if code == INTERRUPTED:  # typer makes that of a KeyboardInterrupt
        return complain(stopped, code)
    return _flushed(code)


def complain(message: str, exit_code: int) -> int:
    """Tell what is wrong in one line; returns the exit code."""
    print("error:", told(message), file=sys.stderr)
    return exit_code


def _print_whatever() -> None:
    """What an output's encoding lacks is written out there, such as an en dash as ASCII."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _flushed(code: int) -> int:
    """The code, once what was printed has arrived; FAILURE where there was no room for it."""
    try:
        if sys.stdout is not None:
            sys.stdout.flush()
    except OSError as error:
        if error.errno == errno.EPIPE:
            raise
        return _unprinted(error)
    return code


def _unprinted(error: OSError) -> int:
    """Tell that the results were not printed; returns FAILURE."""
    sys.stdout = open(os.devnull, "w")  # noqa: SIM115 (so that leaving does not fail on it again)
    return complain(f"cannot print the results ({error.strerror or error}); give them another place to go", FAILURE)
