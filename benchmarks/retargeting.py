"""What retargeting saves: `python -m benchmarks.retargeting [--keep DIR]`.

50 pairs of procedural objects, both of one family. The construction of the first, by `climb`, is retargeted to the
second with a fifth of the refits that a fresh `mcts` gets there. Scores are at the silhouette's own resolution.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from rich import box
from rich.console import Console
from rich.progress import track
from rich.table import Table

from agents.budget import Budget
from agents.registry import make_agent
from agents.retell.retargeting import retarget
from autopoly_env.arrays import FloatArray
from autopoly_env.errors import SequenceError
from autopoly_env.files import write_atomically
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator
from benchmarks.drawn import climbed, pair

REFITS = 1500  # of the fresh search
SHARE = 0.2  # of them for retargeting


@dataclass(frozen=True)
class Pair:
    """One retargeting beside a fresh search."""

    target: str
    n_steps: int
    n_kept: int
    n_added: int
    before: float  # r_all, as the others
    refitted: float
    after: float
    fresh: float
    n_refits: int
    n_fresh_refits: int


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", type=Path, help="folder in which solved constructions and fresh results are kept")
    parser.add_argument("--pairs", type=int, default=50)
    parser.add_argument("--json", type=Path, help="file for a record of each pair, as JSON Lines")
    options = parser.parse_args(arguments)
    pairs, failed = [], []
    for index in track(range(options.pairs), "pairs", console=Console(stderr=True), transient=True):
        try:
            pairs.append(measure(index, options.keep))
        except SequenceError as error:
            failed.append(f"{pair(index)[1].name}: {error}")
        if options.json:
            write_atomically(options.json, "".join(json.dumps(asdict(one)) + "\n" for one in pairs))
    show(pairs, failed)
    return 0


def measure(index: int, keep: Path | None) -> Pair:
    """Retarget a pair, and solve its second object afresh."""
    first, second = pair(index)
    sequence = climbed(first, keep)
    n_fresh_refits, fresh = _fresh(second, keep)
    done = retarget(Simulator(second), sequence, Budget(refits=round(SHARE * REFITS)))
    stats, score = done.solution.stats, done.solution.score
    return Pair(
        second.name,
        len(sequence.steps),
        done.n_kept,
        done.n_added,
        done.before.total,
        done.refitted.total,
        score.total,
        fresh,
        stats.n_refits,
        n_fresh_refits,
    )


def _fresh(silhouette: Silhouette, keep: Path | None) -> tuple[int, float]:
    """(refits, r_all) of the default `mcts`."""
    path = None if keep is None else keep / f"{silhouette.name}.fresh.json"
    if path is not None and path.is_file():
        n_refits, total = json.loads(path.read_text())
        return n_refits, total
    solution = make_agent("mcts").solve(Simulator(silhouette), Budget(refits=REFITS))
    if path is not None:
        write_atomically(path, json.dumps([solution.stats.n_refits, solution.score.total]))
    return solution.stats.n_refits, solution.score.total


def show(pairs: Sequence[Pair], failed: Sequence[str]) -> None:
    """Print the means, and the share of the fresh r_all with its bootstrap 95 % interval."""
    table = Table(box=box.SIMPLE_HEAD)
    for column in ("", "mean", "median", "least", "most"):
        table.add_column(column, justify="right" if column else "left")
    rows: dict[str, list[float]] = {
        "r_all of the mesh as it was": [one.before for one in pairs],
        "r_all of the same steps, refitted": [one.refitted for one in pairs],
        "r_all in the end": [one.after for one in pairs],
        "r_all of a fresh mcts": [one.fresh for one in pairs],
        "share of the fresh r_all": [one.after / one.fresh for one in pairs],
        "refits": [one.n_refits for one in pairs],
        "refits of a fresh mcts": [one.n_fresh_refits for one in pairs],
        "steps given": [one.n_steps for one in pairs],
        "share of steps kept": [one.n_kept / max(one.n_steps, 1) for one in pairs],
        "steps added": [one.n_added for one in pairs],
    }
    for name, values in rows.items():
        numbers = (np.mean(values), np.median(values), np.min(values), np.max(values))
        table.add_row(name, *(f"{number:.3f}" if name.startswith("share") else f"{number:.2f}" for number in numbers))
    console = Console(width=120)
    console.print(table)
    low, high = _bootstrap(np.array([one.after for one in pairs]), np.array([one.fresh for one in pairs]))
    ratio = np.sum([one.after for one in pairs]) / np.sum([one.fresh for one in pairs])
    console.print(
        f"{len(pairs)} pairs: {100 * ratio:.1f} % of the fresh r_all, 95 %: {100 * low:.1f} to {100 * high:.1f}"
    )
    for line in failed:
        console.print(f"failed: {line}")


def _bootstrap(after: FloatArray, fresh: FloatArray, n: int = 10_000) -> tuple[float, float]:
    """95 % interval of the ratio of the means: percentiles over resamples of the pairs."""
    chosen = np.random.default_rng(0).integers(0, len(after), (n, len(after)))
    low, high = np.percentile(after[chosen].mean(axis=1) / fresh[chosen].mean(axis=1), (2.5, 97.5))
    return float(low), float(high)


if __name__ == "__main__":
    sys.exit(main())
