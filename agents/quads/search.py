"""Search among outlines that are cut into quads: climbs from traced outlines, then hops from top to top."""

from collections.abc import Iterator
from itertools import chain

import numpy as np

from agents.budget import Meter
from agents.climb.coarsened import variants
from agents.quads.hill import QuadHill, QuadPlace, total_of
from agents.trace.agent import TraceAgent, TraceConfig
from agents.trace.outline import Outline
from agents.trace.rings import trace_rings
from autopoly_env.refit import LOCAL, THOROUGH

_PRICES = (0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 6.0)  # of a vertex, of what it costs without inner edges
_N_SEEDS = 5  # of traced outlines
_N_TRIED = 16  # neighbours that are refitted before it is seen whether one is better
_N_BLAMED = 6
_N_THOROUGH = 4
_FATIGUE = 0.15  # what an arm loses by being tried, in prices of an element
_HOPELESS = 12.0
_LEAST_PRICE = 0.05
_SAME = 1e-4
_LEAST_GAIN = 1e-9


def explore(hill: QuadHill, patience: int, rng: np.random.Generator, meter: Meter) -> Iterator[QuadPlace]:
    """Places worth keeping, until `patience` hops in a row found no better one."""
    price = max(hill.simulator.weights.w_sc, _LEAST_PRICE)
    arms: list[QuadPlace] = []
    for seed in _seeds(hill, meter):
        for place in climb(hill, seed, meter):
            if meter.spent():
                break
        arms.append(place)
        yield place
        if meter.spent():
            return
    best, n_tried, failures = max(map(total_of, arms), default=float("-inf")), [0] * len(arms), 0
    looked: set[float] = set()
    while arms and failures < patience and not meter.spent():
        k = max(range(len(arms)), key=lambda k: arms[k].total - _FATIGUE * price * n_tried[k])
        n_tried[k] += 1
        failures += 1
        if failures % 20 == 0:
            top = max((arm for arm in arms if arm.total not in looked), key=total_of, default=None)
            if top is not None:
                looked.add(top.total)
                top = _looked_around(hill, top, meter)
        else:
            top = _hop_from(hill, arms[k], _HOPELESS * price, rng, meter)
        if top is None or any(abs(top.total - arm.total) < _SAME for arm in arms):
            continue
        arms.append(top)
        n_tried.append(0)
        yield top
        if top.total > best + _SAME:
            best, failures = top.total, 0


def climb(hill: QuadHill, place: QuadPlace, meter: Meter) -> Iterator[QuadPlace]:
    """Move to the best of the most promising neighbours while one is better; yield every place on the way."""
    yield place
    while not meter.spent():
        outlines = meter.affordable(hill.neighbours(place, _N_BLAMED)[:_N_TRIED])
        places = hill.fit(outlines, LOCAL, place.score.iou)
        best = max(places, key=total_of, default=place)
        meter.count(len(places), max(best.total, place.total))
        if best.total <= place.total + _LEAST_GAIN:
            return
        place = best
        yield place


def _looked_around(hill: QuadHill, place: QuadPlace, meter: Meter) -> QuadPlace | None:
    """The top above the best of all neighbours, the most hopeful refitted harder; None if none is better."""
    outlines = meter.affordable(hill.neighbours(place, 2 * _N_BLAMED))
    places = hill.fit(outlines, LOCAL, place.score.iou)
    hopeful = sorted(places, key=total_of, reverse=True)[:_N_THOROUGH]
    places += hill.fit([*(p.outline for p in hopeful), place.outline], THOROUGH, place.score.iou)
    meter.count(len(places), place.total)
    best = max(places, key=total_of)
    if best.total <= place.total + _LEAST_GAIN:
        return None
    return list(climb(hill, best, meter))[-1]


def _hop_from(
    hill: QuadHill, top: QuadPlace, most_lost: float, rng: np.random.Generator, meter: Meter
) -> QuadPlace | None:
    """The top above a shaken outline; None if it has lost too much."""
    [place] = hill.fit([hill.shaken(top, rng)], THOROUGH, top.score.iou)
    meter.add_simulation(1)
    meter.count(1, place.total)
    if place.total <= top.total - most_lost:
        return None
    return list(climb(hill, place, meter))[-1]


def _seeds(hill: QuadHill, meter: Meter) -> Iterator[QuadPlace]:
    """The best outlines of the silhouette and of changed ones, of each number of vertices in each ring one."""
    for n_most, silhouettes in ((_N_SEEDS, [hill.simulator.silhouette]), (3, variants(hill.simulator.silhouette))):
        seeds: dict[tuple[int, ...], QuadPlace] = {}
        for silhouette in silhouettes:
            for outline in TraceAgent(TraceConfig(prices=_PRICES)).sweep(hill.simulator, trace_rings(silhouette)):
                if meter.spent():
                    break
                [place] = hill.fit([outline], LOCAL, hill.place(outline).score.iou)
                meter.count(1, place.total)
                sizes = tuple(sorted(len(ring.points) for ring in outline.rings))
                if sizes not in seeds or seeds[sizes].total < place.total:
                    seeds[sizes] = place
        yield from sorted(seeds.values(), key=total_of, reverse=True)[:n_most]
