"""What `training.evaluate` shows while it works: done, in work, the best agent so far, the time left."""

import time
from collections import Counter, defaultdict

from rich.console import Console

from agents.commands.progress import TASK, progress_bar
from agents.commands.screen import say
from autopoly_env.shown import tame
from training.evaluation.tasks import EvalTask
from training.records import Record

MOST_FAILURES = 20  # that are told one by one
MOST_NAMES = 2  # of tasks in work


class Display:
    """A progress bar on stderr; where that is no terminal, a line now and then. A context."""

    def __init__(self, n_tasks: int, n_done: int, *, quiet: bool) -> None:
        self.n_failed = 0
        self._quiet = quiet
        self._console = Console(stderr=True)
        self._bar = progress_bar(
            n_tasks, n_done=n_done, is_hidden=quiet, shows_left=True, console=self._console, stands=self._stands
        )
        self._n_tasks, self._n_done, self._n_new = n_tasks, n_done, 0
        self._began = time.monotonic()
        self._in_work: dict[tuple[str, str, int], None] = {}
        self._sums: defaultdict[str, float] = defaultdict(float)
        self._counts: Counter[str] = Counter()

    def __enter__(self) -> "Display":
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def begun(self, task: EvalTask) -> None:
        """A worker has a task."""
        self._in_work[_key(task)] = None
        self._bar.update(TASK, description=self._text())

    def done(self, task: EvalTask, record: Record) -> None:
        """A task is over and recorded."""
        self._in_work.pop(_key(task), None)
        self._n_done += 1
        self._n_new += 1
        if record.outcome is None:
            self.n_failed += 1
            if self.n_failed <= MOST_FAILURES:
                self._say(f"failed: {record.agent} on {record.target}: {record.error}")
        else:
            self._sums[record.agent] += record.outcome.r_all
            self._counts[record.agent] += 1
        self._bar.update(TASK, completed=self._n_done, description=self._text())

    def _stands(self) -> str:
        """What a line says where there is no bar."""
        spent = time.monotonic() - self._began
        left = f", {spent / self._n_new * (self._n_tasks - self._n_done):.0f} s left" if self._n_new else ""
        return f"{self._n_done} of {self._n_tasks} done{left}; {self._text()}"

    def _text(self) -> str:
        names = [f"{label} on {target}" for label, target, _ in list(self._in_work)]
        more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
        parts = [", ".join(names[:MOST_NAMES]) + more] if names else []
        if self._counts:
            best = max(self._counts, key=lambda label: self._sums[label] / self._counts[label])
            parts.insert(0, f"best so far {best} {self._sums[best] / self._counts[best]:.2f}")
        if self.n_failed:
            parts.insert(0, f"{self.n_failed} failed")
        return tame("; ".join(parts))

    def _say(self, text: str) -> None:
        say(self._console, text)


def _key(task: EvalTask) -> tuple[str, str, int]:
    return task.agent, task.target.name, task.seed
