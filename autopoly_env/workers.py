"""`Workers`: processes, each of which has an object of its own; all of them are asked at once."""

import multiprocessing
import multiprocessing.resource_tracker
import pickle
import signal
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from autopoly_env.compute import n_threads, set_threads
from autopoly_env.errors import AutoPolyError, ConfigError, WorkerError
from autopoly_env.outside import described

DYING = 10.0  # seconds that a process may take to end after it has closed its pipe

Request = tuple[str, tuple[Any, ...], dict[str, Any]]  # a method's name and its arguments


class Workers:
    """Processes that share the threads of this one, and end with it.

    `makers` says whose each worker is, and gives the function that makes its object there, called with `inherited`:
    what a process has to be started with, such as shared memory. Ctrl-C goes to this process alone; it ends the
    workers if they are at work. Raises ConfigError for a maker that does not pickle, and what a maker raises.
    """

    def __init__(self, makers: Mapping[str, Callable[..., Any]], inherited: tuple[Any, ...], context: str) -> None:
        given = [_pickled(maker, "settings") for maker in makers.values()]
        self._names = list(makers)
        self._pipes: list[Connection] = []
        self._processes: list[BaseProcess] = []
        self._why_over = ""  # once they have been ended
        threads = max(1, n_threads() // len(makers))
        with self._ended_on_failure():
            with no_interrupts():
                for made in given:
                    self._start(multiprocessing.get_context(context), (made, inherited, threads))
            when = " before it was ready; a script starts workers under `if __name__ == '__main__':` alone"
            self._values({k: self._received(k, when) for k in range(len(given))})

    def ask(self, requests: Sequence[Request | None]) -> list[Any]:
        """What each worker's object returns; None from those who are not asked.

        Raises what one of them raised, once all have answered. Raises ConfigError for what does not pickle, before
        anybody is asked, and WorkerError where a worker has died or all have been ended.
        """
        if self._why_over:
            raise WorkerError(f"{self._why_over}: make new environments")
        pickled = [None if request is None else _pickled(request, "what a worker is asked") for request in requests]
        asked = [k for k, request in enumerate(pickled) if request is not None]
        with self._ended_on_failure():  # later answers would be taken for those to other questions
            for k in asked:
                with suppress(OSError):  # it is dead, as its answer will tell
                    self._pipes[k].send_bytes(pickled[k] or b"")
            answers = {k: self._received(k) for k in asked}
        values = self._values(answers)
        return [values.get(k) for k in range(len(requests))]

    def end(self, why: str) -> None:
        """End them, whatever they are doing; who asks them after that is told why."""
        self._why_over = self._why_over or why
        for pipe in self._pipes:
            pipe.close()
        for process in self._processes:
            process.kill()
        for process in self._processes:
            process.join()

    def _start(self, context: Any, work: tuple[Any, ...]) -> None:
        ours, theirs = context.Pipe()
        self._pipes.append(ours)
        process = context.Process(target=_work, args=(theirs, ours, *work), daemon=True, name="autopoly-worker")
        process.start()
        self._processes.append(process)
        theirs.close()

    @contextmanager
    def _ended_on_failure(self) -> Iterator[None]:
        try:
            yield
        except BaseException as error:
            self.end(str(error) if isinstance(error, WorkerError) else "the worker processes have been interrupted")
            raise

    def _received(self, k: int, when: str = "") -> Any:
        try:
            return self._pipes[k].recv()
        except (EOFError, OSError):
            how = how_it_died(self._processes[k])
            raise WorkerError(f"the worker process of {self._names[k]} has died ({how}){when}") from None

    def _values(self, answers: Mapping[int, Any]) -> dict[int, Any]:
        for k, (is_value, answer) in answers.items():
            if not is_value:
                error, line = answer
                error.add_note(f"in the worker process of {self._names[k]}: {line}")
                raise error
        return {k: value for k, (_, value) in answers.items()}


def how_it_died(process: BaseProcess) -> str:
    """The signal or the exit code of a process whose pipe is broken; it is ended if it has not died."""
    process.join(DYING)
    code = process.exitcode
    process.kill()
    process.join()
    return f"signal {signal.Signals(-code).name}" if code is not None and code < 0 else f"exit code {code}"


@contextmanager
def no_interrupts() -> Iterator[None]:
    """Ctrl-C goes to all processes of a terminal: those that are started within never hear of it, their parent does,
    once they have been started: half a start would be a worker that complains of a torn pipe.
    """
    if not hasattr(signal, "pthread_sigmask"):  # on Windows
        yield
        return
    # The first start of a process starts Python's resource tracker, and that would let interrupts through again.
    multiprocessing.resource_tracker.ensure_running()
    came: list[int] = []
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    # The mask is of this thread alone: where another one takes the signal, Python calls the handler in this one still.
    is_main = threading.current_thread() is threading.main_thread()
    handler = signal.signal(signal.SIGINT, lambda number, frame: came.append(number)) if is_main else None
    try:
        yield
    finally:
        if handler is not None:
            signal.signal(signal.SIGINT, handler)
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        if came:
            signal.raise_signal(signal.SIGINT)


def _work(pipe: Connection, parents: Connection, made: bytes, inherited: tuple[Any, ...], threads: int) -> None:
    """What a worker does until its pipe is closed, as it is when the parent dies."""
    parents.close()  # a process that was forked has this end, too
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    set_threads(threads)
    objects: list[Any] = []
    with suppress(EOFError, OSError):
        pipe.send_bytes(_answer(lambda: objects.append(pickle.loads(made)(*inherited))))
        while True:
            with suppress(Exception):  # it will come up again when the work is asked for
                for _ in objects[0].prepare():
                    if pipe.poll():
                        break
            pipe.send_bytes(_answer(partial(_call, objects, pipe.recv_bytes())))


def _call(objects: list[Any], pickled: bytes) -> Any:
    name, arguments, settings = pickle.loads(pickled)
    return getattr(objects[0], name)(*arguments, **settings)


def _answer(call: Callable[[], Any]) -> bytes:
    """(True, what the call returns) or (False, (what it raises, the same in one line)), pickled."""
    try:
        return pickle.dumps((True, call()), pickle.HIGHEST_PROTOCOL)
    except Exception as error:  # whatever it is, it is the parent's to know
        line = str(error) if isinstance(error, AutoPolyError) else described(error)
        try:
            answer = pickle.dumps((False, (error, line)))
            pickle.loads(answer)  # some pickle and cannot be made again
        except Exception:
            answer = pickle.dumps((False, (WorkerError(line), line)))
        return answer


def _pickled(value: Any, what: str) -> bytes:
    try:
        return pickle.dumps(value, pickle.HIGHEST_PROTOCOL)
    except Exception as error:  # every type has its own
        raise ConfigError(f"{what} cannot be sent to worker processes: {described(error)}") from error
