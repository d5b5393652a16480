"""What Blender's modifiers make of our meshes: `python -m benchmarks.modifiers_in_blender FOLDER ...`.

The last mesh of every `sequence.json` below the folders gets Subdivision Surface (level 1), Solidify, Bevel after
Solidify and, where it is symmetric, its half gets Mirror; what comes out is compared with the mesh: area, volume, faces
turned over, edges that have not two faces. One table comes out, and the meshes of which Catmull-Clark turns faces over.
Exit codes: 0 all is as it should be to 1e-5, 1 something is not, Catmull-Clark's faces aside, 2 wrong usage or no
Blender, 130 Ctrl-C.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from autopoly_env.errors import AutoPolyError, OutputError
from autopoly_env.export.blender import ask_blender
from autopoly_env.export.half import halved
from autopoly_env.mesh import PolyMesh
from autopoly_env.sequence import ConstructionSequence

DRIVER = Path(__file__).with_name("modifiers_driver.py")
THICKNESS = 0.05  # as in the driver
TOLERANCE = 1e-5
SECONDS = 600.0
# Key of the driver's answer, what it is, and what is to be that of the mesh: its area, times the thickness for volumes.
ROWS = (
    ("simple", "Subdivision Surface, Simple", "area"),
    ("smooth", "Subdivision Surface, Catmull-Clark", ""),
    ("solid", "Solidify", "volume"),
    ("bevelled", "Solidify, then Bevel", ""),
    ("mirrored", "Mirror, of the half", "area"),
)
FLAT = ("simple", "smooth", "mirrored")
MAY_TURN = "smooth"

Answer = dict[str, dict[str, float]]


def main(arguments: Sequence[str] | None = None) -> int:
    """Ask Blender, print the table; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.modifiers_in_blender", description=__doc__)
    parser.add_argument("folders", type=Path, nargs="+", metavar="FOLDER", help="as agents.solve writes them")
    folders: list[Path] = parser.parse_args(arguments).folders
    paths = sorted({path for folder in folders for path in folder.rglob("sequence.json")})
    if not paths:
        parser.error(f"no sequence.json below {', '.join(map(str, folders))}; give folders of results")
    try:
        meshes = [ConstructionSequence.load(path).final() for path in paths]
        answers: list[Answer] = ask_blender(DRIVER, list(map(_asked, meshes)), what="folders", seconds=SECONDS)
    except AutoPolyError as error:
        print("error:", error, file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("error: stopped by Ctrl-C", file=sys.stderr)
        return 130
    lines, is_right = table(meshes, answers)
    turned = [
        f"{path.parent.name} {answer[MAY_TURN]['turned']:.0f}"
        for path, answer in zip(paths, answers, strict=True)
        if answer[MAY_TURN]["turned"]
    ]
    print("\n".join(lines))
    print(f"\nfaces that Catmull-Clark turns over: {', '.join(turned) or 'none'}")
    return int(not is_right)


def table(meshes: Sequence[PolyMesh], answers: Sequence[Answer]) -> tuple[list[str], bool]:
    """A row for each modifier, and whether all is as it should be: closed, not turned over, areas and volumes right."""
    lines = ["| modifier | meshes | farthest off | with faces turned over | with open edges |", "|---|---|---|---|---|"]
    is_right = True
    for key, title, measure in ROWS:
        found = [(mesh, answer[key]) for mesh, answer in zip(meshes, answers, strict=True) if key in answer]
        off = max((_off(mesh, one, measure) for mesh, one in found), default=0.0) if measure else 0.0
        n_turned = sum(one["turned"] > 0 for _, one in found) if key in FLAT else 0
        n_open = sum(one["open"] > 0 for _, one in found) if key not in FLAT else 0
        is_right &= off <= TOLERANCE and not n_open and (not n_turned or key == MAY_TURN)
        cells = (
            f"{measure} {off:.1e}" if measure else "",
            str(n_turned) if key in FLAT else "",
            "" if key in FLAT else str(n_open),
        )
        lines.append(f"| {title} | {len(found)} | {' | '.join(cells)} |")
    return lines, is_right


def _off(mesh: PolyMesh, found: dict[str, float], measure: str) -> float:
    expected = float(mesh.face_areas().sum()) * (THICKNESS if measure == "volume" else 1.0)
    return abs(found[measure] / expected - 1.0)


def _asked(mesh: PolyMesh) -> dict[str, Any]:
    """The mesh, and its half if there is one, as Blender takes them: y up, the axis at x = 0."""
    try:
        return {"whole": _shape(mesh), "half": _shape(*halved(mesh))}
    except OutputError:
        return {"whole": _shape(mesh)}


def _shape(mesh: PolyMesh, axis: float = 0.0) -> tuple[list[list[float]], list[list[int]]]:
    return [[x - axis, 1.0 - y, 0.0] for x, y in mesh.vertices.tolist()], [[*reversed(f)] for f in mesh.faces]


if __name__ == "__main__":
    sys.exit(main())
