#!/usr/bin/env bash
# Numba 0.68.1: a compiled function that returns arrays runs Python on its way out, once for each array and each tuple.
#
# Input: three compiled functions that return a number, two arrays, and a NamedTuple of the two.
# Guess: what is compiled runs to its end without the interpreter; a signal is heeded before or after.
# Seen: a profiler hears of `_numba_unpickle`, a function of Python, for each array, and of the NamedTuple's constructor.
# A signal that comes just then is handled just then: of our searches that were stopped by Ctrl-C at random moments, one
# in some forty ended in a segmentation fault or a SystemError: Numba did not look whether the call had raised.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check numba==0.68.1 numpy==2.4.6
venv/bin/python - <<'PYTHON'
import sys
from typing import NamedTuple

import numpy as np
from numba import njit


class Pair(NamedTuple):
    first: np.ndarray
    second: np.ndarray


@njit
def number(n):
    return 1.0 * n


@njit
def arrays(n):
    return np.ones(n), np.zeros(n)


@njit
def pair(n):
    return Pair(np.ones(n), np.zeros(n))


def python_within(function):
    """The functions of Python that run while a compiled one is called; the first call, which compiles, does not count."""
    function(3)
    heard = []
    sys.setprofile(lambda frame, event, _: event == "call" and heard.append(frame.f_code.co_name))
    function(3)
    sys.setprofile(None)
    return [name for name in heard if name not in ("number", "arrays", "pair")]  # which Numba tells profilers of


seen = {function.__name__: python_within(function) for function in (number, arrays, pair)}
for name, heard in seen.items():
    print(f"{name}: {heard}")
sys.exit(seen != {"number": [], "arrays": ["_numba_unpickle"] * 2, "pair": ["_numba_unpickle"] * 3 + ["<lambda>"]})
PYTHON
