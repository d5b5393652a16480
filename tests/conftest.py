"""Settings of every test run: one Numba thread a process, and property tests that neither race nor wander."""

import os

os.environ.setdefault("NUMBA_NUM_THREADS", "1")  # read when numba is imported, which no test has done yet

from hypothesis import settings

settings.register_profile("autopoly", deadline=None, derandomize="CI" in os.environ)
settings.load_profile("autopoly")
