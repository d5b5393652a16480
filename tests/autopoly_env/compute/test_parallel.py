"""Threads: how many there are, and what runs on them."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from autopoly_env.compute import map_threads, n_threads, parallel, set_check, set_threads
from autopoly_env.errors import ConfigError
from tests.helpers.paths import ROOT


@pytest.fixture
def default_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("AUTOPOLY_THREADS", raising=False)
    monkeypatch.setattr(parallel, "_override", None)


@pytest.fixture
def no_check_afterwards() -> Iterator[None]:
    yield
    set_check(None)


class GivenUpError(BaseException):
    """As the studio gives a search up."""


def raising_where(is_enough: Callable[[], bool]) -> Callable[[], None]:
    def check() -> None:
        if is_enough():
            raise GivenUpError

    return check


@pytest.mark.usefixtures("default_threads")
def test_n_threads__is_what_was_set_last(monkeypatch: pytest.MonkeyPatch) -> None:
    assert 1 <= n_threads() <= (os.cpu_count() or 1)
    monkeypatch.setenv("AUTOPOLY_THREADS", "5")
    assert n_threads() == 5
    set_threads(3)
    assert n_threads() == 3
    set_threads(None)
    assert n_threads() == 5


@pytest.mark.usefixtures("default_threads")
@pytest.mark.parametrize("given", ["0", "-1", "two", "1.5", " "])
def test_n_threads__refuses_a_senseless_variable(given: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AUTOPOLY_THREADS", given)
    with pytest.raises(ConfigError, match="AUTOPOLY_THREADS"):
        n_threads()


def test_set_threads__refuses_none_at_all() -> None:
    with pytest.raises(ConfigError, match="at least 1"):
        set_threads(0)


@pytest.mark.usefixtures("default_threads")
@pytest.mark.parametrize("threads", [1, 2, 3])
def test_map_threads__keeps_the_order_and_passes_errors_on(threads: int) -> None:
    set_threads(threads)
    assert map_threads(lambda x: x * x, iter(range(20))) == [x * x for x in range(20)]
    assert map_threads(str, []) == []
    with pytest.raises(ZeroDivisionError):
        map_threads(lambda x: 1 // x, [2, 1, 0, 3])
    assert map_threads(str, [1]) == ["1"]


@pytest.mark.usefixtures("default_threads", "no_check_afterwards")
@pytest.mark.parametrize("threads", [1, 2, 3])
def test_check__gives_the_work_up_between_two_jobs(threads: int) -> None:
    set_threads(threads)
    done: list[int] = []
    set_check(raising_where(lambda: len(done) >= 5))
    with pytest.raises(GivenUpError):
        map_threads(done.append, range(1000))
    assert 5 <= len(done) <= 5 + threads  # those that had begun
    set_check(None)
    assert map_threads(abs, range(20)) == list(range(20))


@pytest.mark.skipif(not hasattr(os, "fork"), reason="nothing forks here")
def test_map_threads__works_in_a_forked_child_of_a_process_that_has_used_it(tmp_path: Path) -> None:
    code = (
        "import os, signal; from autopoly_env.compute.parallel import map_threads; map_threads(str, range(9));"
        "child = os.fork(); signal.alarm(10);"  # so that neither hangs
        "child or os._exit(map_threads(abs, [0, 0, 7])[2]);"
        "print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))"
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "AUTOPOLY_THREADS": "2"}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=20)
    assert done.stdout == "7\n"
