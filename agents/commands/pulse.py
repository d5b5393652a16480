"""`Pulse`: signs of life of what would be silent for long."""

import sys
import threading
import time
from collections.abc import Callable

from agents.commands.starting import BEGAN

EVERY = 3.0  # seconds of silence, after which there is a sign of life


class Pulse:
    """A context in which stderr says where the work stands whenever none has said anything for a while.

    `stands` is asked for that, in another thread. What is said by `say` goes to stdout at once, whatever buffers it.
    """

    said = BEGAN  # when the last one said something

    def __init__(self, stands: Callable[[], str], every: float | None = None) -> None:
        self._stands, self._every = stands, EVERY if every is None else every
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._beat, daemon=True)

    def __enter__(self) -> "Pulse":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()

    def say(self, line: str) -> None:
        """Print a line to stdout, at once."""
        Pulse.said = time.monotonic()
        print(line, flush=True)

    def _beat(self) -> None:
        while not self._over.wait(max(0.05, Pulse.said + self._every - time.monotonic())):
            if time.monotonic() - Pulse.said >= self._every:
                Pulse.said = time.monotonic()
                print(f"  ... {self._stands()}", file=sys.stderr, flush=True)
