"""`Worker`: the server's handle of a process that searches; it is started when it is needed, and again if it dies."""

import asyncio
import multiprocessing
import queue
import threading
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

from agents.studio.choices import Task

PATIENCE = 4.0  # seconds until a worker that was told to drop its task, and does not, is ended

Deliver = Callable[["Worker", str, int, Any], None]  # a worker's kind of news, the number of the task, the news


class Worker:
    """One process. All methods are for the thread of the event loop, in which `deliver` is called, too."""

    def __init__(self, deliver: Deliver) -> None:
        self._deliver = deliver
        self._loop = asyncio.get_running_loop()
        self._process: Any = None
        self._orders: queue.SimpleQueue[tuple[str, int, Task | None] | None] = queue.SimpleQueue()
        self._n_tasks = 0
        self.is_ready = False
        self.task = 0  # the number of the task in work; 0: idle
        self.is_paused = False

    def start(self) -> None:
        """Start the process, if there is none: it takes a second or two until it is ready."""
        if self._process is not None:
            return
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        self._process = context.Process(target=_run, args=(theirs,), daemon=True, name="autopoly-studio-search")
        self._process.start()
        theirs.close()
        self._orders = queue.SimpleQueue()
        process, orders = self._process, self._orders
        threading.Thread(target=self._hear, args=(ours, process), daemon=True).start()
        threading.Thread(target=_tell, args=(ours, orders), daemon=True).start()

    def work(self, task: Task) -> int:
        """Begin a task; the number under which its news come. The worker has to be idle."""
        assert self.task == 0
        self.start()
        self._n_tasks += 1
        self.task, self.is_paused = self._n_tasks, False
        self._orders.put(("task", self.task, task))
        return self.task

    def order(self, word: str) -> None:
        """`pause`, `go`, `stop` or `drop` the task in work, if there is one."""
        if self.task:
            self.is_paused = word == "pause"
            self._orders.put((word, self.task, None))
            if word == "drop":
                self._loop.call_later(PATIENCE, self._end_unless_dropped, self._process, self.task)

    def end(self) -> None:
        """End the process."""
        if self._process is not None:
            self._orders.put(None)
            self._process.kill()

    def _end_unless_dropped(self, process: Any, task: int) -> None:
        if self._process is process and self.task == task:
            process.kill()

    def _hear(self, pipe: Connection, process: Any) -> None:
        """A thread: what the worker says, until it is gone."""
        while True:
            try:
                said = pipe.recv()
            except (EOFError, OSError):
                said = ("gone", 0, None)
            try:
                self._loop.call_soon_threadsafe(self._on_news, process, *said)
            except RuntimeError:  # the loop is closed
                return
            if said[0] == "gone":
                return

    def _on_news(self, process: Any, kind: str, number: int, news: Any) -> None:
        if process is not self._process:
            return
        if kind == "gone":
            number, self.task = self.task, 0
            self._process, self.is_ready = None, False
        elif kind == "ready":
            self.is_ready = True
        elif kind == "idle":
            self.task = 0
        self._deliver(self, kind, number, news)


def _tell(pipe: Connection, orders: "queue.SimpleQueue[tuple[str, int, Task | None] | None]") -> None:
    """A thread: orders to the worker, in their order; a large picture may take a moment to be sent."""
    while (order := orders.get()) is not None:
        try:
            pipe.send(order)
        except OSError:
            return
    pipe.close()


def _run(pipe: Connection) -> None:
    from agents.studio.worker import main  # which takes a while to be imported, and is not needed here

    main(pipe)
