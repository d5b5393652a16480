"""The commands' progress bar: seen on a terminal only, and gone in the end."""

import io
import threading

import pytest
from rich.console import Console

from agents.commands.progress import TASK, progress_bar
from agents.commands.pulse import Pulse


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


def test_bar__has_a_pulse_where_there_is_no_terminal_and_it_is_wanted() -> None:
    plain, terminal = Console(file=io.StringIO()), Console(file=io.StringIO(), force_terminal=True)
    assert progress_bar(5, console=plain).pulse is not None
    assert progress_bar(5, console=plain, is_hidden=True).pulse is None
    assert progress_bar(5, console=terminal).pulse is None


def test_pulse__says_where_things_stand_when_nothing_else_was_said(capsys: pytest.CaptureFixture[str]) -> None:
    asked = threading.Event()

    def stands() -> str:
        asked.set()
        return "step 3 of 9"

    with Pulse(stands, every=0.01):
        assert asked.wait(30.0)
    assert "... step 3 of 9" in capsys.readouterr().err


def test_pulse__keeps_still_while_others_speak(capsys: pytest.CaptureFixture[str]) -> None:
    with Pulse(lambda: "nothing new", every=1e6) as pulse:
        pulse.say("step 1")
    said = capsys.readouterr()
    assert (said.out, said.err) == ("step 1\n", "")
