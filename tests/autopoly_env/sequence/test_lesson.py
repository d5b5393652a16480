"""What a sequence is worth as a lesson, on constructions whose figures can be told by hand."""

from dataclasses import replace

import numpy as np
import pytest

from agents.budget import Budget
from agents.finish.settle import settle
from agents.registry import make_agent
from autopoly_env.conformance import check_simulator
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh, is_sane
from autopoly_env.operators import OPERATORS, Action
from autopoly_env.score import ScoreWeights
from autopoly_env.sequence import ConstructionSequence, Lesson
from autopoly_env.sequence.lesson import moves, share_moved
from autopoly_env.simulator import Simulator
from tests.helpers.constructions import house
from tests.helpers.drawings import BOTTLE, FRAME, HOUSE, noise, painted
from tests.helpers.sequences import played

SQUARE = PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75)


def score(iou: float) -> dict[str, float]:
    return {"iou": iou, "complexity": 9, "self_intersections": 0, "total": 100 * iou}


def subdivided(*steps: tuple[dict[int, tuple[float, float]], float]) -> ConstructionSequence:
    """Subdivisions of edge 0 of a square with IoU 0.5, each with where vertices go in it, and its IoU."""
    mesh, transitions = SQUARE, []
    for places, iou in steps:
        mesh = OPERATORS["edge_subdivide"].apply(mesh, 0)
        vertices = mesh.vertices.copy()
        for name, place in places.items():
            vertices[mesh.vertex_index(name)] = place
        mesh = mesh.with_vertices(vertices)
        transitions.append((Action("edge_subdivide", 0), None, mesh, score(iou)))
    return ConstructionSequence.record({}, SQUARE, score(0.5), transitions)


def test_lesson__of_no_steps_is_its_start() -> None:
    assert Lesson.of(subdivided()) == Lesson(valid=1.0, blocking_in=0.5, moved=0.0, n_actions=0)


def test_lesson__blocking_in_is_the_area_below_the_ious() -> None:
    assert Lesson.of(subdivided(({}, 0.9))).blocking_in == pytest.approx(0.7)
    assert Lesson.of(subdivided(({}, 0.8), ({}, 1.0))).blocking_in == pytest.approx((0.65 + 0.9) / 2)


def test_lesson__is_better_where_the_big_shape_comes_first() -> None:
    early, late = subdivided(({}, 0.9), ({}, 1.0)), subdivided(({}, 0.6), ({}, 1.0))
    assert Lesson.of(early).blocking_in > Lesson.of(late).blocking_in


def test_lesson__counts_moves_of_old_vertices_only() -> None:
    elsewhere = subdivided(({4: (0.5, 0.1)}, 0.6))  # the new one, wherever it is put
    assert Lesson.of(elsewhere).moved == 0.0
    one_of_four = subdivided(({2: (0.85, 0.75)}, 0.6))
    assert Lesson.of(one_of_four).moved == 0.25
    then_two_of_five = subdivided(({2: (0.85, 0.75)}, 0.6), ({2: (0.75, 0.75), 4: (0.5, 0.2)}, 0.7))
    assert Lesson.of(then_two_of_five).moved == pytest.approx((1 / 4 + 2 / 5) / 2)


@pytest.mark.parametrize(("distance", "share"), [(0.0, 0.0), (0.0099, 0.0), (0.0101, 1.0), (0.3, 1.0)])
def test_share_moved__begins_at_one_per_cent_of_the_image(distance: float, share: float) -> None:
    assert share_moved(SQUARE, SQUARE.with_vertices(SQUARE.vertices + (distance, 0.0))) == share


def test_moves__are_told_by_id_and_only_of_vertices_in_both() -> None:
    gable = OPERATORS["edge_subdivide"].apply(SQUARE, 0)
    corner = OPERATORS["vertex_dissolve"].apply(gable, 1)
    assert corner.vertex_ids == (0, 2, 3, 4)
    shifted = corner.with_vertices(corner.vertices + [(0.0, 0.0), (0.3, 0.4), (0.0, 0.0), (0.0, 0.1)])
    assert moves(gable, shifted) == pytest.approx([0.0, 0.5, 0.0, 0.1])
    assert moves(SQUARE, shifted) == pytest.approx([0.0, 0.5, 0.0])


def test_lesson__valid_is_the_share_of_meshes_that_neither_cross_nor_flip() -> None:
    crossed = subdivided(({}, 0.6), ({4: (0.5, 0.9)}, 0.7))  # the new vertex through the opposite edge
    assert Lesson.of(crossed).valid == pytest.approx(2 / 3)
    assert Lesson.of(house()).valid == 1.0


def test_w_locality__has_to_be_a_weight() -> None:
    with pytest.raises(ConfigError, match="w_locality"):
        ScoreWeights(w_locality=-1.0)


def test_w_locality__is_off_the_total_of_a_step_and_not_off_that_of_a_mesh() -> None:
    game = Simulator(painted(HOUSE), resolution=64, weights=ScoreWeights(w_locality=8.0))
    free = Simulator(painted(HOUSE), resolution=64)
    moved = SQUARE.with_vertices(SQUARE.vertices + [(0.1, 0.0), (0.0, 0.0), (0.0, 0.0), (0.005, 0.0)])
    assert game.docked(SQUARE, moved) == 2.0
    assert game.score(moved) == free.score(moved) == free.score(moved, SQUARE)
    assert game.score(moved, SQUARE) == replace(free.score(moved), total=free.score(moved).total - 2.0)
    assert game.final_score(moved) == free.final_score(moved)


def test_w_locality__makes_a_step_leave_old_vertices_alone() -> None:
    silhouette = painted(BOTTLE, 128)
    free, dear = (Simulator(silhouette, weights=ScoreWeights(w_locality=w)) for w in (0.0, 1e6))
    start = free.initial()
    actions = free.legal_actions(start)[1:]
    freely, held = free.transition_all(start, actions), dear.transition_all(dear.initial(), actions)
    assert max(share_moved(start.mesh, state.mesh) for state in freely) > 0.2
    assert [share_moved(start.mesh, state.mesh) for state in held] == [0.0] * len(held)
    assert max(state.n_refits for state in held) > max(state.n_refits for state in freely)
    assert all(is_sane(state.mesh) for state in held)


@pytest.mark.parametrize("symmetry", [None, 0.5])
def test_w_locality__keeps_to_the_rules_of_a_simulator(symmetry: float | None) -> None:
    weights = ScoreWeights(w_locality=3.0)
    check_simulator(Simulator(painted(FRAME), resolution=32, weights=weights, symmetry=symmetry, max_steps=6))


def test_settle__changes_nothing_without_the_weight() -> None:
    sequence = played(3)
    assert settle(sequence, Simulator(noise(3), resolution=32)) is sequence


@pytest.mark.parametrize("seed", range(4))
def test_settle__moves_less_towards_the_same_mesh(seed: int) -> None:
    sequence = played(seed).trim(8)
    game = Simulator(noise(seed), resolution=32, weights=ScoreWeights(w_locality=50.0))
    settled = settle(sequence, game)
    assert settled.final() == sequence.final()
    assert ConstructionSequence.from_json(settled.to_json()).final() == sequence.final()
    assert [step.operator for step in settled.steps] == [step.operator for step in sequence.steps]
    assert [step.score for step in settled.steps] == [game.final_score(m).as_dict() for m in settled.meshes()[1:]]
    assert all(
        is_sane(after) or not is_sane(mesh) for mesh, after in zip(sequence.meshes(), settled.meshes(), strict=True)
    )
    assert Lesson.of(settled).moved < Lesson.of(sequence).moved


def test_settle__puts_a_move_off_or_brings_it_forward_where_it_costs_nothing() -> None:
    there_and_back = subdivided(({2: (0.8, 0.8)}, 0.6), ({2: (0.75, 0.75)}, 0.7))
    silhouette = painted(HOUSE)
    game = Simulator(silhouette, weights=ScoreWeights(w_locality=1e6))
    settled = settle(there_and_back, game)
    assert Lesson.of(settled).moved == 0.0 and settled.final() == there_and_back.final()
    given = Simulator(silhouette, weights=ScoreWeights(w_locality=1e6), start=SQUARE)
    assert settle(subdivided(({2: (0.8, 0.8)}, 0.6)), given).start == SQUARE


def test_greedy__moves_less_under_the_weight_for_little() -> None:
    silhouette = painted(BOTTLE, 128)
    free, dear = (
        make_agent("greedy").solve(Simulator(silhouette, weights=ScoreWeights(w_locality=w)), Budget(300))
        for w in (0.0, 0.5)
    )
    assert Lesson.of(dear.sequence).moved <= 0.5 * Lesson.of(free.sequence).moved
    assert dear.score.total > free.score.total - 0.3
    assert dear.score.total == pytest.approx(100 * dear.score.iou - 0.3 * dear.score.complexity)  # nothing is off
    assert np.isfinite(dear.mesh.vertices).all()
