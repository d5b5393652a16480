"""What Ray does to a suite of tasks: `python -m benchmarks.ray_cluster losses` or `many`.

    python -m benchmarks.ray_cluster losses   # a raylet is killed while tasks run, ten times, twice short of memory
    python -m benchmarks.ray_cluster many     # 100,000 tiny tasks: overhead of each, memory of the driver

`losses` starts a head and a node, each a raylet in a process of its own on this machine, and compares what comes out
with what one process makes. The memory that it takes away is bounded, and held for seconds. Exit codes: 0 nothing was
lost, 1 something was.
"""

import argparse
import hashlib
import os
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from training.parallel import Done, map_tasks

N_ROUNDS, N_TASKS = 10, 200
SHORT_OF_MEMORY = (3, 7)  # rounds
ROOM, BALLAST = 3 << 30, 4 << 30  # bytes: above what is used that Ray kills from, and that are taken away
SECONDS = 4.0  # for which they are
N_MANY = 100_000


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.ray_cluster", description=__doc__)
    parser.add_argument("what", choices=("losses", "many"))
    parser.add_argument("--n", type=int, default=N_MANY, help="tasks of `many`")
    parser.add_argument("--workers", type=int, default=2, help="of `many`")
    given = parser.parse_args(arguments)
    return losses() if given.what == "losses" else many(given.n, given.workers)


def slow(seed: int) -> str:
    """A result that depends on the seed alone, after a while."""
    time.sleep(0.1)
    return hashlib.sha256(str(seed).encode()).hexdigest()


def tiny(seed: int) -> int:
    """Next to nothing."""
    return seed * seed


def losses() -> int:
    """Kill the node of a cluster of two in every round, and start another one."""
    total, used = _memory()
    limit = {"RAY_memory_usage_threshold": f"{(used + ROOM) / total:.4f}", "RAY_memory_monitor_refresh_ms": "100"}
    os.environ.update(limit)
    from ray.cluster_utils import Cluster

    expected = {seed: (slow(seed), None) for seed in range(N_TASKS)}
    cluster: Any = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    n_wrong = 0
    try:
        for number in range(N_ROUNDS):
            node = cluster.add_node(num_cpus=1)
            is_short = number in SHORT_OF_MEMORY
            began, found = time.monotonic(), {}
            for done in map_tasks(slow, range(N_TASKS), engine="ray", address=cluster.address):
                found[done.task] = (done.value, done.error)
                if len(found) == N_TASKS // 4:
                    threading.Thread(target=_take_away, args=(node, is_short)).start()
            wrong = {seed: found.get(seed) for seed in expected if found.get(seed) != expected[seed]}
            n_wrong += len(wrong)
            short = ", short of memory" if is_short else ""
            print(
                f"round {number}{short}: {len(wrong)} of {N_TASKS} differ, {time.monotonic() - began:.1f} s", flush=True
            )
            for problem in list(wrong.items())[:3]:
                print(f"  {problem}", flush=True)
            cluster.remove_node(node)
    finally:
        cluster.shutdown()
    return 1 if n_wrong else 0


def _take_away(node: Any, is_short: bool) -> None:
    """The raylet, and the memory for a while."""
    node.kill_raylet()
    if is_short:
        hold = f"import time; held = b'x' * {BALLAST}; time.sleep({SECONDS})"
        subprocess.run([sys.executable, "-c", hold], check=False)


def many(n: int, n_workers: int) -> int:
    """Tiny tasks on a cluster started here."""
    began, n_done, n_failed = time.monotonic(), 0, 0
    stream = map_tasks(tiny, range(n), engine="ray", n_workers=n_workers)
    done: Done[int, int]
    for done in stream:
        n_done += 1
        n_failed += done.value != done.task * done.task
        if n_done in (1, 100, 1000) or n_done % (n // 10) == 0:
            each = (time.monotonic() - began) / n_done
            print(f"{n_done:>7,} tasks: {1000 * each:.2f} ms each, driver {_resident() / 1e6:.1f} MB", flush=True)
    return 1 if n_failed or n_done != n else 0


def _memory() -> tuple[int, int]:
    """Bytes that the machine has, and that are in use."""
    lines = (line.split() for line in Path("/proc/meminfo").read_text().splitlines())
    known = {name: int(kilobytes) * 1024 for name, kilobytes, *_ in lines}
    return known["MemTotal:"], known["MemTotal:"] - known["MemAvailable:"]


def _resident() -> int:
    """Bytes of this process in memory."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


if __name__ == "__main__":
    sys.exit(main())
