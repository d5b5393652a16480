"""Commands that are run in the tests' own process."""

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


def runner(main: Callable[[list[str]], int], capsys: pytest.CaptureFixture[str]) -> Run:
    """Runs a command with arguments of any type."""

    def run_it(*arguments: object) -> Said:
        capsys.readouterr()
        code = main([str(argument) for argument in arguments])
        return Said(code, *capsys.readouterr())

    return run_it
