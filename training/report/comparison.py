"""`Comparison`: the records of several runs side by side, and the numbers of its headline table.

A *series* is an agent of a run. Several seeds of one target count as one: their mean, since they are not independent.
"""

import os
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np

from agents.commands.columns import LESSON
from autopoly_env.arrays import FloatArray
from autopoly_env.errors import ConfigError, RunError
from training.records import Outcome, Record, RunInfo, read_info, read_records, target_path
from training.report.statistics import Interval, bootstrap_mean

TIE = 1e-9  # r_all points that two equal scores may differ by
NOT_COMPARED = ("name", "agents", "baseline", "notes")  # in which two suites that measure the same may differ


@dataclass(frozen=True)
class Series:
    """What one agent made of the targets of one run; `run` is the run's place in the list of those compared."""

    label: str
    run: int
    records: tuple[Record, ...]

    @property
    def outcomes(self) -> list[tuple[str, Outcome]]:
        """(target, outcome) of all that did not fail."""
        return [(record.target, record.outcome) for record in self.records if record.outcome is not None]

    @property
    def n_failed(self) -> int:
        """Records that are errors."""
        return sum(record.outcome is None for record in self.records)

    def by_target(self, value: "Value") -> dict[str, float]:
        """The mean of a value over the seeds of each target, without those of which it is not known."""
        values: dict[str, list[float]] = {}
        for target, outcome in self.outcomes:
            number = value(outcome)
            if number is not None:
                values.setdefault(target, []).append(number)
        return {target: float(np.mean(numbers)) for target, numbers in values.items()}


@dataclass(frozen=True)
class Run:
    """A folder that was compared."""

    folder: Path
    name: str  # unlike that of the others
    suite: dict[str, Any]

    def picture(self, target: str) -> Path | None:
        """The picture of a target, if it is there."""
        path = target_path(self.folder, target)
        try:
            is_inside = self.folder.resolve() in path.resolve().parents
            return path if is_inside and path.is_file() else None
        except (OSError, ValueError):  # a name that no file can have
            return None


@dataclass(frozen=True)
class Comparison:
    """Series with labels unlike each other, from `runs`; `notes` are warnings to show with every number."""

    runs: tuple[Run, ...]
    series: tuple[Series, ...]
    baseline: int  # place in `series`
    notes: tuple[str, ...]

    @property
    def targets(self) -> list[str]:
        """All targets, in the order in which they come up."""
        return list(dict.fromkeys(record.target for series in self.series for record in series.records))


@dataclass(frozen=True)
class Row:
    """A line of the headline table: means over targets with 95 % intervals, and the duel with the baseline."""

    label: str
    n_targets: int
    n_failed: int
    means: dict[str, Interval]  # by the names in MEANS
    wins: int
    ties: int
    losses: int
    lead: Interval | None  # r_all above the baseline on the targets of both; None where there are none
    is_baseline: bool = False


Value = Callable[[Outcome], float | None]

MEANS: dict[str, Value] = {
    "r_sm": lambda outcome: outcome.r_sm,
    "r_sc": lambda outcome: outcome.r_sc,
    "r_si": lambda outcome: outcome.r_si,
    "r_all": lambda outcome: outcome.r_all,
    "refits": lambda outcome: outcome.n_refits,
    "seconds": lambda outcome: outcome.seconds,
    "actions": lambda outcome: outcome.n_actions,  # this and all that follow tell how the construction reads
    **{name: attrgetter(name) for name in LESSON if name != "actions"},
}


def read_runs(folders: Sequence[Path], baseline: str | None = None) -> Comparison:
    """The runs in some folders. Without a baseline it is that of the first suite, or else the first series.

    Raises RunError for a folder that holds no run or one of another version, ConfigError for a baseline that is not
    among the labels.
    """
    unique = list(dict.fromkeys(folder.resolve() for folder in folders))
    infos = [read_info(folder) for folder in unique]
    runs = tuple(Run(*parts) for parts in zip(unique, _names(unique), (info.suite for info in infos), strict=True))
    found: list[tuple[int, str, list[Record]]] = []
    notes = _suite_notes(runs)
    for i, (run, info) in enumerate(zip(runs, infos, strict=True)):
        by_agent = _by_agent(info, read_records(run.folder))
        if not by_agent:
            notes.append(f"{run.name}: holds no records yet")
        found += [(i, agent, records) for agent, records in by_agent.items()]
    if not found:
        raise RunError(f"{', '.join(map(str, folders))}: no records; run training.evaluate first")
    n_runs_of = Counter(agent for _, agent, _ in found)
    labels = [agent if n_runs_of[agent] == 1 else f"{agent} ({runs[i].name})" for i, agent, _ in found]
    series = tuple(Series(label, i, tuple(those)) for label, (i, _, those) in zip(_unlike(labels), found, strict=True))
    place = _find(baseline, str(runs[0].suite.get("baseline", "")), series)
    return Comparison(runs, series, place, tuple(notes + _coverage_notes(series)))


def rows_of(comparison: Comparison) -> list[Row]:
    """The headline table, in the order of the series."""
    base = comparison.series[comparison.baseline]
    return [_row(series, base) for series in comparison.series]


def _row(series: Series, base: Series) -> Row:
    means = {name: bootstrap_mean(_array(series.by_target(value).values())) for name, value in MEANS.items()}
    own, others = series.by_target(MEANS["r_all"]), base.by_target(MEANS["r_all"])
    leads = _array(own[target] - others[target] for target in own if target in others)
    failed = {record.target for record in series.records} - set(own)
    n_lost_by_failing = len(failed & set(others))
    n_won_by_failing = len({record.target for record in base.records}.difference(others) & set(own))
    return Row(
        series.label,
        len(own),
        series.n_failed,
        means,
        int((leads > TIE).sum()) + n_won_by_failing,
        int((abs(leads) <= TIE).sum()),
        int((leads < -TIE).sum()) + n_lost_by_failing,
        None if series is base or not leads.size else bootstrap_mean(leads),
        series is base,
    )


def _array(values: Iterable[float]) -> FloatArray:
    return np.fromiter(values, np.float64)


def _by_agent(info: RunInfo, records: Iterable[Record]) -> dict[str, list[Record]]:
    """The last record of every key, by agents as the suite has them, then by targets as the run has them."""
    last = {record.key: record for record in records}
    places = {target: t for t, target in enumerate(info.targets)}
    order = sorted(last.values(), key=lambda record: (places.get(record.target, len(places)), record.seed))
    by_agent: dict[str, list[Record]] = {entry["label"]: [] for entry in info.suite["agents"]}
    for record in order:
        by_agent.setdefault(record.agent, []).append(record)
    return {agent: those for agent, those in by_agent.items() if those}


def _names(folders: Sequence[Path]) -> list[str]:
    """The folders' own names, with as many of the folders above as it takes to tell them apart."""
    for depth in range(1, max((len(folder.parts) for folder in folders), default=1) + 1):
        names = [os.path.join(*folder.parts[-depth:]) for folder in folders]
        if len(set(names)) == len(names):
            break
    return names


def _unlike(labels: Sequence[str]) -> list[str]:
    """The labels, with a number where one has come before."""
    taken: set[str] = set()
    unlike = []
    for given in labels:
        label = given.encode("utf-8", "replace").decode()
        name, count = label, 1
        while name in taken:
            count += 1
            name = f"{label} #{count}"
        taken.add(name)
        unlike.append(name)
    return unlike


def _find(wanted: str | None, usual: str, series: Sequence[Series]) -> int:
    """The place of the wanted label, else that of the usual one if it is there, else the first."""
    labels = [one.label for one in series]
    if wanted is None:
        return labels.index(usual) if usual in labels else 0
    if wanted not in labels:
        raise ConfigError(f"baseline {wanted!r} is not among what is compared; give one of {', '.join(labels)}")
    return labels.index(wanted)


def _suite_notes(runs: Sequence[Run]) -> list[str]:
    """In what the suites of the other runs differ from that of the first."""
    notes = []
    for run in runs[1:]:
        first = runs[0].suite
        keys = [k for k in sorted(first.keys() | run.suite.keys()) if k not in NOT_COMPARED]
        unlike = [key for key in keys if first.get(key) != run.suite.get(key)]
        if unlike:
            notes.append(
                f"{run.name} was run with another suite than {runs[0].name} (differs in {', '.join(unlike)}): "
                "their numbers may not be comparable"
            )
    return notes


def _coverage_notes(series: Sequence[Series]) -> list[str]:
    """Which series lack targets that others have, and which have failures."""
    everything = {record.target for one in series for record in one.records}
    notes = []
    for one in series:
        n_missing = len(everything) - len({record.target for record in one.records})
        if n_missing:
            notes.append(f"{one.label}: {n_missing} of {len(everything)} targets are missing; its means lack them")
        if one.n_failed:
            notes.append(f"{one.label}: {one.n_failed} failed; its means lack them, a duel with the baseline is lost")
    return notes
