"""What came of odd inputs, counted: accepted, refused in one tame line, anything else."""

import sys
import time
import traceback
from dataclasses import dataclass, field

import numpy as np

from autopoly_env.errors import AutoPolyError
from benchmarks.fuzz.inputs import DOORS

MOST_LETTERS = 400  # of a message
MOST_BYTES = 6 * 10**9  # of memory
TOLD_EVERY = 10_000  # inputs
N_SHOWN = 12  # exceptions of a door that are shown


@dataclass
class Tally:
    """What came of the inputs of one door."""

    n_inputs: int = 0
    n_accepted: int = 0
    n_refused: int = 0
    n_others: int = 0  # exceptions that are not the project's own
    longest: int = 0  # letters of a message
    n_wild: int = 0  # messages with line ends or control characters
    slowest: float = 0.0  # seconds
    shown: dict[str, str] = field(default_factory=dict)  # by the line that an exception comes from, what it says

    @property
    def is_sound(self) -> bool:
        """Whether every promise was kept."""
        return not (self.n_others or self.n_wild or self.longest > MOST_LETTERS)


def fuzz(n: int, seed: int) -> dict[str, Tally]:
    """`n` inputs over all doors; each depends on the seed and its number only. Now and then stderr hears of it."""
    tallies = {name: Tally() for name in DOORS} if n else {}
    names = [name for name, (_, share) in DOORS.items() for _ in range(share)]
    for number in range(n):
        name = names[(37 * number) % len(names)]
        try_one(tallies[name], name, seed, number)
        if number % TOLD_EVERY == TOLD_EVERY - 1:
            print(table(tallies), file=sys.stderr, flush=True)
    return tallies


def try_one(tally: Tally, name: str, seed: int, number: int) -> None:
    """One input through one door, counted."""
    rng = np.random.default_rng((seed, number))
    began = time.perf_counter()
    try:
        DOORS[name][0](rng)
        tally.n_accepted += 1
    except AutoPolyError as error:
        message = str(error)
        tally.n_refused += 1
        tally.longest = max(tally.longest, len(message))
        if len(message) > MOST_LETTERS:
            tally.shown.setdefault("too long", f"number {number}: {message[:200]!r}")
        if not message.isprintable():
            tally.n_wild += 1
            tally.shown.setdefault("not tame", f"number {number}: {message[:200]!r}")
    except Exception as error:  # what is looked for
        tally.n_others += 1
        frames = traceback.extract_tb(error.__traceback__)
        own = [frame for frame in frames if "site-packages" not in frame.filename] or frames
        where = f"{own[-1].filename.rpartition('/')[2]} line {own[-1].lineno}"
        tally.shown.setdefault(where, f"number {number}: {type(error).__name__}: {str(error)[:160]!r}")
    tally.n_inputs += 1
    tally.slowest = max(tally.slowest, time.perf_counter() - began)


def table(tallies: dict[str, Tally]) -> str:
    """The counts as Markdown, their sum last, and below it what was wrong."""
    heads = ("input", "inputs", "accepted", "refused", "other exceptions", "longest message", "not tame", "slowest, s")
    lines = [f"| {' | '.join(heads)} |", f"|---{'|---:' * (len(heads) - 1)}|"]
    total = Tally()
    for name, one in tallies.items():
        lines.append(_row(name, one))
        total.longest, total.slowest = max(total.longest, one.longest), max(total.slowest, one.slowest)
        for count in ("n_inputs", "n_accepted", "n_refused", "n_others", "n_wild"):
            setattr(total, count, getattr(total, count) + getattr(one, count))
    lines.append(_row("all", total))
    for name, one in tallies.items():
        lines += [f"{name}, {where}: {what}" for where, what in list(one.shown.items())[:N_SHOWN]]
    return "\n".join(lines)


def limit_memory(n_bytes: int) -> None:
    """Have an allocation beyond so many bytes fail, where the system can do that."""
    try:
        import resource
    except ImportError:  # not on Windows
        return
    resource.setrlimit(resource.RLIMIT_AS, (n_bytes, resource.getrlimit(resource.RLIMIT_AS)[1]))


def _row(name: str, one: Tally) -> str:
    counts = (one.n_inputs, one.n_accepted, one.n_refused, one.n_others, one.longest, one.n_wild)
    return f"| {name} | {' | '.join(f'{count:,}' for count in counts)} | {one.slowest:.1f} |"
