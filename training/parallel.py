"""`map_tasks`: the one seam between work and machines: this process, a pool of processes, or a Ray cluster.

Results come as they are done. They do not depend on the engine or on the number of workers as long as the function's
result depends on its task only; a task that needs random numbers carries its seed.
"""

import contextlib
import heapq
import itertools
import multiprocessing
import os
import pickle
import re
import signal
import subprocess
import sys
import threading
import time
import traceback
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, Generic, TypeVar

from autopoly_env.errors import AutoPolyError, ConfigError
from autopoly_env.shown import told
from autopoly_env.workers import how_it_died, no_interrupts

Task = TypeVar("Task")
Value = TypeVar("Value")

ENGINES = ("serial", "process", "ray")
N_TRIES = 2  # of a task whose worker dies
RAY_PATIENCE = 12.0  # seconds to wait for a cluster's answer
RAY_AHEAD = 8  # tasks a CPU that Ray is given ahead, so that no CPU waits for us
N_LOSSES = 30  # of one task's workers to the system (a node that dies, memory that runs out), before it is given up
RAY_PAUSE = 1.0  # seconds more before each next try of a task that was lost, as memory comes back slowly
MOST_PAUSE = 15.0  # seconds
# One thread a worker: as many workers as cores, each with a pool of its own, get in each other's way.
ONE_THREAD = dict.fromkeys(
    ("AUTOPOLY_THREADS", "NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"
)


@dataclass(frozen=True)
class Done(Generic[Task, Value]):
    """A task that is over."""

    task: Task
    value: Value | None
    error: str | None  # one line: what the function raised, or how its worker died; None if there is a value


@dataclass(frozen=True)
class _Job(Generic[Task]):
    """A task on its way."""

    task: Task
    n_deaths: int = 0  # of workers that had it
    n_losses: int = 0  # of workers that had it and were lost to the system, which is no fault of the task


def map_tasks(
    function: Callable[[Task], Value],
    tasks: Iterable[Task],
    *,
    engine: str = "process",
    n_workers: int | None = None,
    address: str | None = None,
    on_start: Callable[[Task], None] | None = None,
) -> Generator[Done[Task, Value], None, None]:
    """Apply `function` to all tasks; yield each as it is done, in any order.

    `tasks` is read only as fast as workers take them. What the function raises becomes the `error` of its task; a task
    whose worker dies is tried once more, then it fails, too; the others go on. What Ray loses for reasons of its own
    (a node that dies, memory that runs out) is tried again until it is done. `on_start` is called with every task that
    a worker is given. Closing the iterator stops the workers.

    engine: "serial", in this process; "process", `n_workers` processes (default: as many as cores), one thread each;
    "ray", a Ray cluster at `address` ("auto", "host:port"), or one started here with `n_workers` CPUs. Functions and
    tasks travel by pickle: the function must be importable in a worker. Raises ConfigError for settings out of range
    and where no cluster answers.
    """
    check_engine(engine, n_workers, address)
    begun = on_start or _ignore
    if engine == "serial":
        return _serial(function, tasks, begun)
    if engine == "process":
        return _processes(function, tasks, n_workers or n_cores(), begun)
    return _ray(function, tasks, _connect_ray(address, n_workers), begun)


def check_engine(engine: str, n_workers: int | None, address: str | None) -> None:
    """Raise ConfigError for what no engine can be."""
    if engine not in ENGINES:
        raise ConfigError(f"engine {engine!r} is unknown; give one of {', '.join(ENGINES)}")
    if n_workers is not None and n_workers < 1:
        raise ConfigError(f"{n_workers} workers: expected at least 1")
    if address is not None and engine != "ray":
        raise ConfigError(f"a Ray address is of no use to the engine {engine!r}; give the engine ray, too")


def n_cores() -> int:
    """The cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def one_line(error: BaseException) -> str:
    """What an exception says, in one line; with its type and place if it is not one raised on purpose."""
    if isinstance(error, AutoPolyError):
        return str(error)
    frames = traceback.extract_tb(error.__traceback__)
    place = f" (in {Path(frames[-1].filename).name} line {frames[-1].lineno})" if frames else ""
    return told(f"{type(error).__name__}: {error}{place}")


def _ignore(_: object) -> None:
    """Whoever gives no `on_start` does not care."""


def _attempt(function: Callable[[Task], Value], task: Task) -> tuple[Value | None, str | None]:
    """The function's value, or what it raised."""
    try:
        return function(task), None
    except Exception as error:  # whatever it is, the other tasks can be done
        return None, one_line(error)


def _after_death(job: _Job[Task], reason: str) -> tuple[_Job[Task], Done[Task, Any] | None]:
    """The job to try again, or its end if that was done before."""
    job = replace(job, n_deaths=job.n_deaths + 1)
    if job.n_deaths < N_TRIES:
        return job, None
    return job, Done(job.task, None, f"its worker died {job.n_deaths} times ({reason})")


def _after_loss(job: _Job[Task], reason: str) -> tuple[_Job[Task], Done[Task, Any] | None]:
    """The job to try again, or its end where it has been lost far too often."""
    job = replace(job, n_losses=job.n_losses + 1)
    if job.n_losses < N_LOSSES:
        return job, None
    return job, Done(job.task, None, f"its worker was lost to the system {job.n_losses} times ({reason})")


def _serial(
    function: Callable[[Task], Value], tasks: Iterable[Task], begun: Callable[[Task], None]
) -> Generator[Done[Task, Value], None, None]:
    for task in tasks:
        begun(task)
        yield Done(task, *_attempt(function, task))


# A pool of processes. Each has a pipe and one task at a time, so that it is known whose task a dead one had, nothing
# piles up, and no two ends of a pipe wait for each other to read.


def _processes(
    function: Callable[[Task], Value], tasks: Iterable[Task], n_workers: int, begun: Callable[[Task], None]
) -> Generator[Done[Task, Value], None, None]:
    jobs = (_Job(task) for task in tasks)
    again: list[_Job[Task]] = []
    busy: dict[Connection, tuple[_Worker, _Job[Task]]] = {}

    def employ(worker: _Worker | None) -> None:
        """Give a worker (a new one for None) the next task, or let it go if there is none."""
        job = again.pop() if again else next(jobs, None)
        if job is None:
            if worker is not None:
                worker.stop()
            return
        worker = worker or _Worker(function)
        busy[worker.pipe] = worker, job
        begun(job.task)
        worker.begin(job.task)

    try:
        for _ in range(n_workers):
            employ(None)
        while busy:
            for pipe in wait(list(busy)):
                worker, job = busy.pop(pipe)  # type: ignore[call-overload]
                done: Done[Task, Value] | None
                try:
                    done = Done(job.task, *worker.result())
                except (EOFError, OSError):
                    job, done = _after_death(job, worker.how_it_died())
                    worker = None
                    if done is None:
                        again.append(job)
                employ(worker)
                if done is not None:
                    yield done
    finally:
        for worker, _ in busy.values():
            worker.stop()


class _Worker:
    """A process that applies a function to what comes through its pipe."""

    def __init__(self, function: Callable[[Any], Any]) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, end = context.Pipe()
        self._process = context.Process(target=_work, args=(end, function), daemon=True)
        with _environment(ONE_THREAD), no_interrupts():
            self._process.start()
        end.close()

    def begin(self, task: Any) -> None:
        """Hand over a task; if the worker is dead, `result` tells."""
        with contextlib.suppress(BrokenPipeError, ConnectionResetError):
            self.pipe.send(task)

    def result(self) -> Any:
        """The value and the error of its task. Raises EOFError or OSError if it has died."""
        return self.pipe.recv()

    def stop(self) -> None:
        """End it, whatever it is doing."""
        self.pipe.close()
        self._process.kill()
        self._process.join()

    def how_it_died(self) -> str:
        """Its signal or exit code, once its pipe is broken."""
        self.pipe.close()
        return how_it_died(self._process)


def _work(pipe: Connection, function: Callable[[Any], Any]) -> None:
    """What a worker does until its pipe is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_die_with_parent, daemon=True).start()
    with contextlib.suppress(EOFError, OSError):  # the parent wants no more, or is gone
        while True:
            result = _attempt(function, pipe.recv())
            try:
                pipe.send(result)
            except (pickle.PicklingError, TypeError, AttributeError) as error:
                pipe.send((None, f"the result cannot be sent: {one_line(error)}"))


def _die_with_parent() -> None:
    """Leave no worker behind when the parent is killed in the middle of a task."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


@contextmanager
def _environment(variables: dict[str, str]) -> Iterator[None]:
    """Environment variables for the processes that are started within."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


# Ray


def _connect_ray(address: str | None, n_workers: int | None) -> int:
    """Connect to the cluster at an address, or start one here; how many tasks to have under way.

    Raises ConfigError where that does not work.
    """
    try:
        import ray
    except ImportError:
        raise ConfigError("the engine ray needs Ray; pip install -e '.[cluster]'") from None
    if ray.is_initialized():
        raise ConfigError("this process is connected to a Ray cluster already; call ray.shutdown() before")
    options: dict[str, Any] = {
        "logging_level": "ERROR",
        "log_to_driver": False,
        "runtime_env": {"env_vars": ONE_THREAD},
    }
    if address is not None:
        _check_ray(address)
        ray.init(address, **options)
        return n_workers or RAY_AHEAD * max(1, int(ray.cluster_resources().get("CPU", 1)))
    n_cpus = n_workers or n_cores()
    with _environment({"RAY_USAGE_STATS_ENABLED": "0"}):
        ray.init("local", num_cpus=n_cpus, include_dashboard=False, **options)
    return RAY_AHEAD * n_cpus


def _check_ray(address: str) -> None:
    """See that a cluster answers, in a process that can be ended: `ray.init` itself waits for minutes, then exits."""
    probe = [sys.executable, "-c", "import sys, ray; ray.init(sys.argv[1], log_to_driver=False)", address]
    try:
        answer = subprocess.run(probe, capture_output=True, text=True, timeout=RAY_PATIENCE)
        if not answer.returncode:
            return
        said, reason = answer.stderr, answer.stderr.strip().splitlines()[-1]
    except subprocess.TimeoutExpired as late:  # what it says is bytes, whatever `text` was
        said, reason = (late.stderr or b"").decode(errors="replace"), f"nothing within {RAY_PATIENCE:g} seconds"
    raise ConfigError(_why_no_ray(address, said, reason))


def _why_no_ray(address: str, said: str, reason: str) -> str:
    """What keeps us from the cluster at an address, and what to do, from what Ray `said` and the last of it."""
    if "InvalidAuthToken" in said or "AuthenticationError" in said:
        return (
            f"the Ray cluster at {address!r} wants another token: start it, its nodes and this command with the same "
            "~/.ray/auth_token or RAY_AUTH_TOKEN and RAY_AUTH_MODE=token, or all of them with RAY_AUTH_MODE=disabled"
        )
    versions = re.findall(r"(?:Ray|Python): ([\w.+]+)", said) if "Version mismatch" in said else []
    if versions:
        theirs, ours = (f"Ray {ray} and Python {python}" for ray, python in (versions[:2], versions[-2:]))
        return f"the Ray cluster at {address!r} runs {theirs}, this process {ours}: install the same on both"
    return f"no Ray cluster answers at {address!r} ({reason}); start one with `ray start --head`"


def _ray(
    function: Callable[[Task], Value],
    tasks: Iterable[Task],
    n_under_way: int,
    begun: Callable[[Task], None],
) -> Generator[Done[Task, Value], None, None]:
    import ray

    attempt: Any = ray.remote(max_retries=0)(_attempt)
    sent = ray.put(function)
    jobs = (_Job(task) for task in tasks)
    running: dict[Any, _Job[Task]] = {}
    lost: list[tuple[float, int, _Job[Task]]] = []  # when to try again, a number that no two have, what
    numbers = itertools.count()

    def submit(job: _Job[Task] | None) -> None:
        if job is not None:
            begun(job.task)
            running[attempt.remote(sent, job.task)] = job

    try:
        for _ in range(n_under_way):
            submit(next(jobs, None))
        while running or lost:
            while lost and lost[0][0] <= time.monotonic():
                submit(heapq.heappop(lost)[2])
            ready, _ = ray.wait(list(running), timeout=_until(lost)) if running else _slept(lost)
            for reference in ready:
                job = running.pop(reference)
                done: Done[Task, Value] | None
                try:
                    done = Done(job.task, *ray.get(reference))
                except (ray.exceptions.WorkerCrashedError, ray.exceptions.RayTaskError) as error:
                    job, done = _after_death(job, type(error).__name__)
                    if done is None:
                        submit(job)
                except ray.exceptions.RayError as error:
                    job, done = _after_loss(job, type(error).__name__)
                    if done is None:
                        heapq.heappush(lost, (time.monotonic() + _pause(job), next(numbers), job))
                if done is not None:
                    submit(next(jobs, None))
                    yield done
    finally:
        ray.shutdown()


def _pause(job: _Job[Any]) -> float:
    """Seconds until a lost task is tried again: none after its first loss, then more and more."""
    return min(MOST_PAUSE, RAY_PAUSE * (job.n_losses - 1))


def _until(lost: Sequence[tuple[float, int, Any]]) -> float | None:
    """Seconds until the first of the lost tasks is due, None where there is none."""
    return max(0.0, lost[0][0] - time.monotonic()) if lost else None


def _slept(lost: Sequence[tuple[float, int, Any]]) -> tuple[list[Any], list[Any]]:
    """Nothing, once the first of the lost tasks is due."""
    time.sleep(_until(lost) or 0.0)
    return [], []
