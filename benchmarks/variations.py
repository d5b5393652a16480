"""How many variants are valid, and how many draws they take: `python -m benchmarks.variations [--keep DIR]`.

Over the pictures in examples/ and 60 procedural objects, each solved by `climb`: 8 variants of every construction. A
variant is checked anew from its JSON, by shapely and by shoelace areas, which is not how it was drawn.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from rich import box
from rich.console import Console
from rich.progress import track
from rich.table import Table

from agents.retell.variants import N_TRIES, draw_variants
from autopoly_env.mesh import PolyMesh
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import load_silhouette
from benchmarks.drawn import climbed, pair

N_VARIANTS = 8
EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


@dataclass(frozen=True)
class Varied:
    """The variants of one construction."""

    n_valid: int
    n_invalid: int  # produced, and found to have a defect after all
    n_given_up: int
    n_tries: tuple[int, ...]  # of each that was produced


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", type=Path, help="folder in which solved constructions are kept")
    parser.add_argument("--objects", type=int, default=60)
    parser.add_argument("--amounts", type=float, nargs="+", default=[0.06, 0.12, 0.2])
    options = parser.parse_args(arguments)
    console = Console(width=120)
    examples = [load_silhouette(path) for path in sorted(EXAMPLES.glob("*.png"))]
    groups = {"examples": examples, "objects": [pair(i)[0] for i in range(options.objects)]}
    table = Table(box=box.SIMPLE_HEAD)
    for column in ("constructions", "amount", "asked for", "valid", "share", "given up", "mean tries", "most tries"):
        table.add_column(column, justify="left" if column == "constructions" else "right")
    for name, silhouettes in groups.items():
        bar = track(silhouettes, name, console=Console(stderr=True), transient=True)
        sequences = [climbed(silhouette, options.keep) for silhouette in bar]
        for amount in options.amounts:
            varied = [vary(sequence, amount) for sequence in sequences]
            table.add_row(name, f"{amount:g}", *_cells(varied))
    console.print(table)
    console.print(f"A variant is given up after {N_TRIES} tries.")
    return 0


def vary(sequence: ConstructionSequence, amount: float) -> Varied:
    """Draw the variants of one construction and check them."""
    variants = list(draw_variants(sequence, N_VARIANTS, amount, 0))
    found = [variant for variant in variants if variant is not None]
    n_valid = sum(is_valid(ConstructionSequence.from_json(variant.sequence.to_json())) for variant in found)
    tries = tuple(variant.n_tries for variant in found)
    return Varied(n_valid, len(found) - n_valid, len(variants) - len(found), tries)


def is_valid(sequence: ConstructionSequence) -> bool:
    """Whether no mesh on the way has edges that cross or a face that is flipped."""
    return all((mesh.face_areas() > 0.0).all() and not _has_crossing(mesh) for mesh in sequence.meshes())


def _has_crossing(mesh: PolyMesh) -> bool:
    edges = shapely.linestrings(mesh.vertices[mesh.edges])
    first, second = shapely.STRtree(edges).query(edges, predicate="crosses")
    return bool((first < second).any())


def _cells(varied: Sequence[Varied]) -> list[str]:
    n_asked = N_VARIANTS * len(varied)
    n_valid = sum(one.n_valid for one in varied)
    tries = np.array([n for one in varied for n in one.n_tries])
    n_given_up = sum(one.n_given_up for one in varied)
    return [
        str(n_asked),
        str(n_valid),
        f"{100.0 * n_valid / n_asked:.1f} %",
        str(n_given_up),
        f"{tries.mean():.2f}",
        str(tries.max()),
    ]


if __name__ == "__main__":
    sys.exit(main())
