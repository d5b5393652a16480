"""The command `python -m training.evaluate`: measure agents on a suite of targets, resumably and in parallel."""

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from agents.commands.running import FAILURE, TOLD, run_command
from agents.commands.screen import say
from autopoly_env.errors import ConfigError

if TYPE_CHECKING:
    from training.evaluation.suite import Suite

FOLDER = Path("out/evaluate")
PLAIN_WIDTH = 132  # of a table that goes to a file

HELP = """Measure agents on the targets of a suite; the table at the end compares them.

\b
Examples:
  python -m training.evaluate paper
  python -m training.evaluate my/images --agents climb,trace --budget refits=500
  python -m training.evaluate objects --set targets.n=10 --out out/small
  python -m training.evaluate paper --resume
  python -m training.evaluate paper --engine ray --ray-address auto
  python -m training.evaluate paper --shard 1/2 --out out/a    (and 2/2 elsewhere)
  python -m training.evaluate --merge out/a out/b --out out/paper

\b
A suite is a file configs/suite/NAME.yaml, any other YAML file of that kind, or a folder of images.
OUT gets run.json, records.jsonl (a line for each agent, target and seed, written as it comes),
targets/, table.md and table.csv. A run that was killed goes on with --resume: nothing is lost or
done twice; what failed is tried again.

Exit codes: 0 all is well, 1 something failed, 2 wrong usage, 130 Ctrl-C.
"""

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode="rich")


@app.command(help=HELP, context_settings={"help_option_names": ["-h", "--help"]})
def evaluate(
    suite: Annotated[list[str], typer.Argument(metavar="SUITE|DIR", help="With --merge: the folders of runs.")],
    agents: Annotated[
        str | None,
        typer.Option(
            help="Labels or agents (my.module:Agent for one of yours), separated by commas.",
            show_default="all of the suite",
        ),
    ] = None,
    budget: Annotated[
        str | None, typer.Option(metavar="refits=N|seconds=S", help="For every agent.", show_default="the suite's")
    ] = None,
    override: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="A key of the suite, such as targets.n=10.")
    ] = None,
    faces: Annotated[
        str | None, typer.Option(help="Rule of faces: any, convex or quads.", show_default="the suite's")
    ] = None,
    baseline: Annotated[
        str | None, typer.Option(help="Whom wins and losses are against.", show_default="the suite's")
    ] = None,
    engine: Annotated[str, typer.Option(help="serial, process or ray.")] = "process",
    workers: Annotated[int | None, typer.Option(help="How many at once.", show_default="the cores there are")] = None,
    ray_address: Annotated[
        str | None, typer.Option(help="Of a Ray cluster: auto or host:port.", show_default="one is started here")
    ] = None,
    shard: Annotated[str, typer.Option(metavar="K/N", help="Every N-th target, from number K on.")] = "1/1",
    out: Annotated[
        Path | None, typer.Option(help="Folder of the run.", show_default="out/evaluate/ and the suite's name")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the run in OUT, if there is one.")] = False,
    fresh: Annotated[bool, typer.Option("--fresh", help="Replace the run in OUT.")] = False,
    merge: Annotated[bool, typer.Option("--merge", help="Join the shards of a run in OUT.")] = False,
    columns: Annotated[
        str,
        typer.Option(
            metavar="NAMES",
            help="What the table shows: lesson, or names of --json with commas, such as r_all,quads,effort.",
        ),
    ] = "",
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the rows of the table as JSON, a line each, and no table.")
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress.")] = False,
) -> int:
    """Check what can be checked before the work, do it, show the table; return the exit code."""
    from agents.commands.columns import read_columns
    from training.evaluation.folder import merge as merge_runs
    from training.evaluation.run import Machines, TargetShard, run_suite
    from training.evaluation.table import KNOWN
    from training.report.table import FORMATS

    shown = read_columns(columns, KNOWN, FORMATS)
    _check_flags(suite, resume=resume, fresh=fresh, merge=merge)
    if merge:
        folder = out or FOLDER / "merged"
        merge_runs([Path(part) for part in suite], folder, fresh=fresh)
        return _finish(folder, baseline, as_json, shown, set())
    overrides = [*(override or []), *([] if faces is None else [f"faces={faces}"])]
    found, only = _read(suite[0], overrides, budget, agents, baseline)
    part = TargetShard.parse(shard)
    folder = out or FOLDER / (found.name + (f"-{part.k}of{part.n}" if part.n > 1 else ""))
    machines = Machines(engine, workers, ray_address)
    try:
        run_suite(found, folder, machines, only=only, shard=part, resume=resume, fresh=fresh, quiet=quiet)
    except KeyboardInterrupt:
        print(f"stopped by Ctrl-C; what was done is in {folder}: go on with --resume", file=sys.stderr)
        return TOLD
    return _finish(folder, baseline, as_json, shown, only)


def _check_flags(given: list[str], *, resume: bool, fresh: bool, merge: bool) -> None:
    """Raise ConfigError for options that contradict each other."""
    if resume and fresh:
        raise ConfigError("--resume and --fresh: give one of them")
    if merge and resume:
        raise ConfigError("--merge and --resume: merge first, then go on with --resume --out MERGED")
    if not merge and len(given) != 1:
        raise ConfigError(f"{len(given)} suites ({', '.join(given)}): give one, or --merge to join runs")


def _read(
    given: str, overrides: list[str], budget: str | None, agents: str | None, baseline: str | None
) -> "tuple[Suite, set[str]]":
    """The suite with all that the command line says about it, and the labels to run (none: all)."""
    from training.evaluation.suite import chosen, find_suite, with_budget

    suite = find_suite(given, overrides)
    if budget is not None:
        suite = with_budget(suite, budget)
    suite, only = chosen(suite, [name for name in (agents or "").split(",") if name])
    suite.check_baseline(baseline)
    return suite, only


def _finish(folder: Path, baseline: str | None, as_json: bool, columns: tuple[str, ...], only: set[str]) -> int:
    """Write the table of a run and show it, of the labels in `only`, if it has any; 1 if some of its tasks failed."""
    from rich.console import Console

    from training.evaluation.folder import suite_of
    from training.evaluation.table import heads_of, lines_of, records_of, table_of, write_tables
    from training.records import read_info, read_records
    from training.report.table import as_rich_parts

    info, records = read_info(folder), read_records(folder)
    suite = suite_of(info, folder)
    suite.check_baseline(baseline)
    table = table_of(suite, records, info.targets, suite.missing(), baseline)
    write_tables(folder, table)
    if only:
        table = replace(table, rows=tuple(row for row in table.rows if row.label in only))
    if as_json:
        for row in records_of(table):
            print(json.dumps(row, allow_nan=False))
    else:
        console = Console()
        if not console.is_terminal:
            console.width = PLAIN_WIDTH
        for part in as_rich_parts(heads_of(columns), lines_of(table, columns), console.width):
            console.print(part)
        for line in (*table.notes, f"Open {folder / 'table.md'}"):
            say(console, line)
    n_failed = sum(record.outcome is None for record in records)
    if n_failed:
        print(f"{n_failed} of {len(records)} tasks failed: {folder / 'records.jsonl'} says why", file=sys.stderr)
    return FAILURE if n_failed else 0


def main(arguments: list[str] | None = None) -> int:
    """Run the command; whatever is wrong is told in one line on stderr. Returns the exit code."""
    return run_command(app, arguments, "python -m training.evaluate")


if __name__ == "__main__":
    sys.exit(main())
