"""Settling: a construction moves less towards the same mesh."""

import pytest

from agents.finish.settle import settle
from autopoly_env.mesh import is_sane
from autopoly_env.score import ScoreWeights
from autopoly_env.sequence import ConstructionSequence, Lesson
from autopoly_env.simulator import Simulator
from tests.helpers.drawings import HOUSE, noise, painted
from tests.helpers.lessons import SQUARE, subdivided
from tests.helpers.sequences import played


def test_settle__changes_nothing_without_the_weight() -> None:
    sequence = played(3)
    assert settle(sequence, Simulator(noise(3), resolution=32)) is sequence


@pytest.mark.parametrize("seed", [0, 2, 3])  # in which something moves
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
    settled = settle(there_and_back.with_parts(["body", "leg"]), game)
    assert settled.parts == ("body", "leg")
    assert Lesson.of(settled).moved == 0.0 and settled.final() == there_and_back.final()
    given = Simulator(silhouette, weights=ScoreWeights(w_locality=1e6), start=SQUARE)
    assert settle(subdivided(({2: (0.8, 0.8)}, 0.6)), given).start == SQUARE
