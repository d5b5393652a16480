"""Rows about the agents: what the shapes that they return are worth, and how long they take."""

import csv
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from agents.base import Agent
from agents.budget import Budget
from agents.registry import make_agent
from autopoly_env.arrays import FloatArray
from autopoly_env.score import ScoreWeights
from autopoly_env.silhouette import load_silhouette
from autopoly_env.simulator import Simulator
from benchmarks.report import Must, Record, Row, quantity

AGENTS = ("greedy", "beam", "trace", "decimate", "climb", "mcts")
WEIGHTS = (0.3, 1.0)  # w_sc
NO_DEFECTS = Must("<=", 0.0)
# The floors hold for the silhouettes that they were set on, a folder of this many with a manifest.
_N_WITH_FLOORS = 24
_FLOORS = {
    ("greedy", 0.3): 80.5,
    ("greedy", 1.0): 65.0,
    ("beam", 0.3): 82.5,
    ("trace", 0.3): 82.0,
    ("trace", 1.0): 57.0,
    ("mcts", 0.3): 83.0,
    ("mcts", 1.0): 65.5,
}
_SECONDS = {"greedy": 0.7, "beam": 6.0, "trace": 0.5}


@dataclass(frozen=True)
class Solved:
    """What an agent made of one silhouette."""

    agent: str
    w_sc: float
    target: str
    r_all: float  # at the image's own resolution
    iou: float
    complexity: int
    self_intersections: int
    flipped_faces: int
    seconds: float  # from the loaded silhouette to the solution
    cpu_seconds: float  # of all threads, which tells how much of that was waiting for a busy machine


def agent_rows(images: Sequence[Path]) -> Iterator[Row | Record]:
    """Per agent and weight: mean r_all, seconds a shape and defects; a record for each shape."""
    has_floors = _has_floors(images)
    for name in AGENTS:
        for w_sc in WEIGHTS:
            agent = make_agent(name)
            _solve(agent, name, images[0], w_sc)  # warm up
            solved = []
            for image in images:
                solved.append(_solve(agent, name, image, w_sc))
                yield Record(f"{name}, w_sc {w_sc:g}: {image.stem}", vars(solved[-1]))
            yield from _summary(solved, has_floors)


def _has_floors(images: Sequence[Path]) -> bool:
    manifest = images[0].parent / "manifest.csv"
    if not manifest.is_file():
        return False
    with manifest.open(newline="", encoding="utf-8") as stream:
        return len(list(csv.DictReader(stream))) == _N_WITH_FLOORS


def _solve(agent: Agent, name: str, image: Path, w_sc: float) -> Solved:
    silhouette = load_silhouette(image)  # anew: it would keep what an earlier solve prepared
    began, cpu_began = time.perf_counter(), time.process_time()
    simulator = Simulator(silhouette, operators="full", resolution=128, weights=ScoreWeights(w_sc=w_sc))
    solution = agent.solve(simulator, Budget())
    seconds, cpu_seconds = time.perf_counter() - began, time.process_time() - cpu_began
    score = simulator.final_score(solution.mesh)
    flipped = int((solution.mesh.face_areas() <= 0.0).sum())
    return Solved(
        agent=name,
        w_sc=w_sc,
        target=silhouette.name,
        r_all=score.total,
        iou=score.iou,
        complexity=score.complexity,
        self_intersections=score.self_intersections,
        flipped_faces=flipped,
        seconds=seconds,
        cpu_seconds=cpu_seconds,
    )


def _summary(solved: Sequence[Solved], has_floors: bool) -> Iterator[Row]:
    name, w_sc = solved[0].agent, solved[0].w_sc
    label = f"{name}, w_sc {w_sc:g}"
    totals = np.array([one.r_all for one in solved])
    low, high = _bootstrap(totals)
    floor = _FLOORS.get((name, w_sc))
    note = f"95 %: {low:.1f} to {high:.1f}, {len(solved)} shapes"
    must = Must(">=", floor) if has_floors and floor is not None else None
    yield Row(f"{label}: mean r_all", float(totals.mean()), must=must, note=note)
    seconds = float(np.median([one.seconds for one in solved]))
    cpu = float(np.median([one.cpu_seconds for one in solved]))
    note = f"CPU {quantity(cpu, 's')}, slowest {quantity(max(one.seconds for one in solved), 's')}"
    must = Must("<=", _SECONDS[name]) if has_floors and name in _SECONDS else None
    yield Row(f"{label}: median time", seconds, must=must, unit="s", note=note)
    defects = sum(one.self_intersections + one.flipped_faces for one in solved)
    yield Row(f"{label}: defects", float(defects), must=NO_DEFECTS, note="self-intersections and flipped faces")


def _bootstrap(values: FloatArray, n: int = 10_000) -> tuple[float, float]:
    """95 % interval of the mean: percentiles over resamples of the shapes."""
    rng = np.random.default_rng(0)
    means = rng.choice(values, (n, len(values))).mean(axis=1)
    low, high = np.percentile(means, (2.5, 97.5))
    return float(low), float(high)
