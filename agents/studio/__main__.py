"""The command `python -m agents.studio`: a page in the browser where one watches a search and says what matters."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from agents.commands.running import run_command
from agents.extras import require

HELP = """Open the studio: a page in the browser that builds meshes of pictures while
one watches, and lets one say what matters.

\b
Examples:
  python -m agents.studio
  python -m agents.studio mug.png
  python -m agents.studio out/mug/sequence.json
  python -m agents.studio drawings/

\b
It serves this machine alone, at an address with a random word in it, and
loads nothing from elsewhere. Ctrl-C ends it; what is finished is then kept
in --out, a folder for each picture, and named (docs/studio.md).

Exit codes: 0 all is well, 1 something failed, 2 wrong usage, 130 Ctrl-C.
"""

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode="rich")


@app.command(help=HELP, context_settings={"help_option_names": ["-h", "--help"]})
def studio(
    given: Annotated[
        list[str] | None,
        typer.Argument(metavar="IMAGE|sequence.json|FOLDER", help="What to begin with.", show_default="nothing"),
    ] = None,
    port: Annotated[int, typer.Option(min=0, max=65535, help="The port; 0 is any that is free.")] = 0,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Open no browser; the address is printed.")] = False,
    out: Annotated[Path, typer.Option(help="Folder for what is finished at the end.")] = Path("out"),
) -> int:
    """Find what is to be opened, and serve; return the exit code."""
    require("studio", "the studio", "starlette", "uvicorn")
    from agents.studio.server import serve
    from autopoly_env.silhouette import find_images

    paths: list[Path] = []
    for text in given or []:
        paths += [Path(text)] if text.endswith(".json") else find_images([text], [])
    return serve(paths, port, out, opens_browser=not no_browser)


def main(arguments: list[str] | None = None) -> int:
    """Run the command; whatever is wrong is told in one line on stderr. Returns the exit code."""
    return run_command(app, arguments, "python -m agents.studio")


if __name__ == "__main__":
    sys.exit(main())
