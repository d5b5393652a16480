"""Search among outlines that are cut into quads: climbs from traced outlines, then hops from top to top."""

import math
from collections.abc import Iterable, Iterator
from itertools import chain, islice

import numpy as np

from agents.budget import Meter
from agents.climb.coarsened import variants
from agents.quads.hill import QuadHill, QuadPlace, total_of
from agents.trace.agent import TraceAgent, TraceConfig
from agents.trace.reach import Reach
from agents.trace.rings import Ring, trace_rings
from autopoly_env.refit import LOCAL, THOROUGH

_PRICES = (0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 6.0)  # of a vertex, of what it costs without inner edges
_REACH = Reach(more_than_quads=True, holes=True, parts=True, triangles=True, n_steps=10_000)
_N_SEEDS = 8  # of traced outlines
_N_OWN = 2  # of the silhouette as it is, before thin parts and gaps are looked at
_ROUGH = 128  # pixels a side, by which thin parts and gaps are seen
_PER_OCTAVE = 2.0  # kinds of outlines in each doubling of their vertices
_N_HOLES = 3  # so many holes at most are left out of all but one of the contours that outlines are made of
_N_FIRST = 5  # of them that are climbed from before anything else
_SEED_EVERY = 3  # hops, another one
_LOOK_EVERY = 10  # hops, all neighbours of the best top are tried
_N_AT_ONCE = 16  # of the neighbours
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
    price = _price(hill)
    seeds = _seeds(hill, meter)
    arms: list[QuadPlace] = []
    for seed in islice(seeds, _N_FIRST):
        arms.append(climbed(hill, seed, meter))
        yield arms[-1]
    best, n_tried, failures, n_hops = max(map(total_of, arms), default=float("-inf")), [0] * len(arms), 0, 0
    looked: set[float] = set()
    while arms and failures < patience and not meter.spent():
        n_hops += 1
        failures += 1
        another = next(seeds, None) if n_hops % _SEED_EVERY == 0 else None
        unlooked = [arm for arm in arms if arm.total not in looked]
        top: QuadPlace | None
        if another is not None:
            top = climbed(hill, another, meter)
        elif n_hops % _LOOK_EVERY == 0 and unlooked:
            chosen = max(unlooked, key=total_of)
            looked.add(chosen.total)
            top = _looked_around(hill, chosen, meter)
        else:
            k = max(range(len(arms)), key=lambda k: arms[k].total - _FATIGUE * price * n_tried[k])
            n_tried[k] += 1
            top = _hop_from(hill, arms[k], _HOPELESS * price, rng, meter)
        if top is None or any(abs(top.total - arm.total) < _SAME for arm in arms):
            continue
        arms.append(top)
        n_tried.append(0)
        yield top
        if top.total > best + _SAME:
            best, failures = top.total, 0


def climbed(hill: QuadHill, place: QuadPlace, meter: Meter) -> QuadPlace:
    """The place above, by moving to the best of a few promising neighbours while one is better."""
    while not meter.spent():
        outlines, best = hill.neighbours(place, _N_BLAMED)[:_N_TRIED], place
        for first in range(0, len(outlines), _N_AT_ONCE):
            places = hill.fit(meter.affordable(outlines[first : first + _N_AT_ONCE]), LOCAL, place.score.iou)
            best = max([place, *places], key=total_of)
            meter.count(len(places), best.total, best.mesh)
            if best.total > place.total + _LEAST_GAIN or meter.spent():
                break
        if best.total <= place.total + _LEAST_GAIN:
            break
        place = best
    return place


def _looked_around(hill: QuadHill, place: QuadPlace, meter: Meter) -> QuadPlace | None:
    """The top above the best of all neighbours, the most hopeful refitted harder; None if none is better."""
    outlines = meter.affordable(hill.neighbours(place, 2 * _N_BLAMED))
    places = hill.fit(outlines, LOCAL, place.score.iou)
    hopeful = sorted(places, key=total_of, reverse=True)[:_N_THOROUGH]
    places += hill.fit([*(p.outline for p in hopeful), place.outline], THOROUGH, place.score.iou)
    best = max(places, key=total_of)
    meter.count(len(places), best.total, best.mesh)
    if best.total <= place.total + _LEAST_GAIN:
        return None
    return climbed(hill, best, meter)


def _hop_from(
    hill: QuadHill, top: QuadPlace, most_lost: float, rng: np.random.Generator, meter: Meter
) -> QuadPlace | None:
    """The top above a shaken outline; None if it has lost too much."""
    [place] = hill.fit([hill.shaken(top, rng)], THOROUGH, top.score.iou)
    meter.add_simulation(1)
    meter.count(1, place.total, place.mesh)
    if place.total <= top.total - most_lost:
        return None
    return climbed(hill, place, meter)


def _price(hill: QuadHill) -> float:
    """Of an element, as losses are measured."""
    return max(hill.simulator.weights.w_sc, _LEAST_PRICE)


def _seeds(hill: QuadHill, meter: Meter) -> Iterator[QuadPlace]:
    """Traced outlines to climb from: of the silhouette, with fewer holes, and with thin parts or gaps gone."""
    rings = trace_rings(hill.simulator.silhouette)
    n_outer = sum(not ring.is_hole for ring in rings)
    fewer = [rings[:n] for n in range(n_outer, min(len(rings), n_outer + _N_HOLES))]
    own = _fitted(hill, [rings, *fewer], meter)
    first = _best_of_each_kind(own, hill)[:_N_OWN]
    yield from first
    changed = variants(hill.simulator.silhouette, _ROUGH)
    others = _best_of_each_kind(own + _fitted(hill, map(trace_rings, changed), meter), hill)
    yield from [place for place in others if all(place is not known for known in first)][:_N_SEEDS]


def _fitted(hill: QuadHill, contours: Iterable[list[Ring]], meter: Meter) -> list[QuadPlace]:
    """The outlines of some contours at all prices, refitted."""
    places: list[QuadPlace] = []
    for rings in contours:
        if meter.spent():
            break
        swept = TraceAgent(TraceConfig(prices=_PRICES)).sweep(hill.simulator, rings, _REACH)
        outlines = meter.affordable(list(chain.from_iterable(map(hill.symmetric, swept))))
        iou = max((hill.place(outline).score.iou for outline in outlines), default=1.0)
        places += hill.fit(outlines, LOCAL, iou)
        best = max(places, key=total_of, default=None)
        if best is None:
            meter.count(len(outlines), float("-inf"))
        else:
            meter.count(len(outlines), best.total, best.mesh)
    return places


def _best_of_each_kind(places: Iterable[QuadPlace], hill: QuadHill) -> list[QuadPlace]:
    """The best with each number of rings, then with each number of vertices, about, then the others."""
    ordered = sorted(places, key=total_of, reverse=True)
    least = ordered[0].total - _HOPELESS * _price(hill) if ordered else 0.0
    seen: set[tuple[int, ...]] = set()
    tiers: tuple[list[QuadPlace], ...] = ([], [], [])
    for place in ordered:
        n_rings, octave = len(place.outline.rings), round(_PER_OCTAVE * math.log2(len(place.outline.loops.vertices)))
        tier = 2
        if place.total > least and (n_rings, octave) not in seen:
            tier = int((n_rings,) in seen)
        seen |= {(n_rings,), (n_rings, octave)}
        if all(abs(place.total - other.total) > _SAME for other in chain.from_iterable(tiers)):
            tiers[tier].append(place)
    return list(chain.from_iterable(tiers))
