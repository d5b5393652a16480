"""Routines: alone or among others, on one thread or more, the same comes out; and what goes wrong comes out, too."""

import threading
from collections.abc import Iterator
from functools import partial
from typing import Any

import pytest

from autopoly_env.compute import Routine, run, run_all, set_check, set_threads


@pytest.fixture(params=[1, 2, 3], ids=lambda n: f"{n} threads")
def threads(request: pytest.FixtureRequest) -> Iterator[int]:
    set_threads(request.param)
    yield request.param
    set_threads(None)


def square(x: int) -> int:
    return x * x


def sum_of_squares(n_rounds: int, width: int = 2) -> Routine[int]:
    """Pauses `n_rounds` times for `width` jobs each: 0 + 1 + 4 + 9 + ..."""
    total = 0
    for k in range(n_rounds):
        total += sum((yield [partial(square, k * width + j) for j in range(width)]))
    return total


def expected(n_rounds: int, width: int = 2) -> int:
    return sum(x * x for x in range(n_rounds * width))


def broken() -> Any:
    raise ValueError("a job went wrong")


def test_run__does_the_jobs_and_gives_what_the_routine_returns() -> None:
    assert run(sum_of_squares(3)) == 0 + 1 + 4 + 9 + 16 + 25
    assert run(sum_of_squares(0)) == 0


def test_run_all__gives_the_results_in_the_order_of_the_routines(threads: int) -> None:
    lengths = [5, 0, 1, 12, 3, 7, 2] * 4
    assert run_all(sum_of_squares(n, width=3) for n in lengths) == [expected(n, 3) for n in lengths]
    assert run_all([]) == []


def test_pause_without_jobs__goes_on_at_once(threads: int) -> None:
    assert run_all(sum_of_squares(n, width=0) for n in (1, 3)) == [0, 0]


def test_routines_themselves__run_on_the_calling_thread_only(threads: int) -> None:
    seen = []

    def routine() -> Routine[None]:
        for _ in range(3):
            seen.append(threading.get_ident())
            yield [partial(square, 2)] * 2

    run_all(routine() for _ in range(8))
    assert set(seen) == {threading.get_ident()}


def test_jobs__run_on_other_threads_while_one_is_busy() -> None:
    set_threads(2)
    try:
        both = threading.Barrier(2, timeout=20)  # neither gets past it alone
        run_all(one_job(both.wait) for _ in range(2))
    finally:
        set_threads(None)


def one_job(job: Any) -> Routine[Any]:
    return (yield [job])[0]


def test_error_of_a_job__comes_out_and_leaves_the_threads_usable(threads: int) -> None:
    with pytest.raises(ValueError, match="a job went wrong"):
        run_all([sum_of_squares(3), one_job(broken), sum_of_squares(30)])
    assert run_all([sum_of_squares(2)]) == [expected(2)]


@pytest.mark.parametrize("go", [run, lambda routine: run_all([routine, sum_of_squares(2)])])
def test_check__gives_the_routines_up_before_a_job(go: Any, threads: int) -> None:
    done: list[int] = []

    def check() -> None:
        if len(done) >= 5:
            raise KeyboardInterrupt  # no Exception, as that by which the studio gives a search up

    def routine() -> Routine[None]:
        while True:
            yield [partial(done.append, 1)]

    set_check(check)
    try:
        with pytest.raises(KeyboardInterrupt):
            go(routine())
    finally:
        set_check(None)
    assert len(done) == 5
    assert run_all([sum_of_squares(2)]) == [expected(2)]


def test_error_of_a_routine__comes_out(threads: int) -> None:
    def routine() -> Routine[int]:
        yield [partial(square, 2)]
        raise KeyError("lost")

    with pytest.raises(KeyError, match="lost"):
        run_all([sum_of_squares(3), routine()])


def test_run_all_inside_a_job__does_not_wait_for_itself(threads: int) -> None:
    def inner() -> list[int]:
        return run_all([sum_of_squares(2), sum_of_squares(3)])

    assert run_all(one_job(inner) for _ in range(4)) == [[expected(2), expected(3)]] * 4
