"""What trainings say: signs of life while they go on, their settings with what they mean, their metrics as a table."""

import inspect
import re
import sys
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

from autopoly_env.shown import short

EVERY = 4.0  # seconds of silence, after which there is a sign of life
BASELINES = ("residual", "majority", "chance", "least")  # how names of metrics end that others are measured against
_FIELD = re.compile(r"^    (\w+): [^#\n]*?(?:  # (.*))?$", re.MULTILINE)


class Pulse:
    """A context in which stderr says where the work stands whenever nothing was said for a while.

    `stands` is asked for that, in another thread. What is said by `say` goes to stdout at once, whatever buffers it.
    """

    def __init__(self, stands: Callable[[], str], every: float = EVERY) -> None:
        self._stands, self._every = stands, every
        self._over = threading.Event()
        self._said = time.monotonic()
        self._thread = threading.Thread(target=self._beat, daemon=True)

    def __enter__(self) -> "Pulse":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()

    def say(self, line: str) -> None:
        """Print a line to stdout, at once."""
        self._said = time.monotonic()
        print(line, flush=True)

    def _beat(self) -> None:
        while not self._over.wait(max(0.05, self._said + self._every - time.monotonic())):
            if time.monotonic() - self._said >= self._every:
                self._said = time.monotonic()
                print(f"  ... {self._stands()}", file=sys.stderr, flush=True)


def duration(seconds: float) -> str:
    """A time in words: 12 s, 3.4 min, 2.1 h."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.1f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"


def settings_of(config: Any, prefix: str = "") -> list[str]:
    """A line for every SECTION.KEY of nested dataclasses: its value, and what the comment beside it says."""
    lines: list[str] = []
    meanings = _meanings(type(config))
    for one in fields(config):
        value, name = getattr(config, one.name), f"{prefix}{one.name}"
        if is_dataclass(value):
            lines += ["", f"# {name}: {_first_line(type(value))}", *settings_of(value, f"{name}.")]
        else:
            meaning = meanings.get(one.name, "")
            lines.append(f"{name} = {short(value)}" + (f"  # {meaning}" if meaning else ""))
    return lines


def table_of(metrics: Mapping[str, float]) -> str:
    """A row for every metric, and beside it what it is measured against: names that end in one of `BASELINES`."""
    rows = [("metric", "value", "to compare with")]
    for name, value in metrics.items():
        if name.rpartition("_")[2] in BASELINES and name.rpartition("_")[0] in metrics:
            continue
        against = [f"{end} {metrics[f'{name}_{end}']:.4g}" for end in BASELINES if f"{name}_{end}" in metrics]
        rows.append((name, f"{value:.4g}", ", ".join(against)))
    widths = [max(len(row[k]) for row in rows) for k in range(2)]
    return "\n".join(f"  {a:<{widths[0]}}  {b:>{widths[1]}}  {c}".rstrip() for a, b, c in rows)


def _meanings(kind: type) -> dict[str, str]:
    """The comments beside the fields of a dataclass and of what it inherits from, by the fields' names."""
    found: dict[str, str] = {}
    for one in reversed(kind.__mro__):
        if is_dataclass(one):
            found |= {name: comment for name, comment in _FIELD.findall(inspect.getsource(one)) if comment}
    return found


def _first_line(kind: type) -> str:
    return (inspect.getdoc(kind) or "").split("\n")[0]
