"""`dr-simple` and `dr-complex`: the paper's baselines, which move the vertices of a mesh and never change its topology.

Their construction sequences have no steps: the mesh that they start from is the result.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from agents.base import Meter, Solution, WholeAgent, finish
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh
from autopoly_env.refit import FROM_AFAR, RefitTarget, refit
from autopoly_env.simulator import Simulator, State


@dataclass(frozen=True)
class DrSimpleConfig:
    """The rectangle leaves nothing to choose."""


@dataclass(frozen=True)
class DrComplexConfig:
    """Which grid `dr-complex` refits."""

    n: int = 3  # quads a side
    allow_defects: bool = False  # new self-intersections and flipped faces, which the paper's refit lets happen

    def __post_init__(self) -> None:
        if not 1 <= self.n <= 5:
            raise ConfigError(f"n = {self.n}: expected a grid of 1 to 5 quads a side")


class FixedTopologyAgent(WholeAgent):
    """Returns the one state that it is made with."""

    def __init__(self, name: str, refitted: Callable[[Simulator], State]) -> None:
        self.name = name
        self._refitted = refitted

    def _find(self, simulator: Simulator, meter: Meter) -> Solution:
        """The refitted mesh, whatever the budget."""
        state = self._refitted(simulator)
        try:
            meter.add([state])
        except KeyboardInterrupt:
            meter.stopped_by = "interrupted"
        return finish(simulator, [state], meter)


def dr_simple(_: DrSimpleConfig) -> FixedTopologyAgent:
    """The refitted rectangle."""
    return FixedTopologyAgent("dr-simple", Simulator.initial)


def dr_complex(config: DrComplexConfig) -> FixedTopologyAgent:
    """A refitted grid of n x n quads."""

    def refitted(simulator: Simulator) -> State:
        target = RefitTarget.of(simulator.silhouette, simulator.resolution)
        effort = replace(FROM_AFAR, keep_defects=config.allow_defects)
        mesh = refit(_grid_over(simulator, config.n), target, effort).mesh
        return State(mesh, simulator.score(mesh))

    return FixedTopologyAgent("dr-complex", refitted)


def _grid_over(simulator: Simulator, n: int) -> PolyMesh:
    """A grid over the target's bounding box."""
    rows, columns = np.nonzero(simulator.silhouette.mask)
    size = simulator.silhouette.resolution
    x0, y0, x1, y1 = columns.min(), rows.min(), columns.max() + 1, rows.max() + 1
    return PolyMesh.grid(n, x0 / size, y0 / size, x1 / size, y1 / size)
