"""Seconds of a solve with the default budget on two threads and what it is worth; a turn is an image."""

import time
from typing import Any

from agents.budget import Budget
from agents.registry import make_agent
from autopoly_env.compute import set_threads
from autopoly_env.score import ScoreWeights
from autopoly_env.silhouette import load_silhouette
from autopoly_env.simulator import Simulator


class Probe:
    def __init__(self, settings: dict[str, Any]) -> None:
        set_threads(2)
        self._images, self._agent = settings["images"], settings["agent"]
        self._weights = ScoreWeights(w_sc=settings["w_sc"])
        self._budget = Budget(refits=settings["refits"], seconds=settings["seconds"])
        self._solve(self._images[0], Budget(refits=30))

    def measure(self, turn: int) -> dict[str, float]:
        wall, cpu = time.perf_counter(), time.process_time()
        worth = self._solve(self._images[turn % len(self._images)], self._budget)
        return {"wall": time.perf_counter() - wall, "cpu": time.process_time() - cpu, "r_all": worth}

    def _solve(self, image: str, limit: Budget) -> float:
        simulator = Simulator(load_silhouette(image), weights=self._weights)
        return simulator.final_score(make_agent(self._agent).solve(simulator, limit).mesh).total
