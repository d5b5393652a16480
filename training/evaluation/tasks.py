"""A task of an evaluation: one agent, one target, one seed. What happens in a worker."""

import io
import time
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from PIL import Image

from agents.budget import Budget, Progress
from agents.contract import solved
from autopoly_env.errors import AutoPolyError
from autopoly_env.mesh import PolyMesh
from autopoly_env.score import Score
from autopoly_env.sequence import ConstructionSequence, Lesson
from autopoly_env.silhouette import Silhouette
from training.evaluation.suite import GROUND_TRUTH, Entry, Suite, task_seed
from training.evaluation.targets import SuiteTarget, load_target
from training.parallel import one_line
from training.records import TARGET_SIZE, MeshData, Outcome, Record

N_CURVE = 60  # points of a curve at most
WARM_UP = Budget(refits=30)


@dataclass(frozen=True)
class EvalTask:
    """An agent, by its label, and what it is to do."""

    agent: str
    target: SuiteTarget
    seed: int
    wants_picture: bool = False  # of the target, along with the record

    def failed(self, problem: str) -> Record:
        """The record of a task without an outcome."""
        return Record(self.agent, self.target.name, self.seed, None, problem)


@dataclass(frozen=True)
class Result:
    """What a worker sends back."""

    record: Record
    picture: bytes | None = None  # a PNG


class Curve:
    """The improvements of a search: refits, seconds and best r_all at each."""

    def __init__(self) -> None:
        self._points: list[tuple[int, float, float]] = []
        self._began = time.perf_counter()

    def __call__(self, progress: Progress) -> None:
        """Note where the search stands."""
        best = progress.best_total
        if np.isfinite(best) and (not self._points or best > self._points[-1][2]):
            self._points.append((progress.n_refits, time.perf_counter() - self._began, best))

    def points(self) -> list[tuple[int, float, float]]:
        """At most N_CURVE of the points, evenly chosen, first and last among them."""
        n = len(self._points)
        return [self._points[k] for k in np.unique(np.linspace(0, n - 1, min(n, N_CURVE)).round().astype(int))]


def solve_task(suite: Suite, task: EvalTask) -> Result:
    """Do a task; whatever goes wrong with it is in its record."""
    picture = None
    try:
        silhouette = load_target(task.target)
        if task.wants_picture:
            picture = picture_of(silhouette)
        outcome = _known(suite, task, silhouette) if task.agent == GROUND_TRUTH else _solved(suite, task, silhouette)
    except AutoPolyError as error:
        return Result(task.failed(one_line(error)), picture)
    return Result(Record(task.agent, task.target.name, task.seed, outcome), picture)


def _solved(suite: Suite, task: EvalTask, silhouette: Silhouette) -> Outcome:
    """What an agent makes of the target within its budget."""
    entry = suite.entry(task.agent)
    _warm_up(suite, entry)
    agent = suite.new_agent(entry, task_seed(task.seed, task.target.name))
    simulator, curve = suite.simulator(silhouette, entry), Curve()
    began = time.perf_counter()
    solution = solved(agent, simulator, entry.budget or suite.budget, curve)
    seconds = time.perf_counter() - began
    if solution.stats.stopped_by == "interrupted":
        raise KeyboardInterrupt  # half a search is not a result
    score = suite.simulator(silhouette).final_score(solution.mesh)
    return _outcome(
        solution.mesh,
        score,
        solution.sequence,
        n_refits=solution.stats.n_refits,
        seconds=seconds,
        stopped_by=solution.stats.stopped_by,
        curve=[] if entry.weights else curve.points(),  # with other weights it would be on another scale
    )


def _known(suite: Suite, task: EvalTask, silhouette: Silhouette) -> Outcome:
    """What the mesh is worth that the target was made from."""
    sequence = task.target.known()
    if sequence is None:
        raise AutoPolyError(f"{task.target.name}: it is not known how this target was made")
    mesh = sequence.final()
    score = suite.simulator(silhouette).final_score(mesh)
    return _outcome(mesh, score, sequence, n_refits=0, seconds=0.0, stopped_by="finished", curve=[])


def _outcome(mesh: PolyMesh, score: Score, sequence: ConstructionSequence, **work: Any) -> Outcome:
    """A mesh, its score, how its construction reads, and what it took."""
    lesson = Lesson.of(sequence)
    n_vertices, n_edges, n_faces = mesh.counts
    return Outcome(
        r_sm=score.iou,
        r_sc=score.complexity,
        r_si=score.self_intersections,
        r_all=score.total,
        V=n_vertices,
        E=n_edges,
        F=n_faces,
        flipped_faces=int((mesh.face_areas() <= 0.0).sum()),
        mesh=MeshData.of(mesh),
        **vars(lesson),
        **work,
    )


def picture_of(silhouette: Silhouette) -> bytes:
    """A PNG of the mask, at most TARGET_SIZE pixels a side; the object is white."""
    size = min(silhouette.resolution, TARGET_SIZE)
    stream = io.BytesIO()
    Image.fromarray(silhouette.target(size).mask).save(stream, "PNG", optimize=True)
    return stream.getvalue()


_warm: set[str] = set()


def _warm_up(suite: Suite, entry: Entry) -> None:
    """Solve a small frame, once in a process: loading kernels is not to count as the first target's time.

    Whatever goes wrong here will go wrong again, and be recorded, with the target.
    """
    if entry.agent not in _warm:
        _warm.add(entry.agent)
        mask = np.zeros((32, 32), np.bool_)
        mask[6:26, 6:26] = True
        mask[12:20, 12:20] = False
        with suppress(Exception):
            frame = solved(suite.new_agent(entry, 0), suite.simulator(Silhouette(mask), entry), WARM_UP)
            if frame.stats.stopped_by == "interrupted":
                raise KeyboardInterrupt  # the agent has caught it, but it was meant for the run
