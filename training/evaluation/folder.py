"""Which run a folder holds: beginning one, going on with one, and merging the shards of one."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from autopoly_env.errors import OutputError, RunError
from autopoly_env.files import write_atomically
from training.evaluation.suite import Suite
from training.options import build_config, plain
from training.records import (
    RECORDS_FILE,
    RUN_FILE,
    TARGETS_FOLDER,
    Key,
    Record,
    RecordWriter,
    RunInfo,
    read_info,
    read_records,
    target_path,
)

_SINCE = {"faces": "any"}  # keys of a suite that runs of before have not, and what they were run with
TABLES = ("table.md", "table.csv")


def suite_of(info: RunInfo, folder: Path) -> Suite:
    """The suite of a run. Raises ConfigError if this program cannot make sense of it."""
    return build_config(Suite, info.suite, str(folder / RUN_FILE))


def joined(info: RunInfo, other: RunInfo, folder: Path) -> RunInfo:
    """Two parts of one run: all agents and targets of both.

    Raises RunError, naming `folder` as the other's, if the suites do not measure the same.
    """
    agents = {entry["label"]: entry for entry in info.suite["agents"]}
    others = {entry["label"]: entry for entry in other.suite["agents"]}
    common = agents.keys() & others.keys()
    ours = {**_SINCE, **info.suite, "agents": {label: _measured(agents[label]) for label in common}}
    theirs = {**_SINCE, **other.suite, "agents": {label: _measured(others[label]) for label in common}}
    difference = _difference(ours, theirs)
    if difference:
        raise RunError(
            f"{folder} holds another suite ({difference}); begin anew with --fresh or give another folder with --out"
        )
    suite = {**info.suite, "agents": list((others | agents).values())}
    return RunInfo(suite, tuple(dict.fromkeys((*other.targets, *info.targets))))


def claim(folder: Path, suite: Suite, targets: Sequence[str], *, resume: bool, fresh: bool) -> tuple[RunInfo, set[Key]]:
    """What run.json is to say, and what is done already and well. Writes nothing.

    Raises RunError where the folder holds another run, or this one and nobody said whether to go on.
    """
    info = RunInfo(plain(suite), tuple(targets))
    if fresh or not (folder / RUN_FILE).exists():
        if not fresh and (folder / RECORDS_FILE).exists():
            raise RunError(f"{folder} has records but no {RUN_FILE}; begin anew with --fresh or give another folder")
        return info, set()
    info = joined(info, read_info(folder), folder)
    records = read_records(folder)
    if records and not resume:
        raise RunError(
            f"{folder} holds {len(records)} records of this suite already; go on with --resume, "
            "begin anew with --fresh or give another folder with --out"
        )
    return info, {record.key for record in records if record.outcome is not None}


def begin(folder: Path, info: RunInfo, *, fresh: bool) -> RecordWriter:
    """Open the run for writing; `fresh` removes what an earlier one has left. Raises OutputError."""
    writer = RecordWriter(folder)
    try:
        if fresh:
            writer.clear()
            for path in (*(folder / name for name in TABLES), *(folder / TARGETS_FOLDER).glob("*.png")):
                path.unlink(missing_ok=True)
        info.write(folder)
    except BaseException as error:
        writer.close()
        if isinstance(error, OSError):
            raise OutputError(f"cannot empty {folder} ({error.strerror}); give another folder with --out") from None
        raise
    return writer


def merge(parts: Sequence[Path], folder: Path, *, fresh: bool) -> RunInfo:
    """Write the run that several folders hold parts of. Of a task that several have done, the first outcome counts.

    Raises RunError if the parts are of different suites or `folder` holds a run that is not one of them.
    """
    is_part = folder.resolve() in [part.resolve() for part in parts]
    if (folder / RUN_FILE).exists() and not fresh and not is_part:
        raise RunError(f"{folder} holds a run already; replace it with --fresh or give another folder with --out")
    info, records = read_info(parts[0]), dict[Key, Record]()
    for part in parts:
        info = joined(info, read_info(part), part)
        for record in read_records(part):
            known = records.get(record.key)
            if known is None or known.outcome is None:
                records[record.key] = record
    begin(folder, info, fresh=False).close()
    write_atomically(folder / RECORDS_FILE, "".join(record.to_json() + "\n" for record in records.values()))
    for name in info.targets:
        found = next((path for part in parts if (path := target_path(part, name)).is_file()), None)
        if found is not None and found != target_path(folder, name):
            write_atomically(target_path(folder, name), found.read_bytes())
    return info


def _measured(entry: dict[str, Any]) -> dict[str, Any]:
    """What an agent's results hang on: not on what its row says where there is no such agent."""
    return {key: value for key, value in entry.items() if key != "missing"}


def _difference(ours: Any, theirs: Any, key: str = "") -> str:
    """The first key at which two values differ, and how; empty if none."""
    if isinstance(ours, dict) and isinstance(theirs, dict):
        names = dict.fromkeys((*ours, *theirs))
        parts = (_difference(ours.get(n), theirs.get(n), f"{key}.{n}" if key else str(n)) for n in names)
        return next(filter(None, parts), "")
    return "" if ours == theirs else f"{key}: {_short(theirs)} there, {_short(ours)} here"


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
