"""`dr-simple` and `dr-complex`: the paper's baselines, which move the vertices of a mesh and never change its topology.

Their construction sequences have no steps: the mesh that they start from is the result.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from agents.base import WholeAgent
from agents.budget import Meter
from agents.extras import require
from agents.finish import finish
from agents.solution import Solution
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh
from autopoly_env.refit import FROM_AFAR, RefitTarget, refit
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.simulator import Simulator, State


@dataclass(frozen=True)
class DrSimpleConfig:
    """How the vertices are moved."""

    refit: Literal["least_squares", "gradient"] = "least_squares"  # "gradient": as the paper does it; needs torch
    iterations: int = 200  # of "gradient", the paper's number
    # Of "gradient": about how far, in the unit square, a vertex goes in an iteration. From 0.002 to 0.04 the r_all of
    # `dr-simple` grows with it and that of `dr-complex` falls, which crosses itself ever more.
    learning_rate: float = 0.01

    def __post_init__(self) -> None:
        if self.iterations < 1:
            raise ConfigError(f"iterations = {self.iterations}: expected at least 1")
        if not 0.0 < self.learning_rate < 1.0:
            raise ConfigError(f"learning_rate = {self.learning_rate}: expected above 0 and below 1, the picture's side")


@dataclass(frozen=True)
class DrComplexConfig(DrSimpleConfig):
    """Which grid `dr-complex` refits, and how."""

    n: int = 3  # quads a side
    allow_defects: bool = False  # new self-intersections and flipped faces, which the paper's refit lets happen

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 1 <= self.n <= 5:
            raise ConfigError(f"n = {self.n}: expected a grid of 1 to 5 quads a side")


class FixedTopologyAgent(WholeAgent):
    """Returns the one state that it is made with."""

    takes_faces = True  # a refit keeps the rule that a rectangle and a grid keep

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
        return finish(simulator, [state], meter, keep_steps=True)


class DescentAgent(WholeAgent):
    """Gradient descent from a grid of n x n quads, counted as one refit; its result is not polished afterwards."""

    takes_faces = True

    def __init__(self, name: str, config: DrSimpleConfig, n: int, allow_defects: bool) -> None:
        require("learn", f"agent {name!r} with refit=gradient", "torch")
        self.name = name
        self._config, self._n, self._allow_defects = config, n, allow_defects

    def _find(self, simulator: Simulator, meter: Meter) -> Solution:
        """The best mesh on the way, whatever the budget; Ctrl-C ends the way."""
        from agents.baselines.descent import Descent

        target = simulator.silhouette.target(simulator.resolution)
        start = _grid_over(simulator, self._n)
        descent = Descent(start, target, self._config.learning_rate, self._allow_defects, simulator.faces)
        try:
            descent.run(self._config.iterations)
            meter.count(1, simulator.score(descent.mesh).total)
        except KeyboardInterrupt:
            meter.stopped_by = "interrupted"
        score = simulator.final_score(descent.mesh)
        settings = {**simulator.settings(), "scored_at": simulator.silhouette.resolution}
        sequence = ConstructionSequence.record(settings, descent.mesh, score.as_dict(), [])
        return Solution(sequence, descent.mesh, score, meter.stats())


def dr_simple(config: DrSimpleConfig) -> WholeAgent:
    """The refitted rectangle."""
    if config.refit == "gradient":
        return DescentAgent("dr-simple", config, 1, allow_defects=False)
    return FixedTopologyAgent("dr-simple", Simulator.initial)


def dr_complex(config: DrComplexConfig) -> WholeAgent:
    """A refitted grid of n x n quads."""
    if config.refit == "gradient":
        return DescentAgent("dr-complex", config, config.n, config.allow_defects)

    def refitted(simulator: Simulator) -> State:
        target = RefitTarget.of(simulator.silhouette, simulator.resolution)
        effort = replace(FROM_AFAR, keep_defects=config.allow_defects)
        mesh = refit(_grid_over(simulator, config.n), target, effort, faces=simulator.faces).mesh
        return State(mesh, simulator.score(mesh))

    return FixedTopologyAgent("dr-complex", refitted)


def _grid_over(simulator: Simulator, n: int) -> PolyMesh:
    """A grid over the target's bounding box."""
    rows, columns = np.nonzero(simulator.silhouette.mask)
    size = simulator.silhouette.resolution
    x0, y0, x1, y1 = columns.min(), rows.min(), columns.max() + 1, rows.max() + 1
    return PolyMesh.grid(n, x0 / size, y0 / size, x1 / size, y1 / size)
