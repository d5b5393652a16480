"""Ctrl-C: the first one ends a search with its best so far, the second ends everything."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

_Said = TypeVar("_Said")


class CtrlC:
    """The first Ctrl-C ends a search (KeyboardInterrupt in it) and then the run, the second ends everything at once."""

    def __init__(self) -> None:
        self.n_pressed = 0
        self._searching = self._shielded = False

    def __enter__(self) -> "CtrlC":
        self._before = signal.signal(signal.SIGINT, self._on_signal)
        return self

    def __exit__(self, *_: object) -> None:
        signal.signal(signal.SIGINT, self._before)

    def _on_signal(self, *_: object) -> None:
        self.n_pressed += 1
        if not self._shielded and (self._searching or self.n_pressed > 1):
            raise KeyboardInterrupt

    @contextmanager
    def searching(self) -> Iterator[None]:
        """Where the first Ctrl-C is for the agent, which returns its best so far."""
        self._searching = True
        try:
            if self.n_pressed:
                raise KeyboardInterrupt
            yield
        finally:
            self._searching = False

    def heeding(self, report: Callable[[_Said], None]) -> Callable[[_Said], None]:
        """`report`, which raises KeyboardInterrupt once more where Ctrl-C was pressed and the first one got lost.

        That happens to exceptions that come up in callbacks from compiled code, such as while kernels are compiled.
        """
        n_before = self.n_pressed

        def reported(said: _Said) -> None:
            report(said)
            if self.n_pressed > n_before:
                raise KeyboardInterrupt

        return reported

    @contextmanager
    def shielded(self) -> Iterator[None]:
        """Where even a second Ctrl-C has to wait, for the blink of an eye."""
        self._shielded = True
        try:
            yield
        finally:
            self._shielded = False
        if self.n_pressed > 1:
            raise KeyboardInterrupt
