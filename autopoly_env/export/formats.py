"""The formats that a construction sequence can be written in: each registers itself at the end of its own file.

Here is only where to find them, so that nobody has to load all writers for one.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from autopoly_env import outside
from autopoly_env.errors import ConfigError

if TYPE_CHECKING:
    from autopoly_env.export.texture import Texture
    from autopoly_env.sequence import ConstructionSequence
    from autopoly_env.silhouette import Silhouette


@dataclass(frozen=True)
class Export:
    """What is to be written: a sequence that replays, and what goes with it."""

    sequence: "ConstructionSequence"
    target: "Silhouette | None" = None
    depth: float = 0.0  # thickness of the mesh, in units of the unit square
    size: float | None = None  # side of the unit square, in millimetres or pixels; None: the format's own
    triangles: bool = False  # no other faces
    layers: bool = False  # all steps, each in a layer, where otherwise the last mesh is shown
    texture: "Texture | None" = None  # the picture on the mesh
    half: bool = False  # of the mesh what lies to the right of its axis, for a mirror to make whole


@dataclass(frozen=True)
class Format:
    """A format: its name, the endings of its files, how one is written, and which parts of an `Export` it shows.

    `write` makes the file, whole or not at all, and raises OutputError where it cannot. Raises ConfigError for endings
    that are none.
    """

    name: str
    suffixes: tuple[str, ...]  # such as .obj or .mesh.png; files get the first, unless they have another
    help: str  # a line
    write: Callable[[Export, Path], object]
    shows_target: bool = False
    shows_depth: bool = False
    options: tuple[str, ...] = ()  # further fields of an `Export` that it heeds, such as "size"

    def __post_init__(self) -> None:
        if not self.suffixes or not all(s.startswith(".") and s == s.lower() for s in self.suffixes):
            raise ConfigError(f"format {self.name!r} with the endings {self.suffixes}: expected some, such as .obj")

    @property
    def heeded(self) -> set[str]:
        """The fields of an `Export` that it heeds, beside the sequence."""
        shown = {"target": self.shows_target, "depth": self.shows_depth}
        return {name for name, is_shown in shown.items() if is_shown} | set(self.options)

    @property
    def suffix(self) -> str:
        """What its files end in."""
        return self.suffixes[0]


MOST_SIZE = 1e6

# Name, module, and the line of help that is also in there: `--help` has no time to load them.
LISTED = (
    ("html", "player", "the player: a page to watch, with what to press in Blender"),
    ("svg", "svg", "a drawing of the last mesh to edit; all steps with --layers"),
    ("obj", "obj", "the last mesh, with its n-gons; a solid with --depth"),
    ("gltf", "gltf", "an animation for viewers and engines; binary in a file .glb"),
    ("gif", "gif", "an animated picture"),
    ("png", "sheet", "every step on one sheet"),
    ("blender", "blender", "a Python script that builds the mesh with Blender's own operators"),
    ("stl", "stl", "triangles in millimetres for slicers; --depth makes it solid"),
    ("3mf", "threemf", "the same with units in it, for printers' programs"),
    ("usd", "usd", "the last mesh in quads and triangles (extra usd)"),
    ("dxf", "dxf", "the outlines in millimetres, for cutters (extra dxf)"),
    ("godot", "godot", "a scene of Godot 4: Polygon2D and convex collision shapes"),
    ("convex-json", "convex", "convex pieces for physics engines, as a map of Tiled"),
    ("coach", "coach", "what the coach in Blender teaches from, the picture with it"),
    ("mesh-png", "cutout", "the last mesh on a transparent background"),
    ("mask-png", "cutout", "what the last mesh covers, white on black"),
)
_MODULES = {name: module for name, module, _ in LISTED}
_registered: dict[str, Format] = {}


def check_size(size: float) -> float:
    """The side of the unit square in a file. Raises ConfigError for one that is not above 0, or beyond a million."""
    if not 0.0 < size <= MOST_SIZE:
        raise ConfigError(f"size {size}: expected the side of the picture, above 0 and at most {MOST_SIZE:.0f}")
    return float(size)


def register_format(made: Format) -> None:
    """Make a format known by its name and its endings. Raises ConfigError for those that are taken."""
    taken = {suffix: other.name for other in _registered.values() for suffix in other.suffixes}
    others = [taken[suffix] for suffix in made.suffixes if suffix in taken]
    if made.name in _registered or others:
        raise ConfigError(f"format {made.name!r}: the name or an ending is taken by {(*others, made.name)[0]!r}")
    _registered[made.name] = made


def formats() -> dict[str, Format]:
    """All formats by name, those of this package first."""
    return {name: find_format(name) for name in (*_MODULES, *_registered)}


def find_format(name: str) -> Format:
    """The format of that name, or that my.module:FORMAT names. Raises ConfigError where there is none."""
    if name in _MODULES:
        import_module(f"{__package__}.{_MODULES[name]}")
    if name in _registered:
        return _registered[name]
    if ":" not in name:
        known = ", ".join(dict.fromkeys((*_MODULES, *_registered)))
        raise ConfigError(f"unknown format {name!r}; give one of {known}, or my.module:FORMAT")
    found = outside.load(name, "format")
    if not isinstance(found, Format):
        raise ConfigError(f"format {name!r} is {found!r:.60}; expected an autopoly_env.export.formats.Format")
    return found


def format_of(path: Path) -> Format:
    """The format that a file's ending stands for. Raises ConfigError where it stands for none."""
    known = {suffix: made for made in formats().values() for suffix in made.suffixes}
    for suffix in sorted(known, key=len, reverse=True):  # .mesh.png before .png
        if path.name.lower().endswith(suffix):
            return known[suffix]
    raise ConfigError(f"{path}: no format has the ending {path.suffix or 'of nothing'}; give {', '.join(known)}")
