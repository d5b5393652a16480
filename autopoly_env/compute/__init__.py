"""How work is done: kernels compiled and cached, threads, and routines that pause where heavy jobs are due."""

from autopoly_env.compute.jit import inlined, kernel, uncounted_kernel
from autopoly_env.compute.parallel import map_threads, n_threads, set_check, set_threads
from autopoly_env.compute.routines import Job, Routine, run, run_all

__all__ = [
    "Job",
    "Routine",
    "inlined",
    "kernel",
    "map_threads",
    "n_threads",
    "run",
    "run_all",
    "set_check",
    "set_threads",
    "uncounted_kernel",
]
