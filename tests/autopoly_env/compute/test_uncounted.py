"""Kernels without reference counts own no array: nobody would let go of it."""

import inspect
import pkgutil
from collections.abc import Iterator
from importlib import import_module
from typing import Any, get_type_hints

import pytest
from numba.core.dispatcher import Dispatcher

import agents
import autopoly_env
from autopoly_env.compute import kernel, uncounted_kernel

NUMBERS = {float, int, bool, type(None)}


def kernels() -> Iterator[tuple[str, Any]]:
    """All kernels of the packages by name, each where it is made."""
    for package in (autopoly_env, agents):
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if found.name.endswith("_kernels"):
                module = import_module(found.name)
                for name, value in vars(module).items():
                    if isinstance(value, Dispatcher) and value.py_func.__module__ == found.name:
                        yield f"{found.name}.{name}", value


def hands_over(called: Any) -> bool:
    """Whether a kernel returns anything but numbers."""
    kind = get_type_hints(called.py_func)["return"]
    return not set(getattr(kind, "__args__", None) or (kind,)) <= NUMBERS


UNCOUNTED = {name: one for name, one in kernels() if one.targetoptions.get("_nrt") is False}


def test_kernels_of_refits_are_uncounted() -> None:
    names = {name.rpartition(".")[2] for name in UNCOUNTED}
    assert {"walk_boundary", "half_gradient", "count_defects", "offer", "solve", "_direction"} <= names


@pytest.mark.parametrize("name", UNCOUNTED)
def test_uncounted_kernel__neither_returns_arrays_nor_gets_any_from_what_it_calls(name: str) -> None:
    one = UNCOUNTED[name]
    assert not hands_over(one)
    called = [value for value in inspect.getclosurevars(one.py_func).globals.values() if isinstance(value, Dispatcher)]
    assert not [other for other in called if other.targetoptions.get("inline") != "always" and hands_over(other)]


def test_uncounted_kernel__that_makes_an_array_is_refused() -> None:
    import numpy as np

    @uncounted_kernel
    def made(n: int) -> float:
        return np.empty(n)[0]

    with pytest.raises(Exception, match="array"):
        made(3)


def test_kernel__that_an_uncounted_one_calls_first_counts_all_the_same() -> None:
    """Numba hands the options of a caller on to what is compiled for it."""
    import numpy as np

    @kernel
    def summed(n: int) -> float:
        return np.ones(n).sum()

    @uncounted_kernel
    def twice(n: int) -> float:
        return 2.0 * summed(n)

    assert twice(3) == 6.0
