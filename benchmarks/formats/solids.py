"""What slicers make of the solids of many meshes: nothing to repair, and the right volume."""

import tempfile
from pathlib import Path

from autopoly_env.sequence import ConstructionSequence
from benchmarks.formats.files import VARIANTS, expected, write
from benchmarks.formats.programs import READERS, Asking

SLICERS = ("admesh", "prusa")
TOLERANCE = 1e-4


def look_at_solids(folder: Path, asking: Asking) -> tuple[list[str], bool]:
    """A table for all sequences below a folder, and whether all is right: nothing repaired, volumes within 1e-4."""
    sequences = [ConstructionSequence.load(path) for path in sorted(folder.rglob("sequence.json"))]
    lines = ["| slicer | written with | solids | to be repaired | farthest from the volume |", "|---|---|---|---|---|"]
    is_right = bool(sequences)
    for name, title, ask, kinds in READERS:
        for kind in kinds if name in SLICERS else ():
            with tempfile.TemporaryDirectory() as place:
                ending = VARIANTS[kind].suffix
                paths = [write(one, kind, Path(place, f"{k}{ending}")) for k, one in enumerate(sequences)]
                answer = ask(name, asking, paths)
            if answer is None:
                continue
            volumes = [abs(one.get("volume", 0.0)) for one in answer[1]]
            gaps = [abs(v / expected(one, kind) - 1.0) for v, one in zip(volumes, sequences, strict=True) if v]
            n_repaired, worst = volumes.count(0.0), max(gaps, default=0.0)
            is_right &= not n_repaired and worst <= TOLERANCE
            options = VARIANTS[kind].options
            lines.append(f"| {title} {answer[0]} | `{options}` | {len(volumes)} | {n_repaired} | {worst:.1e} |")
    return lines, is_right
