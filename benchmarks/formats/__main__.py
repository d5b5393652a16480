"""Which program reads which of our files right: `python -m benchmarks.formats [--python PATH] [--node FOLDER]`.

Six examples are built, by `climb` or with `--style modeller` as agents.solve does, and written in every way that a
program reads. It is asked for the area, or for solids
the volume, and for glTF the box as well; what is within 1e-5 of the mesh's own is right. Prints the tables of
docs/formats.md. With `--solids FOLDER` slicers look at the solids of all sequences below it instead. Readers that are
not installed are left out. Exit codes: 0 all is right, or right with an option that the cell names; 1 something is not;
2 wrong usage; 130 Ctrl-C.
"""

import argparse
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from autopoly_env.sequence import ConstructionSequence
from benchmarks.formats.files import NAMES, VARIANTS, construct, expected, write
from benchmarks.formats.programs import READERS, Asking, Found, ask_node
from benchmarks.formats.solids import look_at_solids

TOLERANCE = 1e-5
BOXED = ("trimesh", "three", "model-viewer", "babylon", "open3d", "pyvista")  # that tell the box of a glTF scene
RIGHT, WRONG = "right", "**wrong**"

Files = dict[str, list[Path]]  # of each variant, one for each example


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the files, ask every reader, print the tables; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.formats", description=__doc__)
    parser.add_argument("--python", action="append", default=[], help="another interpreter that has readers")
    parser.add_argument("--node", type=Path, metavar="FOLDER", help="where node_modules has three, @babylonjs/...")
    names = [name for name, *_ in READERS]
    parser.add_argument("--only", nargs="+", choices=names, default=names, help="these readers", metavar="READER")
    parser.add_argument("--style", choices=("paper", "modeller"), default="paper", help="of the meshes (paper)")
    parser.add_argument("--solids", type=Path, metavar="FOLDER", help="as agents.solve writes them")
    given = parser.parse_args(arguments)
    asking = Asking((*given.python, sys.executable), given.node.resolve() if given.node else None)
    try:
        if given.solids is not None:
            lines, is_right = look_at_solids(given.solids, asking)
            print("\n".join(lines))
            return int(not is_right)
        sequences = [construct(name, given.style) for name in NAMES]
        with tempfile.TemporaryDirectory() as folder:
            files = {
                kind: [
                    write(sequence, kind, Path(folder, kind, f"{name}{variant.suffix}"))
                    for name, sequence in zip(NAMES, sequences, strict=True)
                ]
                for kind, variant in VARIANTS.items()
            }
            rows = _rows(asking, given.only, files, sequences)
            lines = [*rows, "", *_boxes(asking, given.only, files["gltf"], sequences)]
    except KeyboardInterrupt:
        print("error: stopped by Ctrl-C", file=sys.stderr)
        return 130
    print("\n".join(lines))
    return 1 if any(WRONG in line for line in lines) else 0


def _rows(asking: Asking, only: Sequence[str], files: Files, sequences: list[ConstructionSequence]) -> list[str]:
    """The table of areas and volumes, a row for each reader and variant."""
    lines = [f"| reader | written with | {' | '.join(NAMES)} |", f"|---|---|{'---|' * len(NAMES)}"]
    for name, title, ask, kinds in (reader for reader in READERS if reader[0] in only and reader[3]):
        asked = [*kinds, *(VARIANTS[kind].way_out for kind in kinds if VARIANTS[kind].way_out)]
        answer = ask(name, asking, [path for kind in asked for path in files[kind]])
        if answer is None:
            print(f"{title} is not installed", file=sys.stderr)
            continue
        version, found = answer
        right: list[str] = []  # variants, a row for all of them
        of = {kind: found[k * len(NAMES) : (k + 1) * len(NAMES)] for k, kind in enumerate(asked)}
        for kind in kinds:
            ratios = {at: _ratios(of[at], at, sequences) for at in (kind, VARIANTS[kind].way_out) if at}
            cells = [_cell(kind, {at: values[k] for at, values in ratios.items()}) for k in range(len(NAMES))]
            options = f"`{VARIANTS[kind].options}`"
            if set(cells) == {RIGHT}:
                right.append(options)
            else:
                lines.append(f"| {title} {version} | {options} | {' | '.join(cells)} |")
        if right:
            lines.append(f"| {title} {version} | {', '.join(right)} | {' | '.join([RIGHT] * len(NAMES))} |")
    return lines


def _ratios(found: list[Found], kind: str, sequences: list[ConstructionSequence]) -> list[float]:
    """What was found over what is there; nan for nothing."""
    measure = VARIANTS[kind].measure
    pairs = zip(found, sequences, strict=True)
    return [abs(float(one.get(measure, "nan"))) / expected(sequence, kind) for one, sequence in pairs]


def _cell(kind: str, ratios: dict[str, float]) -> str:
    """Right, or how many times too much, with what helps."""
    if _is_right(ratios[kind]):
        return RIGHT
    shown = "nothing" if np.isnan(ratios[kind]) or not ratios[kind] else f"×{ratios[kind]:.3g}"
    variant = VARIANTS[kind]
    helps = variant.way_out and _is_right(ratios[variant.way_out])
    return f"{shown}; `{variant.advice}`" if helps else f"{shown}, {WRONG}"


def _is_right(ratio: float) -> bool:
    return abs(ratio - 1.0) <= TOLERANCE


def _boxes(asking: Asking, only: Sequence[str], paths: list[Path], sequences: list[ConstructionSequence]) -> list[str]:
    """How far the box of the scene, as readers have it, is from the mesh's own at most; the validator's messages."""
    lines = ["| reader of glTF | farthest from the mesh's own box |", "|---|---|"]
    for name, title, ask, _ in READERS:
        answer = ask(name, asking, paths) if name in BOXED and name in only else None
        if answer is None:
            continue
        gaps = []
        for one, sequence in zip(answer[1], sequences, strict=True):
            places = sequence.final().vertices * (1, -1) + (0, 1)
            own = np.array((places.min(axis=0), places.max(axis=0)))
            gaps.append(float(np.abs(np.array(one.get("box", [[np.nan] * 3] * 2))[:, :2] - own).max()))
        lines.append(f"| {title} {answer[0]} | {max(gaps):.1e}{'' if max(gaps) <= TOLERANCE else ', ' + WRONG} |")
    validated = ask_node("validator", asking, paths)
    if validated is not None:
        messages = [message for one in validated[1] for message in one.get("messages", ["an error"])]
        lines.append(f"| Khronos validator {validated[0]} | {len(messages)} messages{WRONG if messages else ''} |")
    return lines


if __name__ == "__main__":
    sys.exit(main())
