"""The process that searches: one task after the other, its news sent to the server, orders heeded at once.

Server and worker are two ends of a pipe between processes of our own; nothing that a page sends goes through it but
what the server has read and checked. A thread listens to orders, so that they are known while the main thread searches:

- `pause` and `go`: the search stands still between two of its steps, and its seconds do, too;
- `stop`: as Ctrl-C of `agents.solve`; the best so far is finished and sent;
- `drop`: the search is given up before its next refit, for another one waits.
"""

import os
import queue
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from agents.budget import CLOCK, Budget, Progress
from agents.commands.solving import solve_frame, solve_picture
from agents.retell.retargeting import Retargeted, retarget, simulator_of
from agents.studio.choices import Choices, Task
from agents.studio.shapes import plain_mesh
from autopoly_env.compute import set_check
from autopoly_env.errors import AutoPolyError
from autopoly_env.mesh import PolyMesh
from autopoly_env.outside import described
from autopoly_env.score import ScoreWeights, score
from autopoly_env.silhouette import Silhouette

EVERY = 0.17  # seconds between two reports of a search, on average
RETARGET_REFITS = 300  # as `agents.retarget` by default
MOST_POINTS = 120  # of a curve


class DroppedError(BaseException):
    """The task is given up. Not an Exception: nobody between here and the task's beginning is to handle it."""


class Orders:
    """What the server wants, as a thread hears it."""

    def __init__(self, pipe: Connection) -> None:
        self._pipe = pipe
        self._tasks: queue.SimpleQueue[tuple[int, Task]] = queue.SimpleQueue()
        self._go = threading.Event()
        self._running = 0  # the number of the task in work, 0 between two
        self._dropped = self._stopped = 0  # the last task that is given up, or to be finished
        self._go.set()
        set_check(self.heed_drop)
        signal.signal(signal.SIGINT, lambda *_: None)  # Ctrl-C on the terminal is for the server
        threading.Thread(target=self._listen, daemon=True).start()

    def next_task(self) -> tuple[int, Task]:
        """The next task and its number, as soon as there is one; those that were given up meanwhile are passed over."""
        while True:
            number, task = self._tasks.get()
            if number > self._dropped:
                return number, task

    @contextmanager
    def working(self, number: int) -> Iterator[None]:
        """The task is in work. Raises DroppedError in it as soon as it is given up."""
        self._running = number
        try:
            self.heed()
            yield
            self.heed_drop()
        finally:
            self._running = 0

    def heed(self) -> None:
        """Stand still while paused; raise what ends the task in work."""
        if not self._go.is_set():
            with CLOCK.standing():
                self._go.wait()
        self.heed_drop()
        if self._stopped >= self._running:
            raise KeyboardInterrupt

    def heed_drop(self) -> None:
        """Called before every refit, in its thread: raise DroppedError where the task in work is given up."""
        if 0 < self._running <= self._dropped:
            raise DroppedError

    def _listen(self) -> None:
        while True:
            try:
                word, number, task = self._pipe.recv()
            except (EOFError, OSError):  # the server is gone
                os._exit(0)
            if word == "task":
                self._go.set()
                self._tasks.put((number, task))
            elif word == "pause":
                self._go.clear()
            else:
                if word == "drop":
                    self._dropped = max(self._dropped, number)
                elif word == "stop":
                    self._stopped = max(self._stopped, number)
                self._go.set()


def main(pipe: Connection) -> None:
    """Warm the kernels, then do one task after the other until the server is gone."""
    orders = Orders(pipe)
    _warm_up()
    pipe.send(("ready", 0, None))
    while True:
        number, task = orders.next_task()
        with suppress(DroppedError):
            kind, news = "failed", None
            try:
                with orders.working(number):
                    kind, news = "done", _done(task, number, orders, pipe)
            except AutoPolyError as error:
                news = {"problem": str(error)}
            except KeyboardInterrupt:
                news = {"problem": "stopped before anything was found"}
            except Exception as error:  # whatever it is, the next task can be done
                news = {"problem": described(error)}
            pipe.send((kind, number, news))
        pipe.send(("idle", number, None))


def _warm_up() -> None:
    """Whatever goes wrong here will go wrong again, and be told, with the first task."""
    empty = Silhouette(np.ones((8, 8), np.bool_))
    with suppress(Exception):
        for style in ("modeller", "paper"):
            solve_frame(Task(empty, choices=Choices(style, refits=40)).settings())


def _done(task: Task, number: int, orders: Orders, pipe: Connection) -> dict[str, Any]:
    """What a task comes to."""
    watch = Watch(task, number, orders, pipe)
    if task.steps is not None:
        simulator = simulator_of(task.steps, task.silhouette)
        done = retarget(simulator, task.steps, Budget(refits=RETARGET_REFITS), watch.report)
        solution, sequence, notes = done.solution, done.told, [_words_of(done)]
    else:
        settings = task.settings()
        settings.check()
        found = solve_picture(task.silhouette, settings, watch.report)
        solution, sequence, notes = found.solution, found.solution.sequence, list(found.notes)
    stats = solution.stats
    return {
        "sequence": sequence.to_json(),
        "notes": notes,
        "refits": stats.n_refits,
        "seconds": round(stats.seconds, 2),
        "stopped_by": stats.stopped_by,
    }


def _words_of(done: Retargeted) -> str:
    """What has become of the steps."""
    kept = f"steps: {done.n_kept} kept, {done.n_dropped} dropped, {done.n_added} added"
    return f"{kept}; the start is a detail here, no body as it was" if done.begins_elsewhere else kept


class Watch:
    """Tells the server where a search stands, now and then."""

    def __init__(self, task: Task, number: int, orders: Orders, pipe: Connection) -> None:
        self._task, self._number, self._orders, self._pipe = task, number, orders, pipe
        self._began, self._due = CLOCK.seconds(), 0.0
        self._curve: list[list[float]] = []
        self._best: dict[str, Any] = {}
        self._shown: object = None

    def report(self, progress: Progress) -> None:
        """Called after every step of the search, in its thread."""
        self._orders.heed()
        now = time.monotonic()
        if now < self._due or progress.best is None:
            return
        self._due = max(self._due + EVERY, now)
        if progress.best is not self._shown:
            self._shown = progress.best
            self._best = self._scored(progress.best())
        self._add_point(progress)
        news = {
            **self._best,
            "best": round(progress.best_total, 3),
            "refits": progress.n_refits,
            "tries": progress.n_steps,
            "seconds": round(CLOCK.seconds() - self._began, 2),
            "curve": self._curve,
            "tried": None if progress.tried is None else _outline_of(progress.tried()),
        }
        self._pipe.send(("progress", self._number, news))

    def _scored(self, mesh: PolyMesh) -> dict[str, Any]:
        """The mesh and what it is worth, as far as its faces are known."""
        target = self._task.silhouette.target(min(self._task.silhouette.resolution, 256))
        worth = score(mesh, target, ScoreWeights(w_sc=self._task.choices.w_sc))
        return {"mesh": plain_mesh(mesh), "iou": round(worth.iou, 4), "crossings": worth.self_intersections}

    def _add_point(self, progress: Progress) -> None:
        self._curve.append([progress.n_refits, round(progress.best_total, 3)])
        if len(self._curve) > MOST_POINTS:
            self._curve = self._curve[::2]


def _outline_of(mesh: PolyMesh) -> list[list[list[float]]]:
    """The boundary of a mesh as rings of places."""
    return [
        [[round(x, 4), round(y, 4)] for x, y in mesh.vertices[loop].tolist()] for loop in mesh.topology.boundary_loops
    ]
