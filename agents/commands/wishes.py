"""What `agents.solve` is told of the way to build: its files are read, and its words understood, before the work."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from autopoly_env.arrays import FloatArray
from autopoly_env.errors import AutoPolyError, ConfigError
from autopoly_env.export import load_obj
from autopoly_env.guidance import AUTO, KEPT, read_importance
from autopoly_env.mesh import PolyMesh
from autopoly_env.sequence import ConstructionSequence


@dataclass(frozen=True, eq=False)
class Wishes:
    """The options of the command; see `Simulator` for what they do."""

    importance: FloatArray | None = None  # (H, W), 0 to 1
    start: PolyMesh | ConstructionSequence | None = None
    locked: tuple[int, ...] = ()
    symmetry: bool | float | str | None = None
    keep: str | None = None  # holes, parts or all
    align: bool = False
    files: dict[str, str] = field(default_factory=dict)  # by option, where it came from

    def for_simulator(self) -> dict[str, Any]:
        """Arguments of `Simulator`."""
        return {
            "importance": self.importance,
            "start": self.start,
            "locked": self.locked,
            "symmetry": self.symmetry,
            "keep": self.keep,
            "align": self.align,
        }


NO_WISHES = Wishes()


def read_wishes(
    importance: Path | None,
    start: Path | None,
    lock: str | None,
    symmetry: str | None,
    keep: str | None = None,
    align: bool = False,
) -> Wishes:
    """The wishes behind the options as they were typed. Raises ConfigError that names the option that is wrong."""
    levels = None if importance is None else read_importance(importance)
    mesh = None if start is None else _read_start(start)
    files = {"importance": importance, "start": start}
    named = {name: str(path) for name, path in files.items() if path}
    return replace(read_words(_ids(lock), symmetry, keep, align, levels, mesh), files=named)


def read_words(
    locked: Iterable[int] | None,
    symmetry: str | None,
    keep: str | None = None,
    align: bool = False,
    importance: FloatArray | None = None,
    start: PolyMesh | ConstructionSequence | None = None,
) -> Wishes:
    """The wishes of one whose files have been read. Raises ConfigError that names the option that is wrong."""
    if keep is not None and keep not in KEPT:
        raise ConfigError(f"--keep {keep}: expected one of {', '.join(KEPT)}")
    return Wishes(importance, start, tuple(locked or ()), _axis(symmetry), keep, align)


def _read_start(path: Path) -> PolyMesh | ConstructionSequence:
    try:
        match path.suffix.lower():
            case ".obj":
                return load_obj(path)
            case ".json":
                return ConstructionSequence.load(path)
    except AutoPolyError as error:
        raise ConfigError(f"--start: {error}") from None
    raise ConfigError(f"--start {path}: expected a mesh (.obj) or a construction sequence (.json)")


def _ids(text: str | None) -> tuple[int, ...]:
    try:
        ids = [] if text is None else [int(word) for word in text.split(",")]
    except ValueError:
        ids = [-1]
    if any(name < 0 for name in ids):
        raise ConfigError(f"--lock {text}: expected ids of vertices with commas between them, such as 0,3,5")
    return tuple(dict.fromkeys(ids))


def _axis(text: str | None) -> bool | float | str | None:
    match text:
        case None | "off":
            return None
        case "auto":
            return AUTO
        case "best":
            return True
    try:
        return float(text)
    except ValueError:
        raise ConfigError(f"--symmetry {text}: expected auto, best, off, or the x of the axis, 0 to 1") from None
