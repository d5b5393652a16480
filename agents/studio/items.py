"""`Item`: a picture in the studio, with all that was chosen, wished for and found. It lives in the server's memory."""

import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from agents.commands import pictures
from agents.studio.choices import Choices, Task, as_plain
from agents.studio.masks import painted_target, plain_mask
from agents.studio.shapes import plain_mesh
from agents.studio.uploads import Opened
from agents.studio.wording import in_words
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh
from autopoly_env.score import Score, ScoreWeights, score
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import DEFAULT_OPTIONS, ObjectOptions, Silhouette

MOST_VERSIONS = 60  # that undo goes back

WAITING, SEARCHING, PAUSED, DONE, FAILED, IDLE = "waiting", "searching", "paused", "done", "failed", "idle"


@dataclass(frozen=True, eq=False)
class Version:
    """A construction, and how it came about."""

    sequence: ConstructionSequence
    told: str  # in a few words
    command: str = ""  # what to type for the same; empty where a hand has had a part in it
    task: Task | None = None  # the search that found it
    notes: tuple[str, ...] = ()
    locked: tuple[int, ...] = ()  # vertices that stay where they are when a search goes on from it
    is_by_hand: bool = False  # whether a hand has had a part in it, which later searches are to keep

    @property
    def score(self) -> dict[str, Any]:
        steps = self.sequence.steps
        return steps[-1].score if steps else self.sequence.start_score


@dataclass(eq=False)
class Item:
    """What the server knows of a picture; changed by the thread of the event loop alone."""

    id: int
    name: str
    picture: bytes | None
    options: ObjectOptions = DEFAULT_OPTIONS
    silhouette: Silhouette | None = None
    problem: str = ""  # of the picture, or of the last search
    choices: Choices = field(default_factory=Choices)
    painted: bytes | None = None
    shown: bytes = b""
    small: bytes = b""
    status: str = IDLE
    versions: list[Version] = field(default_factory=list)
    at: int = -1  # which of them is looked at
    is_front: bool = True  # searched before what waits in the queue
    asked: Task | None = None  # the search that waits or runs
    wish_number: int = 0  # counts the changes of what is searched for: news of older ones are no news

    @classmethod
    def of(cls, number: int, found: Opened) -> "Item":
        """An item of a file that was read."""
        item = cls(number, found.name, found.picture, found.options, found.silhouette, found.problem)
        item.shown, item.small = found.shown, found.small
        if found.shared is not None:
            item.choices, item.painted = found.shared.choices, found.shared.painted
        if found.sequence is not None:
            locked = () if found.shared is None else found.shared.locked
            item.push(Version(found.sequence, "opened", locked=locked, is_by_hand=True))
        return item

    @property
    def version(self) -> Version | None:
        """The one that is looked at."""
        return self.versions[self.at] if self.versions else None

    def push(self, version: Version) -> None:
        """Look at a new version; those that were undone are gone."""
        names = set(version.sequence.final().vertex_ids)
        kept = replace(version, locked=tuple(name for name in version.locked if name in names))
        self.versions = [*self.versions[: self.at + 1], kept][-MOST_VERSIONS:]
        self.at = len(self.versions) - 1

    def lock(self, names: tuple[int, ...]) -> None:
        """These vertices, and no others, are to stay. Raises ConfigError for those that there are not."""
        version = self.version
        if version is None or not set(names) <= set(version.sequence.final().vertex_ids):
            raise ConfigError("expected ids of vertices of the mesh")
        self.versions[self.at] = replace(version, locked=tuple(sorted(set(names))))

    def task(self, *, goes_on: bool = False, steps: ConstructionSequence | None = None) -> Task:
        """A search for what is wished for now, from the picture or from the version that is looked at."""
        assert self.silhouette is not None
        version = self.version if goes_on else None
        start, locked = (None, ()) if version is None else (version.sequence, version.locked)
        return Task(self.silhouette, self.options, self.choices, self.painted, start, locked, steps)

    def target(self) -> Silhouette:
        """The silhouette with what matters in it. Raises ConfigError where no object was found."""
        if self.silhouette is None:
            raise ConfigError(f"there is no object in the picture: {self.problem or 'choose another option'}")
        return painted_target(self.silhouette, self.painted)

    def scored(self, mesh: PolyMesh) -> Score:
        """What a mesh is worth here."""
        target = self.target()
        return score(mesh, target.target(target.resolution), ScoreWeights(w_sc=self.choices.w_sc))

    def axis(self) -> float | None:
        """The axis about which left and right were asked to be alike in the version that is looked at."""
        found = None if self.version is None else self.version.sequence.settings.get("symmetry")
        return float(found) if isinstance(found, int | float) and 0.0 < found < 1.0 else None

    def summary(self) -> dict[str, Any]:
        """A line in the list of all pictures."""
        version = self.version
        return {
            "id": self.id,
            "name": self.name,
            "status": self.status,
            "problem": self.problem,
            "total": None if version is None else round(version.score["total"], 2),
            "iou": None if version is None else round(version.score["iou"], 4),
            "faces": None if version is None else len(version.sequence.final().faces),
        }

    def plain(self) -> dict[str, Any]:
        """All that the page shows of it."""
        return {
            **self.summary(),
            "has_picture": bool(self.picture),
            "object": self.options.__dict__ | {},
            "given_object": pictures.as_dict(self.options),
            "notes": [] if self.silhouette is None else [in_words(note) for note in self.silhouette.notes],
            **plain_mask(self.silhouette),
            "choices": as_plain(self.choices),
            "is_painted": self.painted is not None,
            "paint": 0 if self.painted is None else zlib.crc32(self.painted),
            "locked": [] if self.version is None else list(self.version.locked),
            "wish": self.wish_number,
            "n_undo": max(0, self.at),
            "n_redo": len(self.versions) - 1 - self.at,
            "version": self._plain_version(),
        }

    def _plain_version(self) -> dict[str, Any] | None:
        version = self.version
        if version is None:
            return None
        sequence = version.sequence
        return {
            "mesh": plain_mesh(sequence.final()),
            "score": version.score,
            "told": version.told,
            "command": version.command,
            "files": [] if version.task is None else list(version.task.files().values()),
            "notes": [in_words(note) for note in version.notes],
            "n_steps": len(sequence.steps),
            "totals": [round(one["total"], 3) for one in _scores(sequence)],
            "faces": sequence.faces,
            "axis": self.axis(),
        }


def _scores(sequence: ConstructionSequence) -> Sequence[dict[str, Any]]:
    return [sequence.start_score, *(step.score for step in sequence.steps)]
