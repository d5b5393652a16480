"""`climb`: hill climbing on outlines, from the best that tracing and greedy search have found.

Of two meshes with the same outline the score prefers the one with fewer inner edges, so the search moves among outlines
(rings of vertices) and builds a mesh only in the end. Every neighbour of an outline is refitted before it is judged.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain

from agents.base import WholeAgent
from agents.baselines.beam import BeamAgent, BeamConfig
from agents.budget import Meter
from agents.climb.hill import LEAST_GAIN, Hill, Place, total_of
from agents.climb.moves import neighbours, relocations
from agents.climb.tops import Tops
from agents.finish import finish
from agents.solution import Solution
from agents.trace.agent import TraceAgent, TraceConfig
from autopoly_env.refit import LOCAL, THOROUGH
from autopoly_env.simulator import Simulator


@dataclass(frozen=True)
class ClimbConfig:
    """How `climb` searches."""

    n_seeds: int = 3  # traced outlines of different sizes to climb from, the best first
    with_greedy: bool = True  # climb from what greedy search finds, too
    n_blamed: int = 8  # edges to add vertices to, those with most blame
    n_thorough: int = 4  # neighbours that are refitted again, harder, before a top is taken for one
    n_relocated: int = 3  # edges that a vertex may be moved to from elsewhere when nothing simpler improves
    n_rounds: int = 60


class ClimbAgent(WholeAgent):
    """Traces and searches greedily, then climbs from each result; returns the best."""

    name = "climb"
    config_class = ClimbConfig

    def __init__(self, config: ClimbConfig) -> None:
        self._config = config

    def _find(self, simulator: Simulator, meter: Meter) -> Solution:
        tops = Tops(Hill(simulator))
        candidates = []
        try:
            for seed in self._traced(tops.hill, meter):
                self._climb(tops, seed, meter)
            if self._config.with_greedy and not meter.spent():
                solution = BeamAgent(BeamConfig(width=1)).solve(simulator, meter.rest())
                candidates.append(solution)
                meter.count(solution.stats.n_refits, solution.score.total, lambda: solution.mesh)
                if solution.stats.stopped_by == "interrupted":
                    raise KeyboardInterrupt
                found = tops.add_mesh(solution.mesh)
                if found is not None:
                    self._climb(tops, found, meter)
        except KeyboardInterrupt:
            meter.stopped_by = "interrupted"
        if tops.places():
            candidates.append(finish(simulator, tops.built(), meter))
        if not candidates:
            return finish(simulator, [simulator.initial()], meter)
        best = max(candidates, key=lambda candidate: simulator.worth(candidate.mesh))
        return Solution(best.sequence, best.mesh, best.score, meter.stats())

    def _climb(self, tops: Tops, seed: Place, meter: Meter) -> None:
        """Climb from a seed, and keep what is come by."""
        for place in chain([seed], climb(tops.hill, seed, self._config, meter)):
            tops.add(place)

    def _traced(self, hill: Hill, meter: Meter) -> Iterator[Place]:
        sizes: set[int] = set()
        places = map(hill.place, list(TraceAgent(TraceConfig()).outlines(hill.simulator, meter)))
        for place in sorted(places, key=total_of, reverse=True):
            if place.score.complexity not in sizes and len(sizes) < self._config.n_seeds and not meter.spent():
                sizes.add(place.score.complexity)
                yield place


def climb(hill: Hill, place: Place, config: ClimbConfig, meter: Meter) -> Iterator[Place]:
    """Move to the best neighbour while one is better, looking harder before giving up; yield every place on the way."""
    for _ in range(config.n_rounds):
        if meter.spent() or place.outline.is_fine:
            return
        places = fitted_neighbours(hill, place, config.n_blamed, meter)
        n_fits = len(places)
        best = max(places, key=total_of, default=place)
        if best.total <= place.total + LEAST_GAIN:
            hopeful = sorted(places, key=total_of, reverse=True)[: config.n_thorough]
            places = hill.fit([*(p.outline for p in hopeful), place.outline], THOROUGH, place.score.iou)
            moved = relocations(place.outline, hill.simulator.silhouette, config.n_relocated)
            places += hill.fit(list(filter(hill.reach.allows, moved)), LOCAL, place.score.iou)
            n_fits += len(places)
            best = max(places, key=total_of)
        if best.total <= place.total + LEAST_GAIN:
            meter.count(n_fits, place.total, place.mesh)
            return
        place = best
        yield place
        meter.count(n_fits, place.total, place.mesh)


def fitted_neighbours(hill: Hill, place: Place, n_blamed: int, meter: Meter) -> list[Place]:
    """The neighbours of a place that can be built, refitted; as many as refits are left for, and not counted yet."""
    found = neighbours(place.outline, hill.simulator.silhouette, hill.contours, n_blamed, holes=hill.reach.holes)
    return hill.fit(meter.affordable(filter(hill.reach.allows, found)), LOCAL, place.score.iou)
