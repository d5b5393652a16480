"""How many threads this process may use, and the one pool that uses them."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache
from typing import Any, TypeVar

from autopoly_env.arguments import is_count
from autopoly_env.errors import ConfigError
from autopoly_env.shown import short

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")
_override: int | None = None
_check: Callable[[], None] | None = None


def n_threads() -> int:
    """Threads for batched work: `set_threads`, else the variable AUTOPOLY_THREADS, else the cores this process has."""
    if _override is not None:
        return _override
    given = os.environ.get("AUTOPOLY_THREADS", "")
    if not given:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if not is_count(given) or int(given) < 1:
        raise ConfigError(f"AUTOPOLY_THREADS={short(given)}: expected a whole number of at least 1")
    return int(given)


def set_threads(threads: int | None) -> None:
    """Use this many threads from now on; None goes back to the default."""
    global _override
    if threads is not None and threads < 1:
        raise ConfigError(f"{threads} threads: expected at least 1")
    _override = threads


def set_check(check: Callable[[], None] | None) -> None:
    """Call `check` before each job of batched work from now on, in the thread that is to do it; None: call nothing.

    What it raises gives the work up. That is sound where an exception out of a signal's handler, which may come up
    in the midst of a lock or of compiled code, is not.
    """
    global _check
    _check = check


def checked(function: Callable[..., _Result], *arguments: Any) -> _Result:
    """What the function returns, called after what was set with `set_check`."""
    if _check is not None:
        _check()
    return function(*arguments)


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, thread_name_prefix="autopoly")


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_pool.cache_clear)  # the threads of the pool stay behind in the parent


def map_threads(function: Callable[[_Item], _Result], items: Iterable[_Item]) -> list[_Result]:
    """`[function(item) for item in items]` on all threads; each item starts as soon as the iterable yields it.

    Worth it where `function` spends its time in kernels, which run without the GIL: the caller's thread then prepares
    the next item while the others compute.
    """
    if n_threads() == 1:
        return [checked(function, item) for item in items]
    futures: list[Future[_Result]] = []
    try:
        futures.extend(_pool(n_threads()).submit(checked, function, item) for item in items)
        return [future.result() for future in futures]
    except BaseException:
        for future in futures:
            future.cancel()
        raise
