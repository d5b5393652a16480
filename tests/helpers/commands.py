"""Commands that are run in the tests' own process, and what those in another one say."""

from collections.abc import Callable
from dataclasses import dataclass

import pytest


@dataclass(frozen=True)
class Said:
    """What a command came to."""

    code: int
    out: str
    err: str


Run = Callable[..., Said]


def without_pulses(stderr: str) -> list[str]:
    """The lines of a process, but for its signs of life: how many there are depends on the machine."""
    return [line for line in stderr.splitlines() if not line.startswith("  ... ")]


def runner(main: Callable[[list[str]], int], capsys: pytest.CaptureFixture[str]) -> Run:
    """Runs a command with arguments of any type."""

    def run_it(*arguments: object) -> Said:
        capsys.readouterr()
        code = main([str(argument) for argument in arguments])
        return Said(code, *capsys.readouterr())

    return run_it
