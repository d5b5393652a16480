"""The baselines that never change a mesh's topology."""

from typing import Any

import pytest

from agents.base import Budget
from agents.registry import make_agent
from autopoly_env.actions import STOP
from autopoly_env.errors import ConfigError
from autopoly_env.placement import defects_of
from autopoly_env.simulator import Simulator
from tests.drawings import L_SHAPE, SQUARE, TWO_SQUARES, noise, painted
from tests.test_agents import TARGETS, assert_consistent, interrupt_at, simulator


@pytest.mark.parametrize("target", TARGETS)
def test_dr_simple__is_the_refitted_rectangle(target: str) -> None:
    game = simulator(target)
    solution = make_agent("dr-simple").solve(game)
    assert_consistent(solution, game)
    assert solution.mesh == game.polish(game.initial().mesh) and not solution.sequence.steps


@pytest.mark.parametrize("options", [{"n": 1}, {"n": 2}, {}, {"n": 5}, {"allow_defects": True}])
def test_dr_complex__is_a_grid_and_takes_no_step(options: dict[str, Any]) -> None:
    game, n = simulator("blobs"), options.get("n", 3)
    solution = make_agent("dr-complex", **options).solve(game)
    assert_consistent(solution, game)
    assert solution.mesh.counts == ((n + 1) ** 2, 2 * n * (n + 1), n * n) and not solution.sequence.steps


def test_dr_complex__has_the_papers_size() -> None:
    assert make_agent("dr-complex").solve(simulator()).score.complexity == 49


def test_dr_complex__fits_a_square_and_an_l_without_a_hair() -> None:
    assert make_agent("dr-complex").solve(Simulator(painted(SQUARE), resolution=64)).score.iou == 1.0
    assert make_agent("dr-complex").solve(Simulator(painted(L_SHAPE), resolution=64)).score.iou > 0.95


def test_allow_defects__lets_the_grid_cross_itself() -> None:
    defects = {False: 0, True: 0}
    for silhouette in (noise(1), noise(2), noise(3), painted(TWO_SQUARES)):
        for allowed in defects:
            game = Simulator(silhouette, resolution=48)
            solution = make_agent("dr-complex", allow_defects=allowed).solve(game)
            defects[allowed] += sum(defects_of(solution.mesh))
    assert defects[False] == 0 < defects[True]


@pytest.mark.parametrize("name", ["dr-simple", "dr-complex"])
def test_solve__reports_its_work_and_can_be_interrupted(name: str) -> None:
    game, agent = simulator(), make_agent(name)
    plain = agent.solve(game, Budget(refits=0))
    assert plain.stats.n_refits >= 1 and plain.stats.stopped_by == "finished"
    interrupted = agent.solve(game, on_progress=interrupt_at(1))
    assert interrupted.stats.stopped_by == "interrupted" and interrupted.sequence == plain.sequence
    assert agent.act(game, game.initial()).action == STOP


@pytest.mark.parametrize("n", [0, 6])
def test_config__says_which_grids_there_are(n: int) -> None:
    with pytest.raises(ConfigError, match=rf"n = {n}: expected a grid of 1 to 5 quads a side"):
        make_agent("dr-complex", n=n)
