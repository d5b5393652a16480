"""The end of a solve: the sequence is cut at its best, the last mesh polished."""

import numpy as np

from agents.budget import Budget, Meter
from agents.finish import finish
from autopoly_env.operators import OPERATORS, Action
from autopoly_env.simulator import Simulator, State
from tests.helpers.drawings import noise
from tests.helpers.solving import TARGETS, assert_consistent


def test_finish__cuts_the_sequence_at_its_best() -> None:
    game = Simulator(TARGETS["house"], resolution=64)
    roof = max(game.transition_all(game.initial()), key=lambda child: child.score.total)
    split = OPERATORS["face_split"].apply(roof.mesh, 0)
    worse = State(split, game.score(split), 2, "", Action("face_split", 0))
    solution = finish(game, [game.initial(), roof, worse], Meter(Budget()))
    (inner,) = np.flatnonzero(~split.topology.is_boundary_edge).tolist()
    joined = OPERATORS["edge_dissolve"].apply(split, inner)
    no_better = State(joined, roof.score, 3, "", Action("edge_dissolve", inner))
    assert finish(game, [game.initial(), roof, worse, no_better], Meter(Budget())).sequence == solution.sequence
    assert [step.operator for step in solution.sequence.steps] == ["edge_subdivide"]
    assert solution.score.iou == 1.0
    assert_consistent(solution, game)


def test_finish__polishes_the_last_mesh_at_the_silhouettes_resolution() -> None:
    game = Simulator(noise(6, 64), resolution=16)
    state = game.initial()
    solution = finish(game, [state], Meter(Budget()))
    assert solution.mesh == game.polish(state.mesh)
    assert solution.score.total >= game.final_score(state.mesh).total
