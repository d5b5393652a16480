"""The meshes that are written, in which files, and what a reader should find in them."""

from dataclasses import dataclass
from pathlib import Path

from agents.registry import make_agent
from autopoly_env.export.formats import Export, find_format
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import load_silhouette
from autopoly_env.simulator import Simulator

EXAMPLES = Path(__file__).parents[2] / "examples"
NAMES = ("bicycle", "chair", "key", "mug", "padlock", "umbrella")
DEPTH, SIZE, DRAWN = 0.05, 80.0, 512.0  # units; millimetres and user units a side


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
    "svg": Variant("--to svg", "svg", ".svg", side=DRAWN),
    "svg-layers": Variant(
        "--to svg --layers", "svg", ".svg", side=DRAWN, is_all=True, way_out="svg", advice="no --layers"
    ),
    "usd": Variant("--to usd --depth", "usd", ".usdc", DEPTH),
    "dxf": Variant("--to dxf", "dxf", ".dxf", side=SIZE),
    "godot": Variant("--to godot", "godot", ".tscn", side=DRAWN),
    "tiled": Variant("--to convex-json", "convex-json", ".convex.json", side=DRAWN),
}


def construct(name: str) -> ConstructionSequence:
    """How `climb` builds one of the examples."""
    return make_agent("climb").solve(Simulator(load_silhouette(EXAMPLES / f"{name}.png"))).sequence


def write(sequence: ConstructionSequence, kind: str, path: Path) -> Path:
    """Write a sequence as the variant says."""
    variant = VARIANTS[kind]
    size = SIZE if variant.side == SIZE else None
    export = Export(sequence, None, variant.depth, size, triangles=variant.is_all, layers=variant.is_all)
    find_format(variant.format).write(export, path)
    return path


def expected(sequence: ConstructionSequence, kind: str) -> float:
    """The area or volume that a reader should find, in the file's units."""
    variant = VARIANTS[kind]
    area = float(sequence.final().face_areas().sum()) * variant.side**2
    return area * variant.depth * variant.side if variant.depth else area
