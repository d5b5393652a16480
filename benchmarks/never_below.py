"""Whether a style is ever worth less than one agent alone: `python -m benchmarks.never_below IMAGE ... [--style NAME]`.

Every picture is built as `agents.solve` does in that style, and by each agent of ALONE that takes the style's rule of
faces, operators and regularities, with the same settings and no limit. `--json FILE` keeps a line for each, and goes on
from there: a run that is stopped loses nothing.
"""

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

from agents.base import Agent
from agents.commands.styles import STYLES, Style, style_named
from agents.commands.wishes import read_wishes
from agents.contract import solved
from agents.registry import make_agent
from autopoly_env.errors import AutoPolyError
from autopoly_env.mesh import face_rule
from autopoly_env.score import ScoreWeights
from autopoly_env.silhouette import Silhouette, find_images, load_silhouette
from autopoly_env.simulator import Simulator

ALONE = ("trace", "decimate", "climb", "greedy")
LEEWAY = 0.05  # points of r_all by which the style may be worth less


@dataclass(frozen=True)
class Built:
    """What an agent has made of a picture."""

    picture: str
    style: str
    w_sc: float
    agent: str
    r_all: float
    n_refits: int
    seconds: float


def main(arguments: Sequence[str] | None = None) -> int:
    """Print where the style is worth less, and a table of all agents; 1 if it is anywhere by more than LEEWAY."""
    options = _options(arguments)
    console = Console() if sys.stdout.isatty() else Console(width=140)
    style = style_named(options.style)
    lines = _read(options.json)
    known = {
        (line.picture, line.agent): line for line in lines if (line.style, line.w_sc) == (options.style, options.w_sc)
    }
    found: list[Built] = []
    for path in find_images(options.images):
        try:
            silhouette = load_silhouette(path)
        except AutoPolyError as error:
            console.print(f"left out: {error}", markup=False, soft_wrap=True)
            continue
        for name, agent, simulator in _players(silhouette, style, options.w_sc):
            built = known.get((str(path), name))
            if built is None:
                solution = solved(agent, simulator)
                stats = solution.stats
                cost = stats.n_refits, stats.seconds
                built = Built(str(path), options.style, options.w_sc, name, solution.score.total, *cost)
                _keep(options.json, built)
            found.append(built)
    below = [pair for pair in compared(found, style.agent) if pair[1].r_all - pair[0].r_all > LEEWAY]
    _show(found, style.agent, below, console)
    return int(bool(below))


def compared(found: Sequence[Built], own: str) -> Iterator[tuple[Built, Built]]:
    """Of every picture what the style's own agent made, beside what each other made."""
    ours = {built.picture: built for built in found if built.agent == own}
    yield from ((ours[built.picture], built) for built in found if built.agent != own and built.picture in ours)


def _players(silhouette: Silhouette, style: Style, w_sc: float) -> Iterator[tuple[str, Agent, Simulator]]:
    """The style's own agent and those of ALONE that suit, each with a simulator of its own."""
    wishes = read_wishes(None, None, None, style.symmetry, align=style.align)
    for name in dict.fromkeys((style.agent, *ALONE)):
        simulator = Simulator(
            silhouette,
            operators=style.operators,
            weights=ScoreWeights(w_sc=w_sc),
            faces=face_rule(style.faces),
            **wishes.for_simulator(),
        )
        agent = make_agent(name)
        if agent.suits(simulator):
            yield name, agent, simulator


def _show(found: Sequence[Built], own: str, below: Sequence[tuple[Built, Built]], console: Console) -> None:
    for ours, other in below:
        console.print(f"{ours.picture}: {own} {ours.r_all:.2f}, {other.agent} {other.r_all:.2f}", soft_wrap=True)
    table = Table("agent", "pictures", "mean r_all", f"{own} is at most below by", "most refits", "most seconds")
    for name in dict.fromkeys(built.agent for built in found):
        here = [built for built in found if built.agent == name]
        gaps = [other.r_all - ours.r_all for ours, other in compared(found, own) if other.agent == name]
        mean = sum(built.r_all for built in here) / len(here)
        most = max(built.n_refits for built in here), max(built.seconds for built in here)
        table.add_row(
            name, str(len(here)), f"{mean:.3f}", f"{max(gaps):.3f}" if gaps else "-", str(most[0]), f"{most[1]:.1f}"
        )
    console.print(table)
    console.print(f"below by more than {LEEWAY}: {len({ours.picture for ours, _ in below})} pictures")


def _read(path: Path | None) -> list[Built]:
    if path is None or not path.exists():
        return []
    return [Built(**json.loads(line)) for line in path.read_text(encoding="utf-8").splitlines()]


def _keep(path: Path | None, built: Built) -> None:
    if path is not None:
        with path.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(asdict(built)) + "\n")


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.never_below", description=__doc__)
    parser.add_argument("images", nargs="+", metavar="IMAGE", help="files, folders or patterns")
    parser.add_argument("--style", default="modeller", help=f"one of {', '.join(STYLES)} (modeller)")
    parser.add_argument("--w-sc", type=float, default=0.3, help="price of an element (0.3)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="keep what was measured there, and go on from it")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
