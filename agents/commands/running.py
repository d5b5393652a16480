"""What all commands do with errors: one line on stderr and an exit code."""

import sys

import typer

from autopoly_env.errors import AutoPolyError, ConfigError

FAILURE, USAGE_ERROR, INTERRUPTED = 1, 2, 130
GOES_ON = "stopped by Ctrl-C; the same command goes on from here"


def run_command(app: typer.Typer, arguments: list[str] | None, name: str, *, stopped: str = "stopped by Ctrl-C") -> int:
    """Run a typer command; whatever is wrong is told in one line on stderr.

    Returns the exit code. 0: all is well, 1: something failed, 2: wrong usage or settings, 130: Ctrl-C, of which
    `stopped` tells; empty for a command that tells itself.
    """
    try:
        code: int = app(arguments, prog_name=name, standalone_mode=False) or 0
    except ConfigError as error:
        return complain(str(error), USAGE_ERROR)
    except AutoPolyError as error:
        return complain(str(error), FAILURE)
    except Exception as error:
        if not hasattr(error, "format_message"):  # which typer's own usage errors have
            raise
        return complain(f"{error.format_message()} (see --help)", USAGE_ERROR)
    if code == INTERRUPTED and stopped:  # typer makes that of a KeyboardInterrupt
        return complain(stopped, code)
    return code


def complain(message: str, exit_code: int) -> int:
    """Tell what is wrong in one line; returns the exit code."""
    print("error:", " ".join(message.split()), file=sys.stderr)
    return exit_code
