"""Meshes as a search refits them, written to a file: what actions make of the states of greedy play, not refitted yet.

Run once, by the other revision, so that both refit the same.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from autopoly_env.errors import AutoPolyError
from autopoly_env.operators import STOP
from autopoly_env.placement import Disagreement, tried
from autopoly_env.silhouette import load_silhouette
from autopoly_env.simulator import Simulator, State

_N_STEPS, _N_EACH = 8, 6


class Probe:
    def __init__(self, settings: dict[str, Any]) -> None:
        self._images, self._path = settings["images"], Path(settings["states"])

    def measure(self, turn: int) -> dict[str, float]:
        starts = [start for image in self._images for start in _starts_of(image)]
        self._path.write_text(json.dumps(starts), encoding="utf-8")
        return {"n": float(len(starts))}


def _starts_of(image: str) -> list[dict[str, Any]]:
    simulator, rng = Simulator(load_silhouette(image)), np.random.default_rng(0)
    state, found = simulator.initial(), []
    for _ in range(_N_STEPS):
        found += [{"image": image, "iou": state.score.iou, **start} for start in _of_state(simulator, state, rng)]
        children = simulator.transition_all(state)
        if state.done or not children:
            break
        state = max(children, key=lambda child: child.score.total)
    return found


def _of_state(simulator: Simulator, state: State, rng: np.random.Generator) -> list[dict[str, Any]]:
    disagreement = Disagreement(state.mesh, simulator.silhouette)
    actions = [action for action in simulator.legal_actions(state) if action != STOP]
    made: list[dict[str, Any]] = []
    for k in rng.permutation(len(actions)):
        try:
            trial = tried(disagreement, actions[k])
        except AutoPolyError:
            continue
        if trial.shows and len(made) < _N_EACH:
            mesh = trial.starts[0].mesh
            made.append({"vertices": mesh.vertices.tolist(), "faces": [list(face) for face in mesh.faces]})
    return made
