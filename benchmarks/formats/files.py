"""The meshes that are written, in which files, and what a reader should find in them."""

from dataclasses import dataclass
from pathlib import Path

from agents.commands.styles import style_named
from agents.registry import make_agent
from autopoly_env.export.formats import Export, find_format
from autopoly_env.mesh import face_rule
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import load_silhouette
from autopoly_env.simulator import Simulator

EXAMPLES = Path(__file__).parents[2] / "examples"
NAMES = ("bicycle", "chair", "key", "mug", "padlock", "umbrella")
DEPTH, SIZE, DRAWN = 0.05, 80.0, 512.0  # units; millimetres of solids, user units of drawings


@dataclass(frozen=True)
class Variant:
    """A way of writing a mesh: the options of agents.export, and the way out where a reader gets it wrong."""

    options: str
    format: str
    suffix: str
    depth: float = 0.0
    side: float = 1.0  # of the unit square, in the file's units
    is_all: bool = False  # --triangles or --layers
    way_out: str = ""  # the variant that helps
    advice: str = ""  # what to do for it

    @property
    def measure(self) -> str:
        """What is compared."""
        return "volume" if self.depth else "area"


VARIANTS = {
    "obj": Variant("--to obj", "obj", ".obj", way_out="obj-triangles", advice="--triangles"),
    "obj-triangles": Variant("--to obj --triangles", "obj", ".obj", is_all=True),
    "solid": Variant("--to obj --depth", "obj", ".obj", DEPTH, way_out="solid-triangles", advice="--triangles"),
    "solid-triangles": Variant("--to obj --depth --triangles", "obj", ".obj", DEPTH, is_all=True),
    "gltf": Variant("--to gltf", "gltf", ".glb"),
    "stl": Variant("--to stl --depth", "stl", ".stl", DEPTH, SIZE),
    "3mf": Variant("--to 3mf --depth", "3mf", ".3mf", DEPTH, SIZE),
    "svg": Variant("--to svg", "svg", ".svg", side=DRAWN, way_out="dxf", advice="--to dxf"),
    "svg-layers": Variant(
        "--to svg --layers", "svg", ".svg", side=DRAWN, is_all=True, way_out="svg", advice="no --layers"
    ),
    "usd": Variant("--to usd --depth", "usd", ".usdc", DEPTH),
    "dxf": Variant("--to dxf", "dxf", ".dxf", side=DRAWN),
    "godot": Variant("--to godot", "godot", ".tscn", side=DRAWN),
    "tiled": Variant("--to convex-json", "convex-json", ".convex.json", side=DRAWN),
}


def construct(name: str, style: str) -> ConstructionSequence:
    """How one of the examples is built in the modeller's style or, by `climb`, with few faces of many corners."""
    silhouette = load_silhouette(EXAMPLES / f"{name}.png")
    if style == "paper":
        return make_agent("climb").solve(Simulator(silhouette)).sequence
    chosen = style_named(style)
    faces = face_rule(chosen.faces)
    game = Simulator(silhouette, operators=chosen.operators, faces=faces, symmetry=chosen.symmetry, align=chosen.align)
    return make_agent(chosen.agent).solve(game).sequence


def write(sequence: ConstructionSequence, kind: str, path: Path) -> Path:
    """Write a sequence as the variant says."""
    variant = VARIANTS[kind]
    export = Export(sequence, None, variant.depth, variant.side, triangles=variant.is_all, layers=variant.is_all)
    find_format(variant.format).write(export, path)
    return path


def expected(sequence: ConstructionSequence, kind: str) -> float:
    """The area or volume that a reader should find, in the file's units."""
    variant = VARIANTS[kind]
    area = float(sequence.final().face_areas().sum()) * variant.side**2
    return area * variant.depth * variant.side if variant.depth else area
