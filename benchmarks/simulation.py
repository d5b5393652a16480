"""Rows about the simulator: what a second thread brings."""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from autopoly_env.compute import set_threads
from autopoly_env.silhouette import load_silhouette
from autopoly_env.simulator import Simulator, State
from benchmarks.report import Must, Row, not_measured
from benchmarks.timing import median_seconds

TWO_THREADS = Must(">=", 1.6)
_N_SHAPES = 4
_DEPTH = 5  # greedy steps down to the node whose children are made


def thread_rows(images: Sequence[Path]) -> Iterator[Row]:
    """`transition_all` at a node some greedy steps deep, on one thread and on two; time of all shapes together."""
    name = "transition_all, 2 threads"
    if (os.cpu_count() or 1) < 2:
        yield not_measured(name, "this machine has one core")
        return
    simulators = [Simulator(load_silhouette(path), operators="full", resolution=128) for path in images[:_N_SHAPES]]
    nodes = [(simulator, _descend(simulator)) for simulator in simulators]

    def expand(threads: int) -> int:
        set_threads(threads)
        return sum(len(simulator.transition_all(state)) for simulator, state in nodes)

    try:
        n_children = expand(1)
        one, two = median_seconds(lambda: expand(1), lambda: expand(2), rounds=15)
    finally:
        set_threads(None)
    note = f"against 1 thread; {n_children} children of {len(nodes)} nodes"
    yield Row(name, two, one, one / two, TWO_THREADS, "s", note)


def _descend(simulator: Simulator) -> State:
    state = simulator.initial()
    for _ in range(_DEPTH):
        state = max([state, *simulator.transition_all(state)], key=lambda child: child.score.total)
    return state
