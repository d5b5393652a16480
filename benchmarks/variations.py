"""How many variants are valid, and how many draws they take: `python -m benchmarks.variations [--keep DIR]`.

Over the pictures in examples/ and 60 procedural objects, each solved by `climb`, and the pictures again in the style of
a modeller, without and with level and plumb edges kept so: 8 variants of every construction. A variant is checked anew
from its JSON, by shapely and by shoelace areas, which is not how it was drawn.
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

from agents.retell.frame import EXACT
from agents.retell.variants import N_TRIES, draw_variants
from autopoly_env.arrays import BoolArray
from autopoly_env.mesh import PolyMesh
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import load_silhouette
from benchmarks.drawn import climbed, modelled, pair

N_VARIANTS = 8
EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


@dataclass(frozen=True)
class Varied:
    """The variants of one construction."""

    n_valid: int
    n_invalid: int  # produced, and found to have a defect after all
    n_given_up: int
    n_tries: tuple[int, ...]  # of each that was produced
    n_level: int = 0  # edges of the last meshes that were level or plumb
    n_tilted: int = 0  # of them, those that are not any more
    n_to_mirror: int = 0  # variants of symmetric constructions
    n_mirrored: int = 0  # of them, those that are symmetric


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
    sequences = [modelled(silhouette, options.keep) for silhouette in examples]
    kept = [
        f"{label}: {_regular([vary(sequence, amount, keep_level=keep_level) for sequence in sequences])}"
        for amount in options.amounts
        for label, keep_level in ((f"{amount:g}", False), (f"{amount:g} --keep-level", True))
    ]
    console.print(table)
    console.print("\n".join(kept))
    console.print(f"A variant is given up after {N_TRIES} tries.")
    return 0


def vary(sequence: ConstructionSequence, amount: float, *, keep_level: bool = False) -> Varied:
    """Draw the variants of one construction and check them."""
    variants = list(draw_variants(sequence, N_VARIANTS, amount, 0, keep_level=keep_level))
    found = [variant for variant in variants if variant is not None]
    told = [ConstructionSequence.from_json(variant.sequence.to_json()) for variant in found]
    n_valid = sum(map(is_valid, told))
    tries = tuple(variant.n_tries for variant in found)
    was_level = _is_level(sequence.final())
    n_tilted = sum(int((was_level & ~_is_level(one.final())).sum()) for one in told)
    n_to_mirror = len(told) if _is_mirrored(sequence.final()) else 0
    n_mirrored = sum(_is_mirrored(one.final()) for one in told) if n_to_mirror else 0
    n_given_up = len(variants) - len(found)
    n_level = int(was_level.sum()) * len(told)
    return Varied(n_valid, len(found) - n_valid, n_given_up, tries, n_level, n_tilted, n_to_mirror, n_mirrored)


def _is_level(mesh: PolyMesh) -> BoolArray:
    """(E,) the edges that are level or plumb."""
    ways = np.abs(mesh.vertices[mesh.edges[:, 0]] - mesh.vertices[mesh.edges[:, 1]])
    return ways.min(axis=1) <= EXACT


def _is_mirrored(mesh: PolyMesh) -> bool:
    """Whether the shape is its own mirror image, but for slivers."""
    shape = shapely.union_all([shapely.Polygon(mesh.vertices[list(face)]) for face in mesh.faces])
    low, _, high, _ = shape.bounds
    image = shapely.transform(shape, lambda points: points * (-1.0, 1.0) + (low + high, 0.0))
    return bool(shape.symmetric_difference(image).area <= 1e-6)


def _regular(varied: Sequence[Varied]) -> str:
    n_valid, n_asked = sum(one.n_valid for one in varied), N_VARIANTS * len(varied)
    n_level, n_tilted, n_to_mirror, n_mirrored = (
        sum(getattr(one, name) for one in varied) for name in ("n_level", "n_tilted", "n_to_mirror", "n_mirrored")
    )
    return (
        f"modeller's style, {n_valid} of {n_asked} valid; {n_level - n_tilted} of {n_level} level and plumb edges so; "
        f"{n_mirrored} of {n_to_mirror} variants of symmetric shapes symmetric"
    )


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
