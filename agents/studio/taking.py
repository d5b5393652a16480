"""Taking a construction along: a file in any format, the shared file, what its command reads, all results in one."""

import io
import tempfile
import zipfile
from collections.abc import Iterable
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agents.commands.results import write_results
from agents.studio.items import Item, Version
from agents.studio.painting import as_png
from agents.studio.sharing import SUFFIX, Shared, write_shared
from agents.studio.uploads import folder_name
from agents.studio.wording import in_words
from autopoly_env.errors import ConfigError
from autopoly_env.export.formats import Export, check_size, find_format, formats
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import Silhouette

SHARE, SEQUENCE = "share", "sequence"  # beside the names of formats
MOST_DEPTH = 1.0


@dataclass(frozen=True)
class Taken:
    """A file to take along."""

    name: str
    data: bytes


@dataclass(frozen=True, eq=False)
class Taking:
    """What is taken of an item: copied in the thread of the event loop, to be written in another."""

    name: str
    version: Version
    silhouette: Silhouette | None
    shared: Shared

    @classmethod
    def of(cls, item: Item) -> "Taking":
        """Of the version that is looked at. Raises ConfigError if there is none."""
        if item.version is None:
            raise ConfigError("there is no mesh yet: search first")
        sequence = item.version.sequence
        shared = Shared(
            item.name, item.picture, item.options, item.choices, item.painted, item.version.locked, sequence
        )
        return cls(item.name, item.version, item.silhouette, shared)


def kinds() -> list[dict[str, Any]]:
    """All that can be taken, as the page lists it."""
    found = [
        {
            "name": made.name,
            "suffix": made.suffix,
            "help": in_words(made.help),
            "heeds": sorted(made.heeded & {"depth", "size"}),
        }
        for made in formats().values()
    ]
    return [
        {"name": SHARE, "suffix": SUFFIX, "help": "picture, wishes and construction: drop it here again", "heeds": []},
        {"name": SEQUENCE, "suffix": ".sequence.json", "help": "the construction, to be replayed", "heeds": []},
        *found,
    ]


def taken(taking: Taking, kind: str, depth: float = 0.0, size: float | None = None) -> Taken:
    """A file of that kind. Raises ConfigError for a kind that there is not, and what a format's writer raises."""
    sequence = taking.version.sequence
    if kind == SHARE:
        return Taken(f"{taking.name}{SUFFIX}", write_shared(taking.shared).encode())
    if kind == SEQUENCE:
        return Taken(f"{taking.name}.sequence.json", sequence.to_json().encode())
    if kind not in formats():  # nothing that a page names is imported
        raise ConfigError(f"format {kind!r}: expected one of {', '.join(formats())}")
    if not 0.0 <= depth <= MOST_DEPTH:
        raise ConfigError(f"thickness {depth:g}: expected 0 to {MOST_DEPTH:g}, in sides of the picture")
    made = find_format(kind)
    given = Export(
        sequence,
        taking.silhouette if "target" in made.heeded else None,
        depth if "depth" in made.heeded else 0.0,
        check_size(size) if size is not None and "size" in made.heeded else None,
    )
    with tempfile.TemporaryDirectory(prefix="autopoly-studio-") as folder:
        path = Path(folder) / f"{folder_name(taking.name)}{made.suffix}"
        made.write(given, path)
        return Taken(f"{taking.name}{made.suffix}", path.read_bytes())


def file_of_command(taking: Taking, name: str) -> Taken:
    """A file that the command of the version reads beside the picture. Raises ConfigError if it reads no such file."""
    task = taking.version.task
    names = {} if task is None else {file: option for option, file in task.files().items()}
    if task is None or name not in names:
        raise ConfigError("the command reads no such file")
    if names[name] == "importance":
        assert task.painted is not None
        return Taken(name, as_png(task.painted))
    sequence: ConstructionSequence | None = task.start if names[name] == "start" else task.steps
    assert sequence is not None
    return Taken(name, sequence.to_json().encode())


def all_results(takings: Iterable[Taking]) -> Taken:
    """What `agents.solve` writes, a folder for each, in one ZIP file."""
    stream = io.BytesIO()
    with (
        zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive,
        tempfile.TemporaryDirectory(prefix="autopoly-studio-") as folder,
    ):
        for k, taking in enumerate(takings):
            silhouette = taking.silhouette
            if silhouette is None:
                continue
            files = write_results(Path(folder) / str(k), taking.version.sequence, silhouette, nullcontext)
            for name, path in files.items():
                archive.write(path, f"{folder_name(taking.name)}/{name}")
    return Taken("autopoly.zip", stream.getvalue())


def keep(taking: Taking, out: Path) -> Path:
    """Write the results into the folder `out`, and return where they are. Raises OutputError."""
    if taking.silhouette is None:
        raise ConfigError(f"{taking.name}: there is no picture to write beside the mesh")
    folder = out / folder_name(taking.name)
    out.mkdir(parents=True, exist_ok=True)
    write_results(folder, taking.version.sequence, taking.silhouette, nullcontext)
    return folder
