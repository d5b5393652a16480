"""The command `python -m training.compare`: the results of several runs side by side, as a page to look at."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from agents.commands.running import run_command
from agents.commands.screen import say
from autopoly_env.errors import ConfigError
from autopoly_env.files import write_atomically
from training.report.comparison import Row, read_runs, rows_of
from training.report.headline import SCREEN_HEADS, markdown_report, record_of, screen_lines
from training.report.page import page_html
from training.report.table import as_csv, as_rich

HELP = """Compare the agents of one or more runs of training.evaluate.

\b
Examples:
  python -m training.compare runs/mine
  python -m training.compare runs/before runs/after --baseline "climb (before)" --out changes.html
  python -m training.compare runs/* --json | jq .r_all

\b
Written are, whole or not at all,
  report.html  tables, charts and every agent's meshes of the worst targets: one file that needs no network
  report.md    the headline table, to paste    report.csv  the same with all digits

An agent that several runs have is called "agent (run)". Numbers are means over targets with 95 % bootstrap intervals;
the baseline, by default the suite's or else the first agent, is what wins and losses are counted against.

Exit codes: 0 all is well, 1 a run cannot be read or the report cannot be written, 2 wrong usage, 130 Ctrl-C.
"""

PLAIN_WIDTH = 150  # of a table that goes to a file
N_CARDS = 60

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode="rich")


@app.command(help=HELP, context_settings={"help_option_names": ["-h", "--help"]})
def compare(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN", help="Folders that training.evaluate has written.")],
    out: Annotated[Path, typer.Option(help="The page; .md and .csv lie beside it.")] = Path("report.html"),
    baseline: Annotated[
        str | None, typer.Option(help="The label of an agent.", show_default="that of the suite")
    ] = None,
    title: Annotated[str, typer.Option(help="What the page is called.")] = "AutoPoly: agents compared",
    gallery: Annotated[int, typer.Option(help="Targets whose meshes are shown, the worst ones.")] = N_CARDS,
    as_json: Annotated[bool, typer.Option("--json", help="Print a JSON record an agent, no table.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="Print no table.")] = False,
) -> int:
    """Read everything, then write the three files and show the table."""
    if out.suffix not in (".html", ".htm"):
        raise ConfigError(f"--out {out}: expected a name that ends in .html")
    if gallery < 0:
        raise ConfigError(f"--gallery {gallery}: expected 0 or more targets")
    comparison = read_runs(runs, baseline)
    rows = rows_of(comparison)
    page = page_html(comparison, rows, gallery, title)
    texts = {
        out.with_suffix(".md"): markdown_report(rows, comparison.baseline, comparison.notes),
        out.with_suffix(".csv"): as_csv([record_of(row) for row in rows]),
        out: page,
    }
    for path, text in texts.items():
        write_atomically(path, text.encode("utf-8", "replace"))
    messages = Console(stderr=True)
    for note in comparison.notes:
        say(messages, f"warning: {note}")
    if as_json:
        for row in rows:
            print(json.dumps(record_of(row), allow_nan=False))
    elif not quiet:
        _print_table(rows)
        say(Console(), f"Open {out}")
    return 0


def _print_table(rows: list[Row]) -> None:
    console = Console()
    if not console.is_terminal:
        console.width = PLAIN_WIDTH
    console.print(as_rich(SCREEN_HEADS, screen_lines(rows)))
    console.print("Means over targets with 95 % bootstrap intervals.", style="dim", highlight=False)


def main(arguments: list[str] | None = None) -> int:
    """Run the command; whatever is wrong is told in one line on stderr. Returns the exit code."""
    return run_command(app, arguments, "python -m training.compare")


if __name__ == "__main__":
    sys.exit(main())
