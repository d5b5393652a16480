"""Climbing on outlines: moves, tops, variants, and hops from one top to the next."""

import numpy as np
import pytest
import shapely

from agents.budget import Budget, Meter
from agents.climb.agent import ClimbConfig, climb
from agents.climb.coarsened import variants
from agents.climb.hill import Hill, Place
from agents.climb.hop import hop
from agents.climb.moves import neighbours, shaken
from agents.climb.tops import Tops
from agents.trace.outline import Outline
from agents.trace.rings import Ring
from autopoly_env.mesh import PolyMesh
from autopoly_env.score import ScoreWeights
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator
from tests.helpers.solving import simulator

BOX = np.array([(0.2, 0.2), (0.8, 0.2), (0.8, 0.8), (0.2, 0.8)])


def outline(*rings: np.ndarray) -> Outline:
    return Outline(tuple(Ring(points, -1) for points in rings))


def dumbbell() -> Silhouette:
    """Two discs joined by a bar two pixels wide, in 128 x 128."""
    y, x = np.mgrid[:128, :128]
    discs = ((x - 34) ** 2 + (y - 64) ** 2 < 24**2) | ((x - 94) ** 2 + (y - 64) ** 2 < 24**2)
    return Silhouette(discs | ((abs(y - 64) <= 1) & (x > 34) & (x < 94)))


def test_variants__open_a_thin_bar_and_close_a_thin_gap() -> None:
    from skimage.measure import label

    n_parts = [label(variant.mask).max() for variant in variants(dumbbell())]
    assert n_parts[0] == 2  # the bar is gone with the smallest disc that does not fit into it
    gap = np.zeros((128, 128), np.bool_)
    gap[20:100, 20:100] = True
    gap[:, 60:62] = False
    assert 1 in [label(variant.mask).max() for variant in variants(Silhouette(gap))]


def test_variants__of_what_is_neither_thin_nor_notched_differ_at_the_corners_only() -> None:
    mask = np.zeros((64, 64), np.bool_)
    mask[16:48, 16:48] = True
    for variant in variants(Silhouette(mask)):
        assert np.logical_xor(variant.mask, mask).mean() < 0.01


def test_neighbours__of_a_perfect_box_have_a_vertex_less() -> None:
    mask = np.zeros((40, 40), np.bool_)
    mask[8:32, 8:32] = True
    found = list(neighbours(outline(BOX), Silhouette(mask), [], 8, holes=True))
    assert [len(o.rings[0].points) for o in found] == [3, 3, 3, 3]


def test_neighbours__add_vertices_at_the_edge_to_blame() -> None:
    mask = np.zeros((40, 40), np.bool_)
    mask[8:32, 8:32] = True
    mask[2:8, 16:24] = True  # a chimney that the box does not show
    found = list(neighbours(outline(BOX), Silhouette(mask), [], 1, holes=False))
    assert sorted(len(o.rings[0].points) for o in found) == [3, 3, 3, 3, 5, 6]
    grown = next(o for o in found if len(o.rings[0].points) == 5)
    new = next(p for p in grown.rings[0].points if not (p == BOX).all(axis=1).any())
    assert new[1] < 0.2 and 0.35 < new[0] < 0.65  # up into the chimney


def test_shaken__is_another_outline_and_depends_on_the_draw_only() -> None:
    silhouette = simulator("blobs").silhouette
    ring = 0.5 + 0.3 * np.array([(np.cos(a), np.sin(a)) for a in np.arange(8) * np.pi / 4])
    twice = [shaken(outline(ring), silhouette, np.random.default_rng(3)) for _ in range(2)]
    assert np.array_equal(twice[0].rings[0].points, twice[1].rings[0].points)
    different = [shaken(outline(ring), silhouette, np.random.default_rng(k)).rings[0].points for k in range(20)]
    assert sum(p.shape == ring.shape and np.array_equal(p, ring) for p in different) < 10
    assert all(len(p) >= 3 for p in different)


def test_place__is_scored_at_the_silhouettes_own_resolution() -> None:
    mask = np.zeros((90, 90), np.bool_)
    mask[18:72, 18:72] = True
    game = Simulator(Silhouette(mask), resolution=32, weights=ScoreWeights(w_sc=1.0))
    place = Hill(game).place(outline(BOX))
    exact = shapely.box(0.2, 0.2, 0.8, 0.8).area / mask.mean()
    assert place.score.iou == pytest.approx(exact) and place.total == pytest.approx(100 * exact - 9)


def test_climb__goes_up_all_the_way_and_says_every_place() -> None:
    hill, meter = Hill(simulator("house")), Meter.unlimited()
    start = hill.place(outline(BOX))
    totals = [place.total for place in climb(hill, start, ClimbConfig(), meter)]
    assert totals == sorted(totals) and totals[0] > start.total


def test_climb__does_no_more_refits_than_are_left() -> None:
    hill = Hill(simulator("house"))
    meter = Meter(Budget(refits=3))
    list(climb(hill, hill.place(outline(BOX)), ClimbConfig(n_thorough=1, n_relocated=0), meter))
    assert meter.stats().n_refits <= 5  # a last look at what there is


def test_tops__keep_the_best_each_once() -> None:
    hill = Hill(simulator("house"))
    tops = Tops(hill)
    places = [hill.place(outline(BOX * scale)) for scale in (0.5, 1.0, 0.8, 1.0, 0.9, 0.6, 0.7, 0.4)]
    for place in places:
        tops.add(place)
    kept = [place.total for place in tops.places()]
    assert kept == sorted({place.total for place in places}, reverse=True)[:6]


def test_tops__take_the_outline_of_a_mesh() -> None:
    tops = Tops(Hill(simulator("house")))
    place = tops.add_mesh(PolyMesh.grid(2, 0.2, 0.2, 0.8, 0.8))
    assert isinstance(place, Place) and len(place.outline.rings[0].points) == 8


def test_tops__build_nothing_that_is_out_of_reach() -> None:
    game = simulator("house", operators="paper", max_steps=1)
    extruded = max(game.transition_all(game.initial()), key=lambda state: len(state.mesh.vertices)).mesh
    assert extruded.counts == (6, 7, 2)  # one step, whose outline takes two
    tops = Tops(Hill(game))
    tops.add_mesh(extruded)
    assert len(tops.built()) == 1
    tops.add(tops.hill.place(outline(np.insert(BOX, 1, (0.5, 0.05), axis=0))))
    assert len(tops.built()) == 2


def hopped(seed: int, patience: int = 15, budget: Budget | None = None) -> list[float]:
    hill = Hill(Simulator(dumbbell(), resolution=64, weights=ScoreWeights(w_sc=1.0)))
    meter = Meter(budget or Budget())
    found = hop(hill, [hill.place(outline(BOX))], patience, np.random.default_rng(seed), meter)
    return [place.total for place in found]


@pytest.mark.slow
def test_hop__finds_better_tops_and_the_same_ones_for_a_seed() -> None:
    first = hopped(0)
    assert max(first) > 65.0  # the box that it begins with is worth 28.7
    assert hopped(0) == first


def test_hop__stops_at_the_budget() -> None:
    assert hopped(0, patience=10**6, budget=Budget(refits=0)) == []
    assert len(hopped(0, patience=10**6, budget=Budget(refits=400))) > 0


def test_neighbours__open_a_hole_where_its_rim_is_thinnest() -> None:
    hole = np.array([(0.3, 0.3), (0.3, 0.6), (0.75, 0.6), (0.75, 0.3)])  # wound backwards, nearest to the right
    ring = Outline((Ring(BOX, -1), Ring(hole, 0)))
    mask = np.zeros((40, 40), np.bool_)
    mask[8:32, 8:32] = True
    mask[12:24, 12:30] = False
    found = neighbours(ring, Silhouette(mask), [], 1, holes=True)
    opened = next(o for o in found if len(o.rings) == 1 and len(o.rings[0].points) == 8)
    polygon = shapely.Polygon(opened.rings[0].points)
    assert polygon.is_valid and polygon.exterior.is_ccw  # as shoelace counts, y down
    assert not polygon.contains(shapely.Point(0.78, 0.45)) and polygon.contains(shapely.Point(0.25, 0.45))
