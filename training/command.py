"""What all commands of the workshop do with errors: one line on stderr and an exit code."""

import sys

import typer

from autopoly_env.errors import AutoPolyError, ConfigError

FAILURE, USAGE_ERROR, INTERRUPTED = 1, 2, 130


def run_command(app: typer.Typer, arguments: list[str] | None, name: str) -> int:
    """Run a typer command. 0: all is well, 1: something failed, 2: wrong usage or settings, 130: Ctrl-C."""
    try:
        return app(arguments, prog_name=name, standalone_mode=False) or 0
    except ConfigError as error:
        return _complain(str(error), USAGE_ERROR)
    except AutoPolyError as error:
        return _complain(str(error), FAILURE)
    except (KeyboardInterrupt, typer.Abort):
        return _complain("stopped by Ctrl-C; the same command goes on from here", INTERRUPTED)
    except Exception as error:
        if not hasattr(error, "format_message"):  # which typer's own usage errors have
            raise
        return _complain(f"{error.format_message()} (see --help)", USAGE_ERROR)


def _complain(message: str, exit_code: int) -> int:
    print("error:", " ".join(message.split()), file=sys.stderr)
    return exit_code
