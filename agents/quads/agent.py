"""`quads`: a mesh of convex quads and few triangles, modelled from the main body outwards.

Outlines are searched at the price that their vertices have once they are cut into quads (`search`), cut (`partition`),
refitted under the rule of faces, and told in the order of modelling (`telling`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from agents.base import WholeAgent
from agents.budget import Budget, Meter, Progress
from agents.finish import finish
from agents.quads.building import OPERATORS, build
from agents.quads.hill import QuadHill, QuadPlace, total_of
from agents.quads.search import explore
from agents.solution import Solution
from agents.trace.construct import UnbuildableError
from autopoly_env.compute import map_threads
from autopoly_env.errors import ConfigError
from autopoly_env.simulator import Simulator, State


@dataclass(frozen=True)
class QuadsConfig:
    """How `quads` searches."""

    patience: int = 120  # hops in a row, from outline to outline, that may fail to find a better one
    n_polished: int = 8  # of the best outlines, that are refitted at the silhouette's own resolution
    n_refits: int = 600  # where the budget sets no limit
    seed: int = 0

    def __post_init__(self) -> None:
        for name, least in {"patience": 0, "n_polished": 1, "n_refits": 1, "seed": 0}.items():
            if getattr(self, name) < least:
                raise ConfigError(f"{name} = {getattr(self, name)}: expected at least {least}")


class QuadsAgent(WholeAgent):
    """Searches outlines as meshes of quads, and builds the best."""

    name = "quads"
    takes_faces = True
    takes_symmetry = True
    config_class = QuadsConfig

    def __init__(self, config: QuadsConfig) -> None:
        self._config = config

    def check(self, simulator: Simulator) -> None:
        """As every agent; raises ConfigError also where the operators cannot tell quads, or faces may be any."""
        super().check(simulator)
        missing = [name for name in OPERATORS if name not in simulator.operators]
        if missing:
            raise ConfigError(
                f"quads builds with {', '.join(OPERATORS)}, and {missing[0]} is not among the operators: "
                "give the preset modeller"
            )
        if simulator.faces == "any":
            raise ConfigError("quads builds convex faces: give faces=quads or convex")

    def solve(
        self,
        simulator: Simulator,
        budget: Budget | None = None,
        on_progress: Callable[[Progress], None] | None = None,
    ) -> Solution:
        """As every agent. A budget without limits is one of `config.n_refits`."""
        if budget is None or budget == Budget():
            budget = Budget(self._config.n_refits)
        return super().solve(simulator, budget, on_progress)

    def _find(self, simulator: Simulator, meter: Meter) -> Solution:
        hill = QuadHill(simulator)
        places: list[QuadPlace] = []
        try:
            rng = np.random.default_rng(self._config.seed)
            for place in explore(hill, self._config.patience, rng, meter):
                places.append(place)
        except KeyboardInterrupt:
            meter.stopped_by = "interrupted"
        states = best_build(hill, places, self._config.n_polished)
        if not states:
            return finish(simulator, [simulator.initial()], meter, keep_steps=True)
        return finish(simulator, states, meter, keep_steps=True, keep_shape=True)


def best_build(hill: QuadHill, places: Sequence[QuadPlace], n_polished: int) -> list[State]:
    """The construction of the best places, polished, that is worth most within the step limit; empty if none can be."""
    distinct = {place.total: place for place in places if place.partition is not None}
    best = sorted(distinct.values(), key=total_of, reverse=True)[:n_polished]
    meshes = [mesh for found in map_threads(hill.polished, best) for mesh in found]
    worth = [hill.simulator.worth(mesh) for mesh in meshes]
    chosen: list[State] = []
    most = float("-inf")
    for k in sorted(range(len(meshes)), key=lambda k: -worth[k]):
        if worth[k] <= most:
            break
        try:
            states = build(hill.simulator, meshes[k])[: hill.simulator.max_steps + 1]
        except UnbuildableError:
            continue
        ends = [state.mesh for state in states if hill.simulator.guidance.is_symmetric(state.mesh)]
        total = max(map(hill.simulator.worth, ends), default=most)
        if total > most:
            chosen, most = states, total
    return chosen
