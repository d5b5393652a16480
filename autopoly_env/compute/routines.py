"""Routines: work that pauses where heavy jobs are due, so that the jobs of many routines can be done at once.

A routine is a generator. It yields lists of jobs, calls without arguments that spend their time in kernels; it is sent
the lists of their results, and returns what it was made for. Alone it has its jobs done on the spot; among others, the
calling thread goes through the routines while all threads do jobs. What comes out is the same.
"""

from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Any, Generic, TypeVar

from autopoly_env.compute.parallel import checked, map_threads, n_threads

_Result = TypeVar("_Result")
Job = Callable[[], Any]
Routine = Generator[Sequence[Job], list[Any], _Result]


def run(routine: Routine[_Result]) -> _Result:
    """What the routine returns, its jobs done here and now."""
    try:
        jobs = next(routine)
        while True:
            jobs = routine.send([checked(job) for job in jobs])
    except StopIteration as end:
        result: _Result = end.value
        return result


def run_all(routines: Iterable[Routine[_Result]]) -> list[_Result]:
    """What each of the routines returns, their jobs done on all threads.

    Only the calling thread runs the routines themselves. While none of them can go on, it does jobs, too.
    """
    if n_threads() == 1:
        return [run(routine) for routine in routines]
    crew = _Crew(list(routines))
    map_threads(lambda work: work(), crew.work_of_the_others())
    return crew.results


class _Errand:
    """The jobs that one routine waits for, and their results as they come in."""

    def __init__(self, routine: Routine[Any], place: int, jobs: Sequence[Job]) -> None:
        self.routine = routine
        self.place = place  # of the routine among all
        self.results: list[Any] = [None] * len(jobs)
        self.n_missing = len(jobs)


@dataclass
class _Task:
    """One job of an errand; `result` or `error` once it is done."""

    errand: _Errand
    number: int
    job: Job
    result: Any = None
    error: BaseException | None = None


class _Crew(Generic[_Result]):
    """The routines, the tasks that nobody has begun, and those that are done."""

    def __init__(self, routines: list[Routine[_Result]]) -> None:
        self._routines = routines
        self.results: list[Any] = [None] * len(routines)
        self._n_running = len(routines)
        self._tasks: SimpleQueue[_Task | None] = SimpleQueue()
        self._done: SimpleQueue[_Task] = SimpleQueue()

    def work_of_the_others(self) -> Iterator[Callable[[], None]]:
        """What each other thread is to do; after that, the calling thread's own work."""
        n_others = n_threads() - 1
        for _ in range(n_others):
            yield self._help
        try:
            self._lead()
        finally:
            for _ in range(n_others):
                self._tasks.put(None)

    def _lead(self) -> None:
        """Run every routine from pause to pause until all have returned."""
        for place, routine in enumerate(self._routines):
            self._go_on(place, routine, None)
        while self._n_running:
            task = self._next_done()
            if task.error is not None:
                raise task.error
            errand = task.errand
            errand.results[task.number] = task.result
            errand.n_missing -= 1
            if errand.n_missing == 0:
                self._go_on(errand.place, errand.routine, errand.results)

    def _go_on(self, place: int, routine: Routine[_Result], results: Any) -> None:
        """Run a routine to its next pause and hand out its jobs."""
        try:
            jobs = routine.send(results)
            while not jobs:
                jobs = routine.send([])
        except StopIteration as end:
            self.results[place] = end.value
            self._n_running -= 1
            return
        errand = _Errand(routine, place, jobs)
        for number, job in enumerate(jobs):
            self._tasks.put(_Task(errand, number, job))

    def _next_done(self) -> _Task:
        """A task that is done. While there is none, do one oneself."""
        while True:
            try:
                return self._done.get_nowait()
            except Empty:
                pass
            try:
                task = self._tasks.get_nowait()
            except Empty:
                return self._done.get()
            if task is not None:
                self._do(task)

    def _help(self) -> None:
        while (task := self._tasks.get()) is not None:
            self._do(task)

    def _do(self, task: _Task) -> None:
        try:
            task.result = checked(task.job)
        except BaseException as error:
            task.error = error
        self._done.put(task)
