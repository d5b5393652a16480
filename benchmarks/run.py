"""Measure everything and print one table: `python -m benchmarks.run [--silhouettes DIR] [--only GROUP ...]`."""

import argparse
import os
import platform
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TextIO

from rich.console import Console
from rich.status import Status

from autopoly_env.errors import SilhouetteError
from autopoly_env.silhouette import find_images
from benchmarks import report
from benchmarks.report import Record, Row

_FILE_WIDTH = 140  # columns, where the output is no terminal
_EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
# group: (title, module, function, whether it takes the silhouettes); modules are imported when their turn comes, so
# that what one of them lacks is not missed by the others
GROUPS = {
    "render": ("loss and gradient of a polygon", "benchmarks.rendering", "render_rows", False),
    "growth": ("growth when the resolution doubles (times at both)", "benchmarks.rendering", "growth_rows", False),
    "gradient": ("gradient against central differences", "benchmarks.rendering", "gradient_rows", False),
    "refit": ("16-gon from a circle to the horse at 64", "benchmarks.refitting", "refit_rows", False),
    "rule": ("refits under a rule of faces, at 128", "benchmarks.ruling", "rule_rows", True),
    "threads": ("simulator", "benchmarks.simulation", "thread_rows", True),
    "environment": ("environment, random legal actions at 64", "benchmarks.environment", "environment_rows", False),
    "import": ("import", "benchmarks.importing", "import_rows", False),
    "agents": ("agents", "benchmarks.agents", "agent_rows", True),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the groups asked for; 0 unless one of them broke down. A bound that is missed is a finding, not a failure."""
    options = _options(arguments)
    try:
        images = find_images([options.silhouettes])
    except SilhouetteError as problem:
        print(problem, file=sys.stderr)
        return 2
    console = Console()
    if not console.is_terminal:
        console = Console(width=_FILE_WIDTH)
    shown, broken = [], False
    with ExitStack() as stack:
        stream = stack.enter_context(options.json.open("w", encoding="utf-8")) if options.json else None
        status = stack.enter_context(console.status("starting"))
        for group in options.only or GROUPS:
            rows, failed = _measure(group, images, status, stream)
            shown.append((GROUPS[group][0], rows))
            broken |= failed
    report.show(shown, _machine(options.silhouettes), console)
    return int(broken)


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.run", description=__doc__)
    parser.add_argument("--silhouettes", type=Path, default=_EXAMPLES, metavar="DIR", help="default: examples/")
    parser.add_argument("--only", nargs="+", choices=GROUPS, metavar="GROUP", help=f"of {', '.join(GROUPS)}")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write JSON Lines, as results come")
    return parser.parse_args(arguments)


def _measure(group: str, images: list[Path], status: Status, stream: TextIO | None) -> tuple[list[Row], bool]:
    """All rows of a group, and whether it broke down: one row then says why, and the other groups go on."""
    rows: list[Row] = []
    broken = False

    def take(item: Row | Record) -> None:
        status.update(f"{group}: {item.name if isinstance(item, Row) else item.label}")
        if stream is not None:
            report.write_json(stream, group, item)
        if isinstance(item, Row):
            rows.append(item)

    status.update(group)
    try:
        for item in _items(group, images):
            take(item)
    except ImportError as missing:
        take(report.not_measured(group, str(missing)))
    except Exception as problem:
        take(report.not_measured(group, f"{type(problem).__name__}: {problem}"))
        broken = True
    return rows, broken


def _items(group: str, images: list[Path]) -> Iterator[Row | Record]:
    _, module, function, takes_images = GROUPS[group]
    make: Callable[..., Iterator[Row | Record]] = getattr(import_module(module), function)
    yield from make(images) if takes_images else make()


def _machine(silhouettes: Path) -> str:
    """What the figures were measured with, for the caption."""
    packages = " ".join(f"{name} {_version(name)}" for name in ("numba", "deodr", "mitsuba", "torch"))
    cores = f"{os.cpu_count()} cores" + (f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "")
    return f"{platform.machine()}, {cores}; Python {platform.python_version()}, {packages}; silhouettes: {silhouettes}"


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "missing"


if __name__ == "__main__":
    sys.exit(main())
