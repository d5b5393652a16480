"""Cases of the search benchmarks - an agent, a target, a budget - and their records, a line of JSON each, kept as they
come: what a run that was stopped has measured is not measured again."""

import json
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

from agents.budget import Budget
from agents.registry import make_agent
from agents.solution import Solution
from autopoly_env.errors import OutputError
from autopoly_env.files import write_atomically
from autopoly_env.mesh import face_rule
from autopoly_env.score import ScoreWeights
from autopoly_env.silhouette import Silhouette, load_silhouette
from autopoly_env.simulator import Simulator
from autopoly_env.targets import make_targets, split_seed
from benchmarks.foretold import solve_foretold
from training.parallel import map_tasks

_MADE = ("construction", "objects")  # kinds of targets that are made: KIND:SEED, a seed of the test split
RESOLUTION = 128
_WARM_UP = Budget(refits=30)


@dataclass(frozen=True)
class Case:
    """What is to be solved, by whom, and how long he may take."""

    target: str  # "construction:SEED", "objects:SEED" or the path of an image
    agent: str
    w_sc: float
    options: str = "{}"  # of the agent, as JSON
    refits: int | None = None
    seconds: float | None = None
    faces: str = "any"  # the rule of faces; under one the operators are the modeller's

    @property
    def name(self) -> str:
        """For the line of progress."""
        return f"{self.agent} on {Path(self.target).stem}, w_sc {self.w_sc:g}"


@dataclass(frozen=True)
class Found:
    """What came of a case, scored at the target's own resolution."""

    total: float  # r_all
    iou: float
    complexity: int
    self_intersections: int
    n_refits: int
    wall_seconds: float
    stopped_by: str


Results = dict[Case, Found]


def with_options(case: Case, **options: Any) -> Case:
    """The case with options of its agent."""
    return Case(**{**asdict(case), "options": json.dumps(options, sort_keys=True)})


def made(kind: str, n: int) -> list[str]:
    """The first n test targets of a kind."""
    return [f"{kind}:{index}" for index in range(n)]


def target_of(name: str) -> Silhouette:
    """The silhouette of a case's target."""
    kind, _, seed = name.partition(":")
    if kind in _MADE:
        return make_targets(kind).sample(split_seed("test", int(seed)))
    return load_silhouette(name)


def simulator_of(case: Case) -> Simulator:
    """The rules of a case: preset `full`, or `modeller` under a rule of faces, at 128 x 128."""
    return Simulator(
        target_of(case.target),
        operators="full" if case.faces == "any" else "modeller",
        resolution=RESOLUTION,
        weights=ScoreWeights(w_sc=case.w_sc),
        faces=face_rule(case.faces),
    )


def measure(case: Case) -> Found:
    """Solve a case; a warm-up comes before the first of a process. Raises KeyboardInterrupt, agents do not."""
    _warm_up()
    simulator, budget, options = simulator_of(case), Budget(case.refits, case.seconds), json.loads(case.options)
    began = time.perf_counter()
    solve = _SOLVERS.get(case.agent, _solve_with(case.agent))
    solution, n_refits = solve(simulator, budget, options)
    score, seconds = solution.score, time.perf_counter() - began
    if solution.stats.stopped_by == "interrupted":
        raise KeyboardInterrupt
    return Found(
        score.total,
        score.iou,
        score.complexity,
        score.self_intersections,
        n_refits,
        seconds,
        solution.stats.stopped_by,
    )


_Solver = Callable[[Simulator, Budget, dict[str, Any]], tuple[Solution, int]]


def _solve_with(agent: str) -> _Solver:
    def solve(simulator: Simulator, budget: Budget, options: dict[str, Any]) -> tuple[Solution, int]:
        solution = make_agent(agent, **options).solve(simulator, budget)
        return solution, solution.stats.n_refits

    return solve


def best_of_plays(simulator: Simulator, budget: Budget, options: dict[str, Any]) -> tuple[Solution, int]:
    """The best of as many random plays as fit into a budget of refits, the last cut short; and the refits of all."""
    assert budget.refits is not None
    plays: list[Solution] = []
    n_refits = 0
    while not plays or n_refits < budget.refits:
        agent = make_agent("random", seed=len(plays), **options)
        plays.append(agent.solve(simulator, Budget(budget.refits - n_refits)))
        n_refits += max(1, plays[-1].stats.n_refits)
    return max(plays, key=lambda play: play.score.total), n_refits


_SOLVERS: dict[str, _Solver] = {"random": best_of_plays, "foretold": solve_foretold}


@cache
def _warm_up() -> None:
    simulator = Simulator(target_of("construction:0"), resolution=RESOLUTION)
    for agent in ("mcts", "beam"):
        make_agent(agent).solve(simulator, _WARM_UP)


class Records:
    """A file of records. A line that is no record, such as one that was cut off, is left out."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.results: Results = dict(self._read())

    def forget(self) -> None:
        """Begin anew."""
        self.results.clear()
        self.path.unlink(missing_ok=True)

    def complete(
        self, cases: Iterable[Case], n_workers: int, on_done: Callable[[Case, str], None] = lambda case, error: None
    ) -> Results:
        """The results of the cases; those that are missing are measured, each written down as it comes.

        One that fails is left out; `on_done` is told about each, and what was wrong with it.
        """
        cases = list(dict.fromkeys(cases))
        missing = [case for case in cases if case not in self.results]
        engine, workers = ("serial", None) if n_workers == 1 else ("process", n_workers)
        for done in map_tasks(measure, missing, engine=engine, n_workers=workers):
            if done.value is not None:
                self._add(done.task, done.value)
            on_done(done.task, done.error or "")
        return {case: self.results[case] for case in cases if case in self.results}

    def _add(self, case: Case, found: Found) -> None:
        self.results[case] = found
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            if not _ends_in_a_line(self.path):
                write_atomically(self.path, "".join(f"{line}\n" for line in self._lines()))
                return
            with self.path.open("a", encoding="utf-8") as stream:
                stream.write(_line(case, found) + "\n")
        except OSError as error:
            raise OutputError(f"cannot write {self.path} ({error.strerror}); give another --records") from None

    def _lines(self) -> Iterator[str]:
        return (_line(case, found) for case, found in self.results.items())

    def _read(self) -> Iterator[tuple[Case, Found]]:
        try:
            lines: Sequence[str] = self.path.read_text(encoding="utf-8").splitlines()
        except FileNotFoundError:
            return
        except (OSError, UnicodeDecodeError) as error:
            reason = error.strerror if isinstance(error, OSError) else "not UTF-8 text"
            raise OutputError(f"cannot read {self.path} ({reason}); give another --records") from None
        for line in lines:
            try:
                record = json.loads(line)
                yield Case(**record["case"]), Found(**record["found"])
            except (ValueError, TypeError, KeyError):
                continue


def _line(case: Case, found: Found) -> str:
    return json.dumps({"case": asdict(case), "found": asdict(found)})


def _ends_in_a_line(path: Path) -> bool:
    """Whether a line can be appended."""
    if not path.exists() or path.stat().st_size == 0:
        return True
    with path.open("rb") as stream:
        stream.seek(-1, 2)
        return stream.read(1) == b"\n"
