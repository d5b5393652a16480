"""The command `python -m benchmarks.against REV`: another revision of this repository beside this one, in turn.

    python -m benchmarks.against HEAD~1                               # everything, on examples/; takes a while
    python -m benchmarks.against main --only env refit --rounds 21
    python -m benchmarks.against v0.1 --silhouettes DIR --limit 8 --json ratios.jsonl

The other revision's files are put into a temporary folder with a cache of kernels of their own, and removed in the end.
Both measure in turn, A B B A ..., and what is shown is the median over the rounds of this revision's value divided by
the other's, with a 95 % interval; of scores, the mean difference. `-` stands for what a revision cannot measure;
a line below says why. Seconds are CPU-seconds where the row says so, which other processes disturb least.
"""

import argparse
import json
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from statistics import median

import numpy as np
from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from autopoly_env.errors import AutoPolyError
from autopoly_env.silhouette import find_images
from benchmarks.against import rows
from benchmarks.against.paired import spread_of
from benchmarks.against.rows import DIFFERENCE, GROUPS, Given, Group, Row
from benchmarks.against.trees import ROOT, commit_of, tree_of, warm
from benchmarks.against.turns import Pair, Refused, player, take_turns
from benchmarks.report import quantity
from training.report import bootstrap_mean

_FILE_WIDTH = 150
_USAGE = 2


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table. 0, or 1 where this revision could not measure something, 2 for wrong usage, 130 for Ctrl-C."""
    options = _options(arguments)
    console = Console() if sys.stdout.isatty() else Console(width=_FILE_WIDTH)
    try:
        commit = commit_of(options.revision)
        images = tuple(str(image.resolve()) for image in find_images([options.silhouettes])[: options.limit])
        with tree_of(commit) as tree, tempfile.TemporaryDirectory(prefix="against-") as folder:
            given = Given(images, rows.draw_small(Path(folder) / "ring.png"), str(Path(folder) / "states.json"))
            return _Comparison(options, (tree, ROOT), given, console).run(f"{options.revision} ({commit[:9]})")
    except AutoPolyError as error:
        print("error:", error, file=sys.stderr)
        return _USAGE
    except KeyboardInterrupt:
        print("error: stopped by Ctrl-C", file=sys.stderr)
        return 130


class _Comparison:
    """One run of the command."""

    def __init__(self, options: argparse.Namespace, trees: Sequence[Path], given: Given, console: Console) -> None:
        self._options, self._trees, self._given, self._console = options, trees, given, console
        self._remarks: list[str] = []
        self._is_whole = True
        self._has_states = False

    def run(self, name: str) -> int:
        table = Table(box=box.SIMPLE_HEAD, padding=(0, 1))
        table.add_column("", min_width=30)
        for column in (name, "this one", "this / other", "95 % interval", "rounds"):
            table.add_column(column, justify="right", no_wrap=column != name)
        with self._console.status("compiling the kernels of both") as status:
            for tree in self._trees:
                warm(tree)
            for group in rows.names_of(self._options.only):
                status.update(group)
                for cells in self._measured(group, GROUPS[group]):
                    table.add_row(*cells)
                table.add_section()
        self._console.print(table)
        for remark in self._remarks:
            self._console.print(remark, markup=False, soft_wrap=True)
        return 0 if self._is_whole else 1

    def _measured(self, name: str, group: Group) -> list[tuple[str, ...]]:
        if group.needs_states:
            self._write_states()
        rounds = self._options.rounds or group.rounds or len(self._given.images)
        turns = list(take_turns(self._trees, group.probe, group.settings(self._given), rounds, afresh=group.afresh))
        pairs, why = [pair for pair, _ in turns], turns[-1][1]
        for who, reason in zip((self._options.revision, "this one"), why, strict=True):
            if reason:
                self._remarks.append(f"- {name}, {who}: {reason}")
        self._is_whole &= not why[1]
        self._keep(name, group, pairs)
        return [_cells(row, pairs) for row in group.rows]

    def _write_states(self) -> None:
        """The meshes to refit, by the other revision, or by this one where that cannot."""
        for tree in self._trees if not self._has_states else ():
            try:
                with player(tree, "states", {"images": self._given.images, "states": self._given.states}) as writer:
                    writer.measure(0)
                self._has_states = True
                return
            except Refused as reason:
                self._remarks.append(f"- states to refit: {reason}")

    def _keep(self, name: str, group: Group, pairs: Sequence[Pair]) -> None:
        if self._options.json is None:
            return
        with self._options.json.open("a", encoding="utf-8") as stream:
            for row in group.rows:
                values = [[side.get(row.key) for side in pair] for pair in pairs]
                stream.write(json.dumps({"group": name, "row": row.label, "unit": row.unit, "pairs": values}) + "\n")


def _cells(row: Row, pairs: Sequence[Pair]) -> tuple[str, ...]:
    sides = [[pair[k][row.key] for pair in pairs if row.key in pair[k]] for k in (0, 1)]
    shown = [_quantity(median(side), row.unit) if side else "-" for side in sides]
    both = [(pair[0][row.key], pair[1][row.key]) for pair in pairs if row.key in pair[0] and row.key in pair[1]]
    label = escape(row.label)
    if not both:
        return label, *shown, "-", "-", "0"
    if row.by == DIFFERENCE:
        return label, *shown, *_differences([here - there for there, here in both]), str(len(both))
    ratios = spread_of([here / there if there else float("nan") for there, here in both])
    return label, *shown, f"{ratios.middle:.3g}x", f"{ratios.low:.3g} to {ratios.high:.3g}", str(len(both))


def _differences(values: Sequence[float]) -> tuple[str, str]:
    """Their mean, which is what scores are compared by, and its interval."""
    found = bootstrap_mean(np.array(values))
    return f"{found.mean:+.3f}", f"{found.low:+.3f} to {found.high:+.3f}"


def _quantity(value: float, unit: str) -> str:
    return quantity(value, unit) if unit == "s" else f"{value:,.0f} {unit}" if value >= 100 else f"{value:.3g} {unit}"


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.against", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("revision", metavar="REV", help="a commit, branch or tag")
    parser.add_argument("--only", nargs="+", choices=GROUPS, metavar="NAME", help=f"of {', '.join(GROUPS)}")
    parser.add_argument("--rounds", type=_count, metavar="N", help="how often each measures (by its own rule)")
    parser.add_argument("--silhouettes", type=Path, default=ROOT / "examples", metavar="DIR", help="default: examples/")
    parser.add_argument("--limit", type=_count, metavar="N", help="of the silhouettes, the first so many")
    parser.add_argument("--json", type=Path, metavar="FILE", help="append all pairs, as JSON Lines")
    return parser.parse_args(arguments)


def _count(given: str) -> int:
    if not given.isascii() or not given.isdigit() or int(given) < 1:
        raise argparse.ArgumentTypeError(f"{given[:40]!r}: expected a whole number of at least 1")
    return int(given)


if __name__ == "__main__":
    sys.exit(main())
