"""The folder of a run: what every agent made of every target, a line each, so that a killed run can go on.

RUN/run.json         the resolved suite and the names of its targets
RUN/records.jsonl    one record a line, appended as it comes
RUN/targets/*.png    the targets as the agents saw them
"""

import contextlib
import json
import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, TypeGuard

from pydantic import TypeAdapter, ValidationError

from autopoly_env.arguments import first_defect
from autopoly_env.errors import OutputError, RunError
from autopoly_env.files import write_atomically
from autopoly_env.mesh import PolyMesh
from autopoly_env.sequence import LESSON_FIELDS

FORMAT, VERSION = "autopoly-run", 1
RUN_FILE, RECORDS_FILE, TARGETS_FOLDER = "run.json", "records.jsonl", "targets"
TARGET_SIZE = 512  # pixels a side of a target's picture at most

Key = tuple[str, str, int]  # agent, target, seed: what there is one record of


@dataclass(frozen=True)
class MeshData:
    """A mesh as JSON keeps it."""

    vertices: list[tuple[float, float]]  # unit square, x right, y down
    faces: list[list[int]]  # indices of vertices

    @classmethod
    def of(cls, mesh: PolyMesh) -> "MeshData":
        """The plain numbers of a mesh."""
        return cls([(x, y) for x, y in mesh.vertices.tolist()], [list(face) for face in mesh.faces])

    def polymesh(self) -> PolyMesh:
        """The mesh. Raises MeshError if it is no valid one."""
        return PolyMesh.from_faces(self.vertices, self.faces)


@dataclass(frozen=True)
class Outcome:
    """What an agent made of a target, scored at the target's own resolution with the suite's weights."""

    r_sm: float  # IoU, 0 to 1
    r_sc: int  # V + E + F
    r_si: int  # self-intersections
    r_all: float
    V: int
    E: int
    F: int
    flipped_faces: int
    n_actions: int  # of the construction sequence
    n_refits: int
    seconds: float
    stopped_by: str  # as in `agents.solution.Stats`
    curve: list[tuple[int, float, float]]  # refits, seconds, best r_all so far, at the resolution of the search
    mesh: MeshData
    valid: float | None = (
        None  # these and all that follow as in `autopoly_env.sequence.Lesson`; older records have none
    )
    blocking_in: float | None = None
    moved: float | None = None
    quads: float | None = None
    ngons: int | None = None
    concave: int | None = None
    effort: float | None = None
    returns: int | None = None


@dataclass(frozen=True)
class Record:
    """One task: an agent, by its label in the suite, on a target. Either the outcome or the error is None."""

    agent: str
    target: str
    seed: int  # of the suite; what the agent draws from it depends on the target, too
    outcome: Outcome | None
    error: str | None = None  # one line

    @property
    def key(self) -> Key:
        """What there is only one record of in a run."""
        return self.agent, self.target, self.seed

    def to_json(self) -> str:
        """The record as one line of JSON; without an outcome its fields are null."""
        values = {name: getattr(self.outcome, name, None) for name in OUTCOME_FIELDS}
        line = {"agent": self.agent, "target": self.target, "seed": self.seed, **values, "error": self.error}
        return json.dumps(line, allow_nan=False, default=vars)

    @classmethod
    def from_json(cls, line: str | bytes) -> "Record":
        """The record in a line. Raises ValueError, in one line, if it is none."""
        values = json.loads(line, parse_constant=_refuse)
        if not isinstance(values, dict) or {*values, *_LESSON_FIELDS} != RECORD_FIELDS:
            raise ValueError(f"expected an object with the keys {', '.join(sorted(RECORD_FIELDS))}")
        outcome = {name: values.pop(name, None) for name in OUTCOME_FIELDS}
        is_failed = all(value is None for value in outcome.values())
        try:
            return _RECORD.validate_python({**values, "outcome": None if is_failed else outcome})
        except ValidationError as error:
            raise ValueError(str(first_defect(error))) from None


OUTCOME_FIELDS = tuple(field.name for field in fields(Outcome))
_LESSON_FIELDS = set(LESSON_FIELDS) - {"n_actions"}  # what older records may lack
RECORD_FIELDS = {"agent", "target", "seed", *OUTCOME_FIELDS, "error"}
_RECORD = TypeAdapter(Record)


def _refuse(constant: str) -> None:
    raise ValueError(f"{constant} is no number")


@dataclass(frozen=True)
class RunInfo:
    """What `run.json` says: the resolved suite as plain values, and the names of its targets in their order."""

    suite: dict[str, Any]
    targets: tuple[str, ...]

    def write(self, folder: Path) -> None:
        """Write RUN/run.json, whole or not at all. Raises OutputError."""
        values = {"format": FORMAT, "version": VERSION, "suite": self.suite, "targets": self.targets}
        write_atomically(folder / RUN_FILE, json.dumps(values, indent=1, allow_nan=False) + "\n")


def read_info(folder: Path) -> RunInfo:
    """What a run's run.json says. Raises RunError if it cannot be read, is no such file or of another version."""
    path = folder / RUN_FILE
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        reason = error.strerror or error
        raise RunError(f"cannot read {path} ({reason}); give the folder of a run of training.evaluate") from None
    except (ValueError, RecursionError):
        raise RunError(f"{path} is damaged: expected JSON; run the suite into another folder") from None
    if not isinstance(values, dict) or values.get("format") != FORMAT:
        raise RunError(f"{path}: expected the format {FORMAT!r}; give the folder of a run of training.evaluate")
    if values.get("version") != VERSION:
        raise RunError(
            f"{path} has version {values.get('version')!r}, this program reads {VERSION}; "
            "begin anew with --fresh or give another folder"
        )
    suite, targets = values.get("suite"), values.get("targets")
    if not (_is_suite(suite) and isinstance(targets, list) and all(map(_is_name, targets))):
        raise RunError(f"{path} is damaged: expected a suite and a list of targets; run the suite into another folder")
    return RunInfo(suite, tuple(targets))


def _is_suite(suite: Any) -> TypeGuard[dict[str, Any]]:
    """Whether it has agents with labels; the rest is for whoever uses it to check."""
    agents = suite.get("agents") if isinstance(suite, dict) else None
    return isinstance(agents, list) and all(isinstance(a, dict) and isinstance(a.get("label"), str) for a in agents)


def _is_name(target: Any) -> bool:
    """Whether the picture of a target of that name lies in the folder for it, and not elsewhere."""
    return isinstance(target, str) and target not in ("", ".", "..") and not set(target) & set("/\\\0")


def read_records(folder: Path) -> list[Record]:
    """The records of a run, in the order of their tasks' first; a half line at the end is left out.

    A task that has failed and was done again has several lines: the last one counts. Raises RunError, with the number
    of the line, for anything else that is no record.
    """
    path = folder / RECORDS_FILE
    try:
        with path.open("rb") as stream:
            return list({record.key: record for record in _parse(stream, path)}.values())
    except FileNotFoundError:
        return []
    except OSError as error:
        raise RunError(f"cannot read {path} ({error.strerror}); give a folder that can be read") from None


def _parse(lines: Iterable[bytes], path: Path) -> Iterator[Record]:
    for number, line in enumerate(lines, 1):
        if not line.endswith(b"\n"):
            return
        try:
            yield Record.from_json(line)
        except (ValueError, RecursionError) as error:
            reason = " ".join(str(error).split())
            raise RunError(f"{path}, line {number}: no record ({reason}); remove the line") from None


def target_path(folder: Path, target: str) -> Path:
    """Where the picture of a target lies in a run."""
    return folder / TARGETS_FOLDER / f"{target}.png"


class RecordWriter:
    """Appends records to RUN/records.jsonl, each on the disk as a whole line before `append` returns.

    Opening it removes a half line that a killed run has left, and keeps other processes out. Raises OutputError where
    that cannot be done.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / RECORDS_FILE
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._stream = self._path.open("a+b", buffering=0)
        except OSError as error:
            raise OutputError(f"cannot write {self._path} ({error.strerror}); give a writable folder") from None
        try:
            _lock(self._stream.fileno(), folder)
            self._size = _whole_lines(self._stream.fileno())
            self._stream.truncate(self._size)
        except BaseException as error:
            self._stream.close()
            if isinstance(error, OSError):
                raise OutputError(f"cannot write {self._path} ({error.strerror}); give another folder") from None
            raise

    def __enter__(self) -> "RecordWriter":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Let others write."""
        self._stream.close()

    def clear(self) -> None:
        """Remove all records. Raises OSError."""
        self._size = 0
        self._stream.truncate(0)

    def append(self, record: Record) -> None:
        """Write a record. Raises OutputError on a full disk: the lines before it stay as they are."""
        line = memoryview(record.to_json().encode("utf-8") + b"\n")
        n_written = 0
        try:
            while n_written < len(line):
                n_written += self._stream.write(line[n_written:])
            os.fsync(self._stream.fileno())
        except OSError as error:
            with contextlib.suppress(OSError):
                self._stream.truncate(self._size)
            what = "make room and go on with --resume"
            raise OutputError(f"cannot write {self._path} ({error.strerror}); {what}") from None
        self._size += len(line)


def _lock(descriptor: int, folder: Path) -> None:
    """Refuse a folder that another process is writing to."""
    try:
        import fcntl
    except ImportError:  # not on Windows, where the two would go unnoticed
        return
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise OutputError(f"another process is writing to {folder}; wait for it or give another folder") from None


def _whole_lines(descriptor: int) -> int:
    """How many bytes of a file are whole lines."""
    end = os.lseek(descriptor, 0, os.SEEK_END)
    while end > 0:
        begin = max(0, end - 65536)
        newline = os.pread(descriptor, end - begin, begin).rfind(b"\n")
        if newline >= 0:
            return begin + newline + 1
        end = begin
    return 0
