"""The progress bar of all commands."""

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

TASK = TaskID(0)  # the one task of a bar


def progress_bar(
    total: int,
    description: str = "",
    *,
    n_done: int = 0,
    is_hidden: bool = False,
    shows_left: bool = False,
    takes_prints: bool = False,
    console: Console | None = None,
) -> Progress:
    """A bar for `total` things of which `n_done` are done; its one task is `TASK`. A context.

    It is on stderr (or `console`) where that is a terminal, unless it `is_hidden`, goes when it is done, and leaves
    stdout alone. `shows_left`: with the time left, beside the time gone. `takes_prints`: what is printed to stdout
    meanwhile stands above it instead.
    """
    console = console or Console(stderr=True)
    left: tuple[ProgressColumn, ...] = (TextColumn("left"), TimeRemainingColumn(elapsed_when_finished=False))
    bar = Progress(
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
    return bar
