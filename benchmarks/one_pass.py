"""What one pass of the policy finds, beside the search: `python -m benchmarks.one_pass`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from agents.commands.running import run_command
from autopoly_env.mesh import face_rule
from autopoly_env.silhouette import find_images
from benchmarks.foretold import TREE_ALONE
from benchmarks.search_cases import Case, Found, Records, Results, made, with_options
from training.report import Interval, bootstrap_mean

POLICY, TREE, CHOICE, BEAM, RECTANGLE = "policy", "plain tree", "choice-prior", "beam", "rectangle, refitted"
OTHER = "other policy"
_WIDTH = 120

HELP = """Measure one pass of the policy: against the tree at its own refits, ChoiceNet's one pass, and a beam.

\b
Examples:
  python -m benchmarks.one_pass my/silhouettes
  python -m benchmarks.one_pass --faces any --weights runs/maskable_ppo/policy.safetensors
  python -m benchmarks.one_pass my/silhouettes --beam 8 --beam-refits 4000

Under a rule of faces the operators are the modeller's, else those of the preset full. The share is of what the beam
gains on the rectangle, of means over the shapes that it has solved.
"""

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode="rich")


@app.command(help=HELP)
def main_command(
    folder: Annotated[
        Path | None, typer.Argument(metavar="FOLDER", help="Silhouettes, instead of what is made.")
    ] = None,
    made_each: Annotated[int, typer.Option(min=1, help="Constructions, and as many objects.")] = 24,
    w_sc: Annotated[float, typer.Option(min=0.0, help="Price of an element.")] = 0.3,
    faces: Annotated[str, typer.Option(help="Rule of faces: quads (the modeller's style) or any.")] = "quads",
    weights: Annotated[str, typer.Option(help="Of the policy.", show_default="the project's own")] = "",
    other: Annotated[str, typer.Option(help="Weights of a policy to compare it with.", show_default="none")] = "",
    beam: Annotated[int, typer.Option(min=0, help="Width of the beam; 0: none.")] = 0,
    beam_refits: Annotated[int, typer.Option(min=1, help="Refits of the beam at most.")] = 4000,
    beam_limit: Annotated[int, typer.Option(min=1, help="Shapes of each set for the beam.")] = 8,
    limit: Annotated[int | None, typer.Option(min=1, help="Only the first so many silhouettes.")] = None,
    records: Annotated[Path, typer.Option(metavar="FILE", help="Where results are kept.")] = Path("out/one_pass.jsonl"),
) -> int:
    face_rule(faces)
    sets = {"constructions": made("construction", made_each), "objects": made("objects", made_each)}
    if folder is not None:
        sets = {folder.name: [str(image) for image in find_images([folder])[:limit]]}
    kept = Records(records)
    table = Table("targets", "who", "n", "r_all", "IoU", "V+E+F", "refits", "seconds", "policy − it", "policy's share")
    for name, targets in sets.items():
        cases = _cases(targets, w_sc, faces, weights, other)
        results = kept.complete([case for some in cases.values() for case in some], 1)
        cases[TREE] = _as_many(cases[POLICY], results)
        if beam:
            case = Case("", "beam", w_sc, refits=beam_refits, faces=faces)
            cases[f"{BEAM} {beam}, at most {beam_refits} refits"] = [
                with_options(_at(case, target), width=beam) for target in targets[:beam_limit]
            ]
        results = kept.complete([case for some in cases.values() for case in some], 1)
        for row in _rows(name, cases, results):
            table.add_row(*row)
    Console(width=_WIDTH).print(table)
    return 0


def _at(case: Case, target: str) -> Case:
    return Case(**{**vars(case), "target": target})


def _cases(targets: Sequence[str], w_sc: float, faces: str, weights: str, other: str = "") -> dict[str, list[Case]]:
    def of(agent: str, refits: int | None = None, **options: object) -> list[Case]:
        return [with_options(Case(t, agent, w_sc, refits=refits, faces=faces), **options) for t in targets]

    others = {OTHER: of("maskable-ppo", weights=other)} if other else {}
    return {
        RECTANGLE: of("mcts", 1, **TREE_ALONE),
        POLICY: of("maskable-ppo", weights=weights),
        **others,
        CHOICE + ", one pass": of("choice-prior", **TREE_ALONE, n_simulations=1),
    }


def _as_many(cases: Sequence[Case], results: Results) -> list[Case]:
    """The tree alone, with as many refits as each of the cases took."""
    return [
        with_options(
            Case(case.target, "mcts", case.w_sc, refits=results[case].n_refits, faces=case.faces), **TREE_ALONE
        )
        for case in cases
        if case in results
    ]


def _rows(name: str, cases: dict[str, list[Case]], results: Results) -> list[list[str]]:
    found = {who: {case.target: results[case] for case in some if case in results} for who, some in cases.items()}
    return [_row(name, who, found) for who in found]


def _row(name: str, who: str, found: dict[str, dict[str, Found]]) -> list[str]:
    mine, ours = found[who], found[POLICY]
    both = [target for target in mine if target in ours]
    leads = np.array([ours[target].total - mine[target].total for target in both])
    share = ""
    if who.startswith(BEAM):
        start, end, policy = (
            np.mean([some[target].total for target in both]) for some in (found[RECTANGLE], mine, ours)
        )
        share = f"{(policy - start) / (end - start):.0%}"
    means = [float(np.mean([getattr(one, key) for one in mine.values()])) for key in _KEYS]
    total = _shown(bootstrap_mean(np.array([one.total for one in mine.values()])), ".1f")
    lead = "" if who == POLICY else _shown(bootstrap_mean(leads), "+.2f")
    numbers = [f"{mean:{style}}" for mean, style in zip(means, (".3f", ".1f", ".0f", ".2f"), strict=True)]
    return [name, who, str(len(mine)), total, *numbers, lead, share]


_KEYS = ("iou", "complexity", "n_refits", "wall_seconds")


def _shown(interval: Interval, style: str) -> str:
    return f"{interval.mean:{style}} ({interval.low:{style}} to {interval.high:{style}})"


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns the exit code."""
    return run_command(app, arguments, "python -m benchmarks.one_pass")


if __name__ == "__main__":
    raise SystemExit(main())
