"""Replays construction sequences in real Blender: `python -m benchmarks.replay_in_blender FOLDER ...`.

Every `sequence.json` below the folders becomes a Blender script, all scripts run in one Blender process, and what
Blender has after each step is compared with our meshes: V, E and F, where each vertex lies (to 1e-5), and the corners
of each face. One table comes out, sequences that differ first. Exit codes: 0 nothing differs, 1 something does, 2 wrong
usage or no Blender, 130 Ctrl-C.
"""

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from autopoly_env.errors import AutoPolyError
from autopoly_env.export.blender import Job, find_blender, mismatches, run_in_blender, save_blender_script
from autopoly_env.sequence import ConstructionSequence

MOST_ROWS = 30  # of sequences without a difference; the others are all shown
SECONDS = 3600.0


@dataclass(frozen=True)
class Replay:
    """What came of one sequence."""

    path: Path
    n_steps: int
    counts: tuple[int, int, int]  # (V, E, F) of the last mesh
    problems: list[str]  # differences and failures, a line each


def main(arguments: Sequence[str] | None = None) -> int:
    """Replay everything below the folders asked for, print the table; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.replay_in_blender", description=__doc__)
    parser.add_argument("folders", type=Path, nargs="+", metavar="FOLDER", help="as agents.solve writes them")
    folders: list[Path] = parser.parse_args(arguments).folders
    paths = sorted({path for folder in folders for path in folder.rglob("sequence.json")})
    console = Console(width=None if sys.stdout.isatty() else 140)
    try:
        program = find_blender()
        if not paths:
            parser.error(f"no sequence.json below {', '.join(map(str, folders))}; give folders of results")
        with console.status(f"{len(paths)} sequences in {program}"):
            start = time.perf_counter()
            replays = replay(paths)
            seconds = time.perf_counter() - start
    except AutoPolyError as error:
        print("error:", error, file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("error: stopped by Ctrl-C", file=sys.stderr)
        return 130
    show(replays, f"{program}, {seconds:.1f} s", console)
    return int(any(found.problems for found in replays))


def replay(paths: Sequence[Path]) -> list[Replay]:
    """Run every sequence in Blender and compare. Raises ConfigError or OutputError where Blender cannot be run."""
    sequences: dict[Path, ConstructionSequence] = {}
    broken: dict[Path, str] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for number, path in enumerate(paths):
            try:
                sequences[path] = ConstructionSequence.load(path)
                save_blender_script(sequences[path], folder / f"{number}.py")
            except AutoPolyError as error:
                broken[path] = str(error)
        numbers = {path: number for number, path in enumerate(paths) if path not in broken}
        jobs = [Job(folder / f"{n}.py", ("--report", str(folder / f"{n}.json"))) for n in numbers.values()]
        problems = dict(zip(numbers, run_in_blender(jobs, seconds=SECONDS), strict=True))
        replays = [Replay(path, 0, (0, 0, 0), [problem]) for path, problem in broken.items()]
        for path, number in numbers.items():
            sequence, found = sequences[path], [problems[path]] if problems[path] else []
            if not found:
                report = json.loads((folder / f"{number}.json").read_text(encoding="utf-8"))
                found = mismatches(sequence, report)
            replays.append(Replay(path, len(sequence.steps), sequence.final().counts, found))
    return replays


def show(replays: Sequence[Replay], caption: str, console: Console) -> None:
    """Print the table and a line that sums it up."""
    differing = [found for found in replays if found.problems]
    same = [found for found in replays if not found.problems]
    table = Table("sequence", "steps", "V, E, F", "in Blender", caption=caption)
    for found in (*differing, *same[:MOST_ROWS]):
        counts = ", ".join(map(str, found.counts))
        verdict = "[red]" + escape("\n".join(found.problems)) if found.problems else "the same at every step"
        table.add_row(escape(str(found.path.parent)), str(found.n_steps), counts, verdict)
    if len(same) > MOST_ROWS:
        table.add_row(f"and {len(same) - MOST_ROWS} more", "", "", "the same at every step")
    console.print(table)
    n_steps = sum(found.n_steps for found in replays)
    console.print(f"sequences: {len(replays)}   steps: {n_steps}   sequences that differ: {len(differing)}")


if __name__ == "__main__":
    sys.exit(main())
