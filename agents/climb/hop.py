"""Basin hopping: shake a top, climb again, keep what is found as one more top to hop from.

After Wales and Doye 1997, but the tops are the arms of a bandit: the best ones are shaken most, none is given up.
"""

from collections.abc import Iterator
from itertools import chain

import numpy as np

from agents.budget import Meter
from agents.climb.agent import ClimbConfig, climb, fitted_neighbours
from agents.climb.coarsened import variants
from agents.climb.hill import LEAST_GAIN, Hill, Place, total_of
from agents.climb.moves import shaken
from agents.trace.agent import TraceAgent, TraceConfig
from agents.trace.rings import trace_rings
from autopoly_env.refit import LOCAL, THOROUGH

_N_VARIANTS = 6  # outlines of changed silhouettes that are climbed from, the best ones
_N_BLAMED = 4  # edges to add vertices to on the way up from a shaken outline
_FATIGUE = 0.1  # what an arm loses by being tried, in prices of an element
_HOPELESS = 12.0  # prices of an element below its top at which a shaken outline is not climbed from
_LEAST_PRICE = 0.05  # of an element, where the weights have none
_SAME = 1e-4  # totals that agree to this are those of one top


def hop(hill: Hill, tops: list[Place], patience: int, rng: np.random.Generator, meter: Meter) -> Iterator[Place]:
    """What may be a better top, until `patience` hops in a row have found none; `tops` are those known already."""
    price = max(hill.simulator.weights.w_sc, _LEAST_PRICE)
    arms = [top for top in tops if not top.outline.is_fine]
    for seed in _variant_seeds(hill, meter) if arms else ():
        arms.append(seed)
        for place in chain([seed], climb(hill, seed, ClimbConfig(), meter)):
            arms[-1] = place
            yield place
    best = max((arm.total for arm in arms), default=float("-inf"))
    n_tried, failures = [0] * len(arms), 0
    while arms and failures < patience and not meter.spent():
        k = max(range(len(arms)), key=lambda k: arms[k].total - _FATIGUE * price * n_tried[k])
        n_tried[k] += 1
        failures += 1
        top = _hop_from(hill, arms[k], _HOPELESS * price, rng, meter)
        if top is None or any(abs(top.total - arm.total) < _SAME for arm in arms):
            continue
        arms.append(top)
        n_tried.append(0)
        if top.total > best + _SAME:
            best, failures = top.total, 0
            yield top


def _variant_seeds(hill: Hill, meter: Meter) -> list[Place]:
    """The best outlines of changed silhouettes, of each number of vertices in each ring one."""
    seeds: dict[tuple[int, ...], Place] = {}
    for variant in variants(hill.simulator.silhouette):
        for outline in TraceAgent(TraceConfig()).sweep(hill.simulator, trace_rings(variant)):
            if meter.spent() or outline.is_fine:
                break
            [place] = hill.fit([outline], LOCAL, hill.place(outline).score.iou)
            meter.count(1, place.total, place.mesh)
            sizes = tuple(sorted(len(ring.points) for ring in outline.rings))
            if sizes not in seeds or seeds[sizes].total < place.total:
                seeds[sizes] = place
    return sorted(seeds.values(), key=total_of, reverse=True)[:_N_VARIANTS]


def _hop_from(hill: Hill, top: Place, most_lost: float, rng: np.random.Generator, meter: Meter) -> Place | None:
    """The top above a shaken outline; None if it cannot be built or has lost too much."""
    outline = shaken(top.outline, hill.simulator.silhouette, rng)
    if not hill.reach.allows(outline):
        return None
    [place] = hill.fit([outline], THOROUGH, top.score.iou)
    meter.add_simulation(1)
    meter.count(1, place.total, place.mesh)
    return _descend(hill, place, meter) if place.total > top.total - most_lost else None


def _descend(hill: Hill, place: Place, meter: Meter) -> Place:
    """Move to the best neighbour while one is better, without looking hard."""
    while not meter.spent():
        places = fitted_neighbours(hill, place, _N_BLAMED, meter)
        best = max(places, key=total_of, default=place)
        meter.count(len(places), best.total, best.mesh)
        if best.total <= place.total + LEAST_GAIN:
            return place
        place = best
    return place
