"""The agent: what it builds of small drawings, under the rule, within its budget, and what it refuses."""

import numpy as np
import pytest
import shapely

from agents.budget import Budget, Meter
from agents.quads.agent import QuadsAgent, QuadsConfig
from agents.quads.hill import QuadHill
from agents.quads.moves import merged, quad_neighbours, quad_shaken, without
from agents.quads.partition import partitioned
from agents.quads.search import explore
from agents.registry import make_agent
from agents.trace.outline import Outline
from agents.trace.rings import Ring
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import broken_faces
from autopoly_env.simulator import Simulator
from tests.helpers.drawings import painted
from tests.helpers.rings import BOX, hole, regular, small
from tests.helpers.solving import simulator

QUADS = {"operators": "modeller", "faces": "quads"}


def game(target: str = "house", **settings: object) -> Simulator:
    return simulator(target, **{**QUADS, **settings})


def test_frame__is_a_ring_of_four_quads() -> None:
    solution = make_agent("quads").solve(game("frame"), Budget(150))
    assert [len(face) for face in solution.mesh.faces] == [4, 4, 4, 4]
    assert [step.operator for step in solution.sequence.steps] == ["edge_extrude", "edge_extrude", "edge_fill"]
    assert solution.score.iou > 0.97


def test_two_squares__are_two_quads() -> None:
    solution = make_agent("quads").solve(game("two squares"), Budget(150))
    assert [len(face) for face in solution.mesh.faces] == [4, 4]
    assert solution.mesh.topology.n_components == 2


@pytest.mark.slow
@pytest.mark.parametrize("target", ["house", "L", "island", "blobs"])
def test_every_mesh__keeps_the_rule(target: str) -> None:
    solution = make_agent("quads").solve(game(target), Budget(150))
    assert all(broken_faces(mesh, "quads") == [] for mesh in solution.sequence.meshes())
    assert solution.score.total > 0.0 and solution.score.self_intersections == 0


def test_mcts__goes_on_from_it_under_the_rule() -> None:
    alone = make_agent("quads").solve(game("island"), Budget(90))
    both = make_agent("mcts", n_simulations=2, patience=1).solve(game("island"), Budget(150))
    assert both.score.total >= alone.score.total - 1e-9
    assert all(broken_faces(mesh, "quads") == [] for mesh in both.sequence.meshes())


@pytest.mark.slow
def test_ladder__is_built_with_all_of_its_holes() -> None:
    """Its rings can be closed in some orders only: where two corners meet beside an edge that both faces have."""
    ladder = shapely.box(0.3, 0.1, 0.7, 0.9)
    for k in range(4):
        ladder -= shapely.box(0.36, 0.16 + 0.18 * k, 0.64, 0.28 + 0.18 * k)
    crooked = shapely.affinity.rotate(ladder, 8.0)
    target = Simulator(painted(crooked, 256), **QUADS)  # type: ignore[arg-type]
    solution = make_agent("quads").solve(target, Budget(300))
    assert solution.mesh.topology.n_holes == 4 and solution.score.iou > 0.95


@pytest.mark.slow
def test_seed__decides_and_nothing_else() -> None:
    first, again, other = (make_agent("quads", seed=seed).solve(game("blobs"), Budget(200)) for seed in (0, 0, 7))
    assert first.sequence.to_json() == again.sequence.to_json()
    assert other.score.total > 0.0


def test_operators_that_are_missing__are_named() -> None:
    with pytest.raises(ConfigError, match="edge_cap is not among the operators: give the preset modeller"):
        make_agent("quads").solve(simulator())
    with pytest.raises(ConfigError, match="quads builds convex faces: give faces=quads or convex"):
        make_agent("quads").solve(simulator(operators="modeller"))
    assert not QuadsAgent(QuadsConfig()).suits(simulator())
    assert QuadsAgent(QuadsConfig()).suits(game())


def test_settings_out_of_range__are_refused() -> None:
    with pytest.raises(ConfigError, match="n_polished = 0: expected at least 1"):
        make_agent("quads", n_polished=0)


def test_search__never_gets_worse_and_minds_its_budget() -> None:
    hill, meter = QuadHill(game("island")), Meter(Budget(80))
    places = list(explore(hill, 20, np.random.default_rng(0), meter))
    assert places and meter.spent()
    assert meter.stats().n_refits < 80 + 40  # one step of work may be more


def test_bent_place__has_fewer_faces_and_is_worth_what_it_says() -> None:
    tablet = [(0.1, 0.2), (0.9, 0.2), (0.9, 0.4), (0.6, 0.4), (0.6, 0.9), (0.4, 0.9), (0.4, 0.4), (0.1, 0.4)]
    place = QuadHill(game()).place(Outline((Ring(np.array(tablet), -1),)))
    assert place.partition is not None and len(place.partition.faces) == 3
    assert place.score.complexity == 2 * (8 + 3) - 1


def test_moves__take_and_give_whole_quads() -> None:
    outline = Outline((Ring(regular(8), -1), hole(small(BOX, 0.5, 0.5))))
    partition = partitioned(outline)
    assert partition is not None
    found = list(quad_neighbours(outline, partition, game().silhouette, 4))
    sizes = {sum(len(ring.points) for ring in one.rings) - 12 for one in found}
    assert sizes == {-2, -1, 2}
    for one in found:
        assert all(len(ring.points) >= 3 for ring in one.rings)
    shaken = quad_shaken(outline, game().silhouette, np.random.default_rng(1))
    assert shaken.rings[0].points.shape != outline.rings[0].points.shape or len(shaken.rings) == 2


def test_vertices__are_left_out_and_merged() -> None:
    box = Outline((Ring(BOX, -1),))
    assert without(box, {0, 1}) is None
    triangle = merged(box, 0, 1)
    assert triangle is not None
    assert triangle.rings[0].points.tolist() == [[0.5, 0.2], [0.8, 0.8], [0.2, 0.8]]
