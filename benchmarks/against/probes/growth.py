"""CPU-microseconds of a refit as vertices and pixels become more: from a circle to a star of seven points."""

import time
from typing import Any

import numpy as np

from autopoly_env.mesh import PolyMesh
from autopoly_env.refit import THOROUGH, RefitTarget, refit
from autopoly_env.silhouette import Silhouette

_VERTICES, _SIDES = (8, 16, 32, 64), (64, 128, 256, 512)
_REPEATS = 5


class Probe:
    def __init__(self, settings: dict[str, Any]) -> None:
        star = _star()
        targets = {side: RefitTarget.of(star, side) for side in _SIDES}
        self._cases = {f"vertices {n}": (_circle(n), targets[128]) for n in _VERTICES}
        self._cases |= {f"side {side}": (_circle(16), targets[side]) for side in _SIDES}
        self.measure(0)

    def measure(self, turn: int) -> dict[str, float]:
        return {name: 1e6 * _seconds(*case) for name, case in self._cases.items()}


def _seconds(mesh: PolyMesh, target: RefitTarget) -> float:
    began = time.process_time()
    for _ in range(_REPEATS):
        refit(mesh, target, THOROUGH)
    return (time.process_time() - began) / _REPEATS


def _circle(n: int) -> PolyMesh:
    angles = 2.0 * np.pi * np.arange(n) / n
    return PolyMesh.from_faces(0.5 + 0.35 * np.column_stack((np.cos(angles), np.sin(angles))), [tuple(range(n))])


def _star() -> Silhouette:
    y, x = (np.mgrid[:512, :512] + 0.5) / 512.0 - 0.5
    return Silhouette(np.hypot(x, y) < 0.3 + 0.08 * np.cos(7.0 * np.arctan2(y, x)))
