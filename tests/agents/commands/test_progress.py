"""The commands' progress bar: seen on a terminal only, and gone in the end."""

import io

import pytest
from rich.console import Console

from agents.commands.progress import TASK, progress_bar


def shown(*, is_terminal: bool, is_hidden: bool = False, shows_left: bool = False) -> str:
    stream = io.StringIO()
    console = Console(file=stream, force_terminal=is_terminal, width=100)
    with progress_bar(5, "shapes", n_done=2, is_hidden=is_hidden, shows_left=shows_left, console=console) as bar:
        bar.advance(TASK)
        bar.refresh()
    return stream.getvalue()


def test_bar__counts_on_a_terminal_and_names_its_work() -> None:
    text = shown(is_terminal=True)
    assert "3/5" in text and "shapes" in text and "left" not in text
    assert "left" in shown(is_terminal=True, shows_left=True)
    assert text.endswith("\x1b[2K")  # the line is wiped


@pytest.mark.parametrize(("is_terminal", "is_hidden"), [(False, False), (True, True), (False, True)])
def test_bar__is_silent_where_nobody_looks_or_it_is_not_wanted(is_terminal: bool, is_hidden: bool) -> None:
    assert shown(is_terminal=is_terminal, is_hidden=is_hidden) == ""


def test_bar__stands_below_what_is_printed_where_it_takes_that(capsys: pytest.CaptureFixture[str]) -> None:
    stream = io.StringIO()
    for takes_prints in (False, True):
        console = Console(file=stream, force_terminal=True, width=100)
        with progress_bar(5, takes_prints=takes_prints, console=console):
            print(f"taken: {takes_prints}")
    assert capsys.readouterr().out == "taken: False\n"
    assert "taken: True" in stream.getvalue() and "taken: False" not in stream.getvalue()
