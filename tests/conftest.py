"""Settings of every test run: one Numba thread a process, property tests that neither race nor wander, no litter."""

import os
from collections.abc import Iterator

os.environ.setdefault("NUMBA_NUM_THREADS", "1")  # read when numba is imported, which no test has done yet

import pytest
from hypothesis import settings

from agents.commands import pulse
from autopoly_env.operators import OPERATORS
from tests.helpers.browser import Browser

settings.register_profile("autopoly", deadline=None, derandomize="CI" in os.environ)
settings.load_profile("autopoly")


@pytest.fixture(autouse=True)
def own_operators() -> Iterator[None]:
    """Operators that a test has made known are forgotten after it."""
    known = dict(OPERATORS)
    yield
    OPERATORS.clear()
    OPERATORS.update(known)


@pytest.fixture(autouse=True)
def no_pulse(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a command says depends on what it does, and not on how busy the machine is."""
    monkeypatch.setattr(pulse, "EVERY", 1e6)


@pytest.fixture(autouse=True)
def sb3_logs(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Stable-Baselines3 makes a folder for logs that nobody asked for; let it be among the temporary ones."""
    monkeypatch.setenv("SB3_LOGDIR", str(tmp_path_factory.getbasetemp() / "sb3"))


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """A real one, for tests that are marked `needs_browser`."""
    with Browser() as running:
        yield running
