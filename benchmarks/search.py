"""How good the search is, in six measurements: `python -m benchmarks.search COMMAND`."""

import os
import platform
import shlex
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.status import Status

from agents.commands.running import run_command
from autopoly_env.errors import ConfigError, SilhouetteError
from autopoly_env.files import write_atomically
from autopoly_env.mesh import face_rule
from autopoly_env.silhouette import find_images
from benchmarks import report, search_rows
from benchmarks.curves import need_matplotlib
from benchmarks.report import Row
from benchmarks.search_cases import Case, Records, Results, made
from benchmarks.search_curves import draw_curves
from benchmarks.search_learning import learning_rows

HELP = """Measure the tree search. Each command prints one table.

\b
Examples:
  python -m benchmarks.search gap --limit 10
  python -m benchmarks.search anytime --picture docs/pictures/anytime.svg
  python -m benchmarks.search ablation my/silhouettes --workers 2
  python -m benchmarks.search dominance --seconds 5

\b
What was measured is kept in RECORDS/COMMAND.jsonl, a line for each agent and
shape: a run that was stopped goes on where it was. --fresh measures anew, which
changed code makes necessary; what the oracle found stays.
"""
_FILE_WIDTH = 140  # columns, where the output is no terminal
_EXAMPLES = Path(__file__).resolve().parents[1] / "examples"

app = typer.Typer(help=HELP, add_completion=False, pretty_exceptions_enable=False, rich_markup_mode="rich")
Folder = Annotated[Path, typer.Argument(metavar="FOLDER", help="Silhouettes.", show_default="examples/")]
Limit = Annotated[int | None, typer.Option(min=1, help="Only the first so many shapes.", show_default="all")]
Workers = Annotated[int, typer.Option(min=1, help="Processes of one thread each; 1: this one, with all threads.")]
Fresh = Annotated[bool, typer.Option("--fresh", help="Forget what was measured earlier.")]
Kept = Annotated[Path, typer.Option(metavar="FOLDER", help="Where results are kept.")]
Refits = Annotated[int, typer.Option(min=1, help="Refits a shape.")]
_RECORDS = Path("out/search")


class _Bench:
    """The console of one command, and the files of results behind it."""

    def __init__(self, records: Path, n_workers: int, fresh: bool) -> None:
        self.console = Console() if sys.stdout.isatty() else Console(width=_FILE_WIDTH)
        self.n_failed = 0
        self._folder, self._n_workers, self._fresh = records, n_workers, fresh

    def completer(self, name: str, keep: bool = False) -> search_rows.Complete:
        """Gets results for cases, from the file of this name or by measuring; `keep`: whatever --fresh says."""
        records = Records(self._folder / f"{name}.jsonl")
        if self._fresh and not keep:
            records.forget()

        def complete(cases: Iterable[Case]) -> Results:
            cases = list(dict.fromkeys(cases))
            missing = [case for case in cases if case not in records.results]
            with self._counting(name, len(missing)) as done:
                return records.complete(cases, self._n_workers, done)

        return complete

    @contextmanager
    def _counting(self, name: str, n: int) -> Iterator[search_rows.OnDone]:
        n_done = 0
        with Status(f"{name}: 0 of {n}", console=Console(stderr=True)) as status:

            def done(case: Case, error: str) -> None:
                nonlocal n_done
                n_done += 1
                status.update(f"{name}: {n_done} of {n}, {case.name}")
                if error:
                    self.n_failed += 1
                    print(f"failed: {case.name}: {error}", file=sys.stderr)

            yield done

    def show(self, title: str, rows: Iterable[Row]) -> None:
        """Print the table; exit with 1 where a case has failed."""
        measured = list(rows)
        cores = f"{platform.machine()}, {os.cpu_count()} cores"
        load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
        command = shlex.join(["python", "-m", "benchmarks.search", *sys.argv[1:]])
        report.show([(title, measured)], f"{command}\n{cores}{load}", self.console)
        if self.n_failed:
            raise typer.Exit(1)


@app.command()
def gap(
    limit: Annotated[int, typer.Option(min=1, help="How many shapes.")] = 100,
    refits: Refits = 400,
    width: Annotated[int, typer.Option(min=1, help="Of the oracle's beam.")] = 64,
    faces: Annotated[str, typer.Option(help="Rule of faces: any, convex or quads.")] = "any",
    workers: Workers = 1,
    records: Kept = _RECORDS,
    fresh: Fresh = False,
) -> None:
    """How far mcts (under a rule of faces quads) stays below a very wide beam on constructions, w_sc 1."""
    face_rule(faces)
    bench = _Bench(records, workers, fresh)
    oracle = bench.completer("oracle", keep=True)
    rows = search_rows.gap_rows(bench.completer("gap"), oracle, limit, refits, width, faces)
    bench.show("gap to the oracle, constructions of difficulty 1 to 5, w_sc 1", rows)


@app.command()
def anytime(
    folder: Folder = _EXAMPLES,
    budgets: Annotated[str, typer.Option(help="Refits, separated by commas.")] = ",".join(
        map(str, search_rows.BUDGETS)
    ),
    picture: Annotated[Path | None, typer.Option(metavar="FILE", help="Draw the curves, too: an SVG.")] = None,
    limit: Limit = None,
    workers: Workers = 1,
    records: Kept = _RECORDS,
    fresh: Fresh = False,
) -> None:
    """Mean r_all against refits: mcts, the paper's search, greedy, beam, and the best of random plays."""
    if picture is not None:
        need_matplotlib()  # said before hours of measuring
    targets, refits = _targets(folder, limit), _numbers(budgets)
    bench = _Bench(records, workers, fresh)
    totals = search_rows.anytime_results(bench.completer("anytime"), targets, refits)
    if picture is not None:
        write_atomically(picture, draw_curves(totals))
    bench.show("mean r_all of whole solves within a budget", search_rows.anytime_rows(totals, len(targets)))


@app.command()
def ablation(
    folder: Folder = _EXAMPLES,
    refits: Refits = 1500,
    limit: Limit = None,
    workers: Workers = 1,
    records: Kept = _RECORDS,
    fresh: Fresh = False,
) -> None:
    """mcts with one option changed at a time, against its default, at equal refits."""
    targets = _targets(folder, limit)
    bench = _Bench(records, workers, fresh)
    rows = search_rows.ablation_rows(bench.completer("ablation"), targets, refits)
    bench.show(f"options of mcts, {refits} refits: mean r_all, against the default's", rows)


@app.command()
def overhead(folder: Folder = _EXAMPLES, refits: Refits = 1500, limit: Limit = None) -> None:
    """The share of the time of mcts that is not spent in refits, on one thread; nothing is kept."""
    bench = _Bench(_RECORDS, 1, fresh=False)
    targets = _targets(folder, limit)
    with bench.console.status("overhead"):
        rows = list(search_rows.overhead_rows(targets, refits))
    bench.show("share of the wall time of mcts, one thread", rows)


@app.command()
def dominance(
    folder: Folder = _EXAMPLES,
    seconds: Annotated[float, typer.Option(min=0.0, help="For mcts, a shape.")] = 5.0,
    limit: Limit = None,
    workers: Workers = 1,
    records: Kept = _RECORDS,
    fresh: Fresh = False,
) -> None:
    """mcts with some seconds a shape against greedy, beam, trace and decimate, which take what they need."""
    targets = _targets(folder, limit)
    bench = _Bench(records, workers, fresh)
    rows = search_rows.dominance_rows(bench.completer("dominance"), targets, seconds)
    bench.show(f"r_all of mcts in {seconds:g} s a shape, shape by shape", rows)


@app.command()
def learning(
    folder: Annotated[Path | None, typer.Argument(metavar="FOLDER", help="Silhouettes, beside what is made.")] = None,
    made_each: Annotated[int, typer.Option(min=1, help="Constructions, and as many objects.")] = 48,
    w_sc: Annotated[float, typer.Option(min=0.0, help="Price of an element.")] = 0.3,
    budgets: Annotated[str, typer.Option(help="Refits, separated by commas.")] = "50,100,200,400",
    seconds: Annotated[str, typer.Option(help="Seconds, separated by commas.", show_default="none")] = "",
    faces: Annotated[str, typer.Option(help="Rule of faces: any (the paper's style), convex or quads.")] = "any",
    limit: Limit = None,
    workers: Workers = 1,
    records: Kept = _RECORDS,
    fresh: Fresh = False,
) -> None:
    """What networks add to the search at equal budgets, and what an oracle in their place would."""
    face_rule(faces)
    sets = {"constructions": made("construction", made_each), "objects": made("objects", made_each)}
    if folder is not None:
        sets[folder.name] = _targets(folder, limit)
    bench = _Bench(records, workers, fresh)
    complete = bench.completer("learning")
    rows = learning_rows(complete, sets, w_sc, _numbers(budgets), _times(seconds), faces)
    bench.show(f"mean r_all with and without networks, w_sc {w_sc:g}, faces {faces}", rows)


def _targets(folder: Path, limit: int | None) -> list[str]:
    try:
        return [str(image) for image in find_images([folder])[:limit]]
    except SilhouetteError as error:
        raise ConfigError(str(error)) from None


def _numbers(given: str) -> list[int]:
    numbers = [part.strip() for part in given.split(",")]
    if not all(part.isdecimal() and int(part) > 0 for part in numbers):
        raise ConfigError(f"--budgets {given}: expected numbers of refits, such as 50,100,400")
    return sorted({int(part) for part in numbers})


def _times(given: str) -> list[float]:
    try:
        times = sorted({float(part) for part in given.split(",") if part.strip()})
    except ValueError:
        times = [-1.0]
    if not all(0.0 < time < float("inf") for time in times):
        raise ConfigError(f"--seconds {given}: expected numbers above 0, such as 0.2,1,5")
    return times


def main(arguments: list[str] | None = None) -> int:
    """Run a command; whatever is wrong is told in one line on stderr. Returns the exit code."""
    stopped = "stopped by Ctrl-C; what was measured is kept"
    return run_command(app, arguments, "python -m benchmarks.search", stopped=stopped)


if __name__ == "__main__":
    sys.exit(main())
