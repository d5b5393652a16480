"""A suite: targets, weights, operators, budget, and the agents that are measured on them."""

import hashlib
import json
import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import ConfigDict, Field

from agents.base import Agent
from agents.budget import Budget
from agents.options import put_override, read_yaml
from agents.registry import AGENTS, SUFFIXES, find_agent
from autopoly_env.errors import AutoPolyError, ConfigError
from autopoly_env.mesh import FaceRule
from autopoly_env.score import ScoreWeights
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator
from training.evaluation.targets import TargetSpec
from training.options import build_config

FOLDER = Path(__file__).parents[2] / "configs" / "suite"
WeightName = Literal["w_sm", "w_sc", "w_si", "w_locality"]
GROUND_TRUTH = "ground truth"  # the row of the meshes that targets were made from


@dataclass(frozen=True)
class Printed:
    """A row of a printed table."""

    r_sm: float
    r_sc: float
    r_si: float
    r_all: float

    def sum(self, weights: ScoreWeights) -> float:
        """What the printed parts add up to."""
        return weights.w_sm * self.r_sm - weights.w_sc * self.r_sc - weights.w_si * self.r_si


@dataclass(frozen=True)
class Entry:
    """An agent of a suite: a row of its table."""

    agent: str  # a name of agents/registry.py, my.module:Agent, or a YAML file of options (docs/agents.md)
    label: str = ""  # the agent's name if empty
    options: dict[str, Any] = field(default_factory=dict)
    weights: dict[WeightName, float] = field(default_factory=dict)  # of its search, not its score
    operators: str | None = None  # the suite's
    budget: Budget | None = None  # the suite's
    missing: str | None = None  # what the row says where there is no such agent; that is an error without it
    printed: Printed | None = None  # figures to show beside ours


@dataclass(frozen=True)
class Suite:
    """What is measured, and how. A YAML file without keys that are not here."""

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid")

    targets: Annotated[TargetSpec, Field(discriminator="kind")]
    agents: tuple[Entry, ...]
    name: str = ""
    weights: ScoreWeights = field(default_factory=ScoreWeights)
    operators: str = "full"
    resolution: int = 128  # at which the agents work; they are scored at the target's own
    max_steps: int = 100
    faces: FaceRule = "any"  # the rule of faces that all agents keep
    budget: Budget = field(default_factory=Budget)
    seeds: tuple[int, ...] = (0,)
    baseline: str = ""  # the label that the others are compared with; the first if empty
    notes: tuple[str, ...] = ()  # shown below the table

    def __post_init__(self) -> None:
        entries = tuple(_told_whole(replace(entry, label=entry.label or entry.agent)) for entry in self.agents)
        object.__setattr__(self, "agents", entries)
        labels = [entry.label for entry in entries]
        if not entries or len(set(labels)) < len(labels) or GROUND_TRUTH in labels:
            raise ConfigError(f"agents {', '.join(labels)}: expected at least one, each with a label of its own")
        if not self.seeds or len(set(self.seeds)) < len(self.seeds) or min(self.seeds) < 0:
            raise ConfigError(f"seeds {self.seeds}: expected at least one, no two alike, none below 0")
        self.check_baseline(self.baseline)

    def check_baseline(self, label: str | None) -> None:
        """Raise ConfigError for a baseline that is no label of the suite."""
        labels = [GROUND_TRUTH, *(entry.label for entry in self.agents)]
        if label and label not in labels:
            raise ConfigError(f"baseline {label!r} is no label of the suite; give one of {', '.join(labels)}")

    def entry(self, label: str) -> Entry:
        """The agent of that label."""
        return next(entry for entry in self.agents if entry.label == label)

    def simulator(self, silhouette: Silhouette, entry: Entry | None = None) -> Simulator:
        """The rules for one target: as an agent searches, or as the suite scores."""
        operators = self.operators if entry is None else entry.operators or self.operators
        weights = self.weights if entry is None else replace(self.weights, **entry.weights)
        return Simulator(
            silhouette,
            operators=operators,
            resolution=self.resolution,
            weights=weights,
            max_steps=self.max_steps,
            faces=self.faces,
        )

    def new_agent(self, entry: Entry, seed: int) -> Agent:
        """A fresh agent, drawing from `seed` if it draws at all. Raises ConfigError where there is no such agent."""
        options = {"seed": seed, **entry.options} if takes_seed(entry) else entry.options
        return find_agent(entry.agent).agent(**options)

    def check(self) -> None:
        """Raise ConfigError for an agent that must be there and is not, and for settings out of range."""
        for entry in self.agents:
            self.simulator(Silhouette(np.ones((1, 1), np.bool_)), entry)
            if entry.missing is None:
                try:
                    self.new_agent(entry, 0)
                except AutoPolyError as error:
                    raise ConfigError(f"suite {self.name}, {entry.label}: {error}") from None

    def missing(self) -> dict[str, str]:
        """Labels of the agents that may be missing and are, and what their rows say."""
        missing = {}
        for entry in self.agents:
            if entry.missing is not None:
                try:
                    self.new_agent(entry, 0)
                except AutoPolyError:
                    missing[entry.label] = entry.missing
        return missing


def takes_seed(entry: Entry) -> bool:
    """Whether an agent's result depends on the seed."""
    try:
        return "seed" in find_agent(entry.agent).options and "seed" not in entry.options
    except ConfigError:
        return False


def _told_whole(entry: Entry) -> Entry:
    """The entry with what is in its file of options, so that a run does not depend on the file any more.

    A seed in there is that of a single solve; those of a suite are its own.
    """
    if not entry.agent.endswith(SUFFIXES):
        return entry
    found = find_agent(entry.agent)
    given = {name: value for name, value in found.given.items() if name != "seed"}
    return replace(entry, agent=found.name, options={**given, **entry.options})


def task_seed(seed: int, target: str) -> int:
    """The seed of all agents on one target: it hangs on nothing else, such as who else takes part, and in what order.

    A child of the suite's seed as `SeedSequence.spawn` makes them, with the target's name for its number.
    """
    digest = hashlib.sha256(target.encode("utf-8")).digest()
    child = np.random.SeedSequence(seed, spawn_key=tuple(np.frombuffer(digest, "<u4").tolist()))
    return int(child.generate_state(1)[0])


def find_suite(given: str, overrides: Sequence[str] = ()) -> Suite:
    """The suite of that name in configs/suite, in a YAML file, or of the images in a folder.

    `overrides` are of the form "targets.n=10". Raises ConfigError where there is no such suite or it is not sound.
    """
    path, extra = FOLDER / f"{given}.yaml", list(overrides)
    if not (given.isidentifier() and os.path.isfile(path)):
        path = Path(given)
        if os.path.isdir(path) or any(letter in given for letter in "*?["):
            root, name = os.path.abspath(given), path.resolve().name if os.path.isdir(path) else "images"
            path = FOLDER / "folder.yaml"
            extra = [f"targets.root={json.dumps(root)}", f"name={json.dumps(name)}", *overrides]
        elif path.suffix not in (".yaml", ".yml"):
            known = ", ".join(sorted(path.stem for path in FOLDER.glob("*.yaml")))
            raise ConfigError(f"suite {given!r} is unknown; give one of {known}, a YAML file, or a folder of images")
    values = {"name": path.stem, **read_yaml(path, "a suite", may_be_empty=False)}
    for override in extra:
        put_override(values, override, f"--set {override}", "targets.n=10")
    return build_config(Suite, values, str(path) if path.parent != FOLDER else f"suite {path.stem}")


def with_budget(suite: Suite, text: str) -> Suite:
    """The suite with one budget, such as "refits=500" or "refits=500,seconds=2", for all of its agents."""
    values: dict[str, Any] = {}
    for part in text.split(","):
        if part.partition("=")[0] not in Budget.__dataclass_fields__:
            known = " or ".join(f"{name}=N" for name in Budget.__dataclass_fields__)
            raise ConfigError(f"--budget {text}: expected {known}")
        put_override(values, part, f"--budget {text}", "refits=500")
    budget = build_config(Budget, values, f"--budget {text}")
    return replace(suite, budget=budget, agents=tuple(replace(entry, budget=None) for entry in suite.agents))


def chosen(suite: Suite, names: Sequence[str]) -> tuple[Suite, set[str]]:
    """The labels that are meant by labels or names of agents; an agent that the suite lacks is added to it.

    Raises ConfigError for what is neither.
    """
    labels: set[str] = set()
    for name in names:
        meant = {e.label for e in suite.agents if e.label == name} or {e.label for e in suite.agents if e.agent == name}
        if name == GROUND_TRUTH:
            meant = {name}
        elif not meant and (name in AGENTS or ":" in name or name.endswith(SUFFIXES)):
            suite = replace(suite, agents=(*suite.agents, Entry(name)))
            meant = {name}
        if not meant:
            known = dict.fromkeys((*(entry.label for entry in suite.agents), *AGENTS))
            raise ConfigError(f"agent {name!r} is unknown; give some of {', '.join(known)}, or my.module:Agent")
        labels |= meant
    return suite, labels
