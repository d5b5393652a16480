"""The baselines that never change a mesh's topology."""

import sys
from typing import Any

import numpy as np
import pytest
import shapely

from agents.budget import Budget
from agents.registry import make_agent
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh, defects_of
from autopoly_env.operators import STOP
from autopoly_env.simulator import Simulator
from tests.helpers.drawings import L_SHAPE, SQUARE, TWO_SQUARES, noise, painted
from tests.helpers.solving import TARGETS, assert_consistent, interrupt_at, simulator

TRAPEZIUM = shapely.Polygon([(0.4, 0.2), (0.6, 0.2), (0.8, 0.8), (0.2, 0.8)])


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


# --- plain gradient descent ---


@pytest.fixture
def torch() -> Any:
    """The tests that need it are left out where it is missing."""
    return pytest.importorskip("torch")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["dr-simple", "dr-complex"])
def test_gradient__moves_the_vertices_only_and_counts_as_one_refit(name: str, torch: Any) -> None:
    game = simulator("blobs")
    solution = make_agent(name, refit="gradient", iterations=20).solve(game, Budget(refits=0))
    assert_consistent(solution, game)
    assert solution.mesh.counts == ((4, 4, 1) if name == "dr-simple" else (16, 24, 9))
    assert (solution.stats.n_refits, solution.stats.stopped_by) == (1, "finished")
    assert not solution.sequence.steps and sum(defects_of(solution.mesh)) == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["dr-simple", "dr-complex"])
def test_gradient__finds_a_quadrilateral_inside_its_box(name: str, torch: Any) -> None:
    game = Simulator(painted(TRAPEZIUM), resolution=64)
    far = make_agent(name, refit="gradient", iterations=1).solve(game)
    near = make_agent(name, refit="gradient").solve(game)
    assert far.score.iou < 0.8 and near.score.iou > 0.97


@pytest.mark.slow
def test_gradient__takes_the_best_on_the_way(torch: Any) -> None:
    game, agent = simulator("house"), make_agent("dr-simple", refit="gradient", iterations=3, learning_rate=0.9)
    box = agent.solve(Simulator(painted(SQUARE), resolution=32)).mesh
    assert box == PolyMesh.grid(1, 0.25, 0.25, 0.75, 0.75)  # nothing can be better, and each step is far too long
    assert agent.solve(game).score.iou >= 0.75


@pytest.mark.slow
def test_gradient__is_no_match_for_least_squares(torch: Any) -> None:
    games = [Simulator(silhouette, resolution=48) for silhouette in (noise(1), noise(2), noise(3), painted(L_SHAPE))]
    for name in ("dr-simple", "dr-complex"):
        plain = [make_agent(name, refit="gradient").solve(game).score.total for game in games]
        fitted = [make_agent(name).solve(game).score.total for game in games]
        assert np.mean(plain) <= np.mean(fitted)


@pytest.mark.slow
def test_gradient__crosses_itself_only_where_it_may(torch: Any) -> None:
    defects = {False: 0, True: 0}
    for silhouette in (noise(1), noise(3), painted(TWO_SQUARES)):
        for allowed in defects:
            game = Simulator(silhouette, resolution=48)
            agent = make_agent("dr-complex", refit="gradient", allow_defects=allowed)
            defects[allowed] += sum(defects_of(agent.solve(game).mesh))
    assert defects[False] == 0 < defects[True]


@pytest.mark.slow
def test_gradient__looks_where_matching_matters(torch: Any) -> None:
    importance = np.ones((64, 64))
    importance[:, :32] = 0.0
    game = Simulator(painted(TWO_SQUARES), resolution=64, importance=importance)
    middle = make_agent("dr-simple", refit="gradient").solve(game).mesh.vertices[:, 0].mean()
    assert (
        middle
        > make_agent("dr-simple", refit="gradient").solve(Simulator(painted(TWO_SQUARES))).mesh.vertices[:, 0].mean()
    )


@pytest.mark.slow
def test_gradient__returns_the_best_so_far_on_ctrl_c(torch: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    game, agent = simulator("L"), make_agent("dr-complex", refit="gradient")
    n_calls = iter(range(100))
    step = torch.optim.Adam.step

    def interrupted(*arguments: Any) -> Any:
        if next(n_calls) == 20:
            raise KeyboardInterrupt
        return step(*arguments)

    monkeypatch.setattr(torch.optim.Adam, "step", interrupted)
    solution = agent.solve(game)
    assert solution.stats.stopped_by == "interrupted"
    assert_consistent(solution, game)
    start = make_agent("dr-complex", refit="gradient", iterations=1, learning_rate=1e-9)
    monkeypatch.undo()
    assert solution.score.iou > start.solve(game).score.iou


def test_gradient__says_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "agents.baselines.descent", raising=False)
    monkeypatch.setitem(sys.modules, "torch", None)
    for name in ("dr-simple", "dr-complex"):
        with pytest.raises(ConfigError, match=rf"agent '{name}' .* package torch, .* pip install -e '\.\[learn\]'"):
            make_agent(name, refit="gradient")
        assert make_agent(name).name == name


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"iterations": 0}, "iterations = 0: expected at least 1"),
        ({"learning_rate": 0.0}, "learning_rate = 0.0: expected above 0"),
        ({"learning_rate": float("nan")}, "learning_rate = nan: expected above 0"),
        ({"refit": "adam"}, "option refit: .* got 'adam'"),
    ],
)
def test_config__says_what_descent_can_be(options: dict[str, Any], complaint: str) -> None:
    for name in ("dr-simple", "dr-complex"):
        with pytest.raises(ConfigError, match=complaint):
            make_agent(name, **options)
