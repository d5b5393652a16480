"""Refits a CPU-second on what `states` has written, and the mean loss where they end."""

import json
import time
from pathlib import Path
from typing import Any

from autopoly_env.mesh import PolyMesh
from autopoly_env.refit import THOROUGH, refit
from autopoly_env.silhouette import load_silhouette
from autopoly_env.simulator import Simulator

_N_PARTS = 4  # a turn does every fourth: the four that follow each other do all


class Probe:
    def __init__(self, settings: dict[str, Any]) -> None:
        written = json.loads(Path(settings["states"]).read_text(encoding="utf-8"))
        simulators = {image: Simulator(load_silhouette(image)) for image in {state["image"] for state in written}}
        self._inputs = [
            (
                PolyMesh.from_faces(state["vertices"], [tuple(face) for face in state["faces"]]),
                simulators[state["image"]].refit_target(state["iou"]),
            )
            for state in written
        ]
        for turn in range(_N_PARTS):
            self.measure(turn)

    def measure(self, turn: int) -> dict[str, float]:
        chosen = self._inputs[turn % _N_PARTS :: _N_PARTS]
        began = time.process_time()
        losses = [refit(mesh, target, THOROUGH).loss for mesh, target in chosen]
        spent = time.process_time() - began
        return {"rate": len(chosen) / spent, "loss": sum(losses) / len(losses)}
