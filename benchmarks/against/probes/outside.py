"""The share of a solve by `mcts`, on one thread, that is not spent in the refits' kernel."""

import time
from collections.abc import Callable
from typing import Any

from agents.budget import Budget
from agents.registry import make_agent
from autopoly_env.compute import set_threads
from autopoly_env.refit import refit_kernels
from autopoly_env.silhouette import load_silhouette
from autopoly_env.simulator import Simulator

_REFITS = 1500


class Probe:
    def __init__(self, settings: dict[str, Any]) -> None:
        set_threads(1)
        self._images = settings["images"]
        _solve(self._images[0], 30)

    def measure(self, turn: int) -> dict[str, float]:
        kernel, clock = refit_kernels.refit, _Clock(refit_kernels.refit)
        refit_kernels.refit = clock
        try:
            began = time.perf_counter()
            _solve(self._images[turn % len(self._images)], _REFITS)
            return {"share": 1.0 - clock.seconds / (time.perf_counter() - began)}
        finally:
            refit_kernels.refit = kernel


class _Clock:
    """A kernel whose seconds are counted."""

    def __init__(self, kernel: Callable[..., Any]) -> None:
        self.seconds = 0.0
        self._kernel = kernel

    def __call__(self, *arguments: Any) -> Any:
        began = time.perf_counter()
        try:
            return self._kernel(*arguments)
        finally:
            self.seconds += time.perf_counter() - began


def _solve(image: str, refits: int) -> None:
    make_agent("mcts").solve(Simulator(load_silhouette(image)), Budget(refits=refits))
