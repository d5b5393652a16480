"""The work behind `agents.solve`: one image after the other, each whole or not at all, until done or Ctrl-C."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from agents.base import Agent
from agents.budget import Budget, Progress
from agents.commands import pictures
from agents.commands.ctrl_c import CtrlC
from agents.commands.losses import in_words, losses_of
from agents.commands.report import Report
from agents.commands.results import OVERVIEW, RESULTS, Overview, Result, write_results
from agents.commands.running import TOLD
from agents.commands.wishes import NO_WISHES, Wishes
from agents.contract import solved
from agents.entry import AgentEntry
from agents.registry import find_agent
from agents.solution import Solution
from autopoly_env.compute import n_threads
from autopoly_env.details import Losses
from autopoly_env.errors import AutoPolyError, ConfigError
from autopoly_env.export import save_png
from autopoly_env.files import file_stem
from autopoly_env.guidance import AUTO, asymmetry
from autopoly_env.mesh import face_rule
from autopoly_env.outside import described
from autopoly_env.score import ScoreWeights
from autopoly_env.silhouette import DEFAULT_OPTIONS, SMALL, ObjectOptions, Silhouette, load_silhouette
from autopoly_env.simulator import Simulator


@dataclass(frozen=True)
class Settings:
    """What is the same for all images."""

    agent: str
    options: dict[str, Any]
    seed: int | None  # for agents that have such an option, unless `options` has it
    operators: str
    resolution: int
    max_steps: int
    weights: ScoreWeights
    budget: Budget
    wishes: Wishes = NO_WISHES
    faces: str = "any"  # the rule of faces
    picture: ObjectOptions = DEFAULT_OPTIONS
    show_mask: bool = False

    def check(self) -> None:
        """Raise ConfigError for whatever is wrong, before any image is read."""
        agent = self.new_agent()
        wishes = replace(self.wishes, importance=None)  # whether it has the image's proportions is seen with that
        dummy = replace(self, wishes=wishes).simulator(Silhouette(np.ones((1, 1), np.bool_)))
        agent.check(dummy)
        if self.budget.simulations is not None and not agent.runs_simulations:
            raise ConfigError(f"{self.agent} runs no simulations to limit: give --refits or --seconds instead")
        n_threads()

    def new_agent(self) -> Agent:
        """A fresh one for every image, so that no result depends on the images before it."""
        seed = {"seed": self._seed} if "seed" in self._entry.options else {}
        return self._entry.agent(**(self._options | seed))

    def simulator(self, silhouette: Silhouette) -> Simulator:
        """The rules, for one target."""
        return Simulator(
            silhouette,
            operators=self.operators,
            resolution=self.resolution,
            weights=self.weights,
            max_steps=self.max_steps,
            faces=face_rule(self.faces),
            **self.wishes.for_simulator(),
        )

    def as_dict(self) -> dict[str, Any]:
        """What a construction sequence keeps beside the simulator's settings."""
        budget = asdict(self.budget)
        settings: dict[str, Any] = {"agent": self._entry.name, "options": self._options, "seed": self._seed}
        settings["budget"] = budget
        if self.wishes.files:
            settings["guided_by"] = self.wishes.files
        if self.picture != DEFAULT_OPTIONS:
            settings["picture"] = pictures.as_dict(self.picture)
        return settings

    @cached_property
    def _entry(self) -> AgentEntry:
        return find_agent(self.agent)

    @property
    def _options(self) -> dict[str, Any]:
        """Those of a file, which a seed that was given replaces, and those that were given."""
        ours = {name: value for name, value in self._entry.given.items() if name != "seed" or self.seed is None}
        return ours | self.options

    @property
    def _seed(self) -> Any:
        """The seed that is used, where one is; it is not checked yet."""
        default = getattr(self._entry.default, "seed", 0) if self.seed is None else self.seed
        return self._options.get("seed", default)


@dataclass(frozen=True)
class Job:
    """An image, and the name under which its results go."""

    image: Path
    name: str
    notes: tuple[str, ...] = ()  # why it is not the name of the image, if it is not


def name_jobs(images: Sequence[Path], out: Path) -> list[Job]:
    """A name of its own for every image: its stem, with a number where another image has that name already.

    Raises ConfigError if a result would overwrite one of the images.
    """
    taken = {OVERVIEW: OVERVIEW}
    jobs = []
    for image in images:
        stem = file_stem(image)
        name, count = stem, 1
        while name.casefold() in taken:
            count += 1
            name = f"{stem}-{count}"
        notes = () if count == 1 else (f"warning: called {name} here, for {taken[stem.casefold()]} has its name, too",)
        taken[name.casefold()] = str(image)
        jobs.append(Job(image, name, notes))
    names = (*RESULTS, pictures.MASK)
    results = {(out / path).resolve() for job in jobs for path in (*(f"{job.name}/{f}" for f in names), OVERVIEW)}
    for image in images:
        if image.resolve() in results:
            raise ConfigError(f"the results would overwrite the image {image}; give another folder with --out")
    return jobs


def solve_all(jobs: Sequence[Job], settings: Settings, out: Path, report: Report) -> int:
    """Solve every image, write and report each; return the exit code."""
    overview = Overview(len(jobs))
    with CtrlC() as ctrl_c:
        try:
            n_left = _solve_each(jobs, settings, out, report, overview, ctrl_c)
            report.finish(_write_overview(overview, out, report))
        except KeyboardInterrupt:
            report.say("aborted by Ctrl-C; the files that were written are whole")
            return TOLD
    if ctrl_c.n_pressed:
        report.say(f"stopped by Ctrl-C: {n_left} of {len(jobs)} images left")
        return TOLD
    return 1 if report.n_failed else 0


def _solve_each(
    jobs: Sequence[Job], settings: Settings, out: Path, report: Report, overview: Overview, ctrl_c: CtrlC
) -> int:
    """Solve one image after the other until Ctrl-C; return how many are left then."""
    n_left = len(jobs)
    _load_kernels(settings, ctrl_c)
    for job in jobs:
        if ctrl_c.n_pressed:
            break
        report.begin(job.name)
        try:
            result, silhouette = _solve(job, settings, out, report, ctrl_c)
        except KeyboardInterrupt:
            if ctrl_c.n_pressed > 1:
                raise
            break
        except AutoPolyError as error:
            report.failed(str(job.image), str(error))
        except Exception as error:  # whatever it is, the other images can be solved
            report.failed(str(job.image), described(error))
        else:
            overview.add(result, silhouette)
            report.solved(result)
        n_left -= 1
    return n_left


def _load_kernels(settings: Settings, ctrl_c: CtrlC) -> None:
    """Solve a small frame: what is compiled or loaded on the way is not to count as the first image's time.

    Whatever goes wrong here will go wrong again, and be reported, with the first image.
    """
    with suppress(KeyboardInterrupt, Exception), ctrl_c.searching():
        solve_frame(settings)


def solve_frame(settings: Settings) -> None:
    """Solve a small frame, so that all kernels are there."""
    mask = np.zeros((32, 32), np.bool_)
    mask[6:26, 6:26] = True
    mask[12:20, 12:20] = False
    solved(settings.new_agent(), settings.simulator(Silhouette(mask)), settings.budget)


def _solve(job: Job, settings: Settings, out: Path, report: Report, ctrl_c: CtrlC) -> tuple[Result, Silhouette]:
    """Solve an image and write its results."""
    silhouette = load_silhouette(job.image, name=job.name, options=settings.picture)
    found = solve_picture(silhouette, settings, ctrl_c.heeding(report.progress), ctrl_c.searching)
    files = write_results(
        out / job.name, found.solution.sequence, silhouette, ctrl_c.shielded, with_mask=settings.show_mask
    )
    notes = (*job.notes, *silhouette.notes, *found.notes)
    return Result(job.image, job.name, found.solution, notes, files, found.losses), silhouette


@dataclass(frozen=True)
class Found:
    """What came of a picture."""

    solution: Solution  # whose sequence keeps the settings, too
    losses: Losses
    notes: tuple[str, ...]  # on the way it was built and what is lost, those on the picture aside


def solve_picture(
    silhouette: Silhouette,
    settings: Settings,
    on_progress: Callable[[Progress], None],
    searching: Callable[[], AbstractContextManager[None]] = nullcontext,
) -> Found:
    """Solve a picture as the settings say; the search itself is within `searching()`."""
    simulator, agent = settings.simulator(silhouette), settings.new_agent()
    with searching():
        solution = solved(agent, simulator, settings.budget, on_progress)
    losses = losses_of(solution, simulator)
    lost = in_words(losses, simulator, solution.score.iou)
    own = {**settings.as_dict(), **({"lost": lost} if lost else {})}
    sequence = replace(solution.sequence, settings={**solution.sequence.settings, **own})
    notes = [*_notes_on_scoring(silhouette), *_notes_on_symmetry(settings, simulator), *([lost] if lost else [])]
    return Found(replace(solution, sequence=sequence), losses, tuple(notes))


def _notes_on_scoring(silhouette: Silhouette) -> list[str]:
    if not silhouette.is_scored_by_area:
        return []
    return [f"fewer than {SMALL} pixels a side ({silhouette.resolution}): r_sm is of exact areas"]


def _notes_on_symmetry(settings: Settings, simulator: Simulator) -> list[str]:
    """That it was decided to build left and right alike, where the user did not say about which axis."""
    axis = simulator.guidance.axis
    if settings.wishes.symmetry != AUTO or axis is None:
        return []
    share = asymmetry(simulator.silhouette, axis)
    return [f"left and right are alike ({share:.1%} differ): built so about x = {axis:g} (--symmetry off)"]


def _write_overview(overview: Overview, out: Path, report: Report) -> Path | None:
    """Draw all meshes on one page, if there are several; return its path."""
    if len(overview) < 2:
        return None
    try:
        return save_png(overview.page(), out / OVERVIEW)
    except AutoPolyError as error:
        report.failed(str(out / OVERVIEW), str(error))
        return None
