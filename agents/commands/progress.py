"""The progress bar of all commands; where nobody sees it, a line now and then."""

import time
from collections.abc import Callable

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    SpinnerColumn,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from agents.commands.pulse import Pulse

TASK = TaskID(0)  # the one task of a bar


class Bar(Progress):
    """A progress bar; one that is not seen may have a pulse instead."""

    pulse: Pulse | None = None

    def start(self) -> None:
        """Show it."""
        super().start()
        if self.pulse is not None:
            self.pulse.__enter__()

    def stop(self) -> None:
        """Have it go."""
        if self.pulse is not None:
            self.pulse.__exit__()
            self.pulse = None
        super().stop()


def progress_bar(
    total: int,
    description: str = "",
    *,
    n_done: int = 0,
    is_hidden: bool = False,
    shows_left: bool = False,
    takes_prints: bool = False,
    console: Console | None = None,
    stands: Callable[[], str] | None = None,
) -> Bar:
    """A bar for `total` things of which `n_done` are done; its one task is `TASK`. A context.

    It is on stderr (or `console`) where that is a terminal, unless it `is_hidden`, goes when it is done, and leaves
    stdout alone. `shows_left`: with the time left, beside the time gone. `takes_prints`: what is printed to stdout
    meanwhile stands above it instead. Where there is no terminal stderr gets a line every few seconds, of what `stands`
    says, or how much is done; not where it `takes_prints`, which are lines enough.
    """
    console = console or Console(stderr=True)
    left: tuple[ProgressColumn, ...] = (TextColumn("left"), TimeRemainingColumn(elapsed_when_finished=False))
    bar = Bar(
        SpinnerColumn(),
        MofNCompleteColumn(),
        BarColumn(bar_width=24),
        TimeElapsedColumn(),
        *(left if shows_left else ()),
        TextColumn("{task.description}", markup=False),
        console=console,
        disable=is_hidden or not console.is_terminal,
        redirect_stdout=takes_prints,
        transient=True,
        speed_estimate_period=300.0,
    )
    bar.add_task(description, total=total, completed=n_done)
    if not (is_hidden or takes_prints or console.is_terminal):
        bar.pulse = Pulse(stands or _counted(bar))
    return bar


def _counted(bar: Progress) -> Callable[[], str]:
    """What a line says where there is no bar."""
    began = time.monotonic()

    def stands() -> str:
        task = bar.tasks[TASK]
        what = f"; {task.description}" if task.description else ""
        return f"{task.completed:g} of {task.total:g} done, {time.monotonic() - began:.0f} s{what}"

    return stands
