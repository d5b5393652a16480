"""The oracle: it leaves nothing out, or is the best of several beams; on games drawn by hand and on real ones."""

from collections.abc import Iterator
from typing import Any

import pytest

from agents.baselines.oracle import OracleAgent, OracleConfig
from agents.budget import Budget, Meter, Progress
from agents.registry import make_agent
from agents.solution import Track
from autopoly_env.errors import ConfigError
from autopoly_env.operators import STOP
from autopoly_env.simulator import Simulator, State
from tests.helpers.drawings import HOUSE, SQUARE, painted
from tests.helpers.solving import TARGETS, assert_consistent, interrupt_at, simulator
from tests.helpers.tree import VALLEY, VALLEY_CHILDREN, Tree


def played(tree: Tree, **options: Any) -> tuple[str, str]:
    """(the nodes whose children were asked for, the best node) of an oracle's search from node r."""
    agent, root = OracleAgent(OracleConfig(**options)), Track(tree.states["r"])
    bests = agent._bests(tree, root, Meter.unlimited())  # type: ignore[arg-type]
    best = max((best for _, best in bests), key=lambda track: track.state.score.total)
    return "".join(tree.visited), tree.name(best.state)


class Counted(Tree):
    """A tree whose states know their step, as a simulator's do."""

    def __init__(self, totals: dict[str, float], children: dict[str, str], **options: str) -> None:
        super().__init__(totals, children, **options)
        steps = {"r": 0}
        for parent, those in children.items():
            steps |= {child: steps[parent] + 1 for child in those if child not in steps}
        for name, step in steps.items():
            object.__setattr__(self.states[name], "step", step)


def everything(game: Simulator, state: State, depth: int) -> Iterator[State]:
    """All states that `depth` actions lead to, one after the other, nothing merged: sound ones, as all agents want."""
    yield state
    if depth and not state.done:
        for action in game.legal_actions(state)[1:]:
            for child in game.transition_all(state, [action]):
                if game.is_sound(child.mesh):
                    yield from everything(game, child, depth - 1)


# --- everything ---


@pytest.mark.parametrize(
    ("depth", "visited", "best"), [(1, "r", "a"), (2, "rabc", "f"), (3, "rabcfed", "f"), (9, "rabcfed", "f")]
)
def test_exhaustive__tries_everything_down_to_its_depth(depth: int, visited: str, best: str) -> None:
    assert played(Counted(VALLEY, VALLEY_CHILDREN), width=0, depth=depth) == (visited, best)


def test_exhaustive__goes_on_where_nothing_improves() -> None:
    path = Counted(
        dict(zip("rabcdef", (50, 9, 8, 7, 6, 5, 60), strict=True)), dict(zip("rabcde", "abcdef", strict=True))
    )
    assert played(path, width=0, depth=6) == ("rabcde", "f")
    path.visited.clear()
    assert played(path, width=1, depth=6) == ("rabc", "r")  # a beam loses its patience


def test_exhaustive__goes_on_from_a_shape_once() -> None:
    twins = Counted({"r": 1.0, "a": 2.0, "b": 3.0, "c": 4.0}, {"r": "ab", "a": "", "b": "c"}, twins="rc")
    assert played(twins, width=0, depth=5) == ("rba", "c")


@pytest.mark.parametrize(("target", "depth"), [("house", 2), ("blobs", 2)])
def test_exhaustive__finds_what_brute_force_finds(target: str, depth: int) -> None:
    game = simulator(target, operators="edge_subdivide,edge_extrude,face_delete", resolution=16)
    reached = [game.standing(state) for state in everything(game, game.initial(), depth)]
    agent = OracleAgent(OracleConfig(width=0, depth=depth, merge_grid=1e-9))
    bests = [best.state for _, best in agent._bests(game, Track(game.initial()), Meter.unlimited())]
    assert max(map(game.standing, bests)) == max(reached)
    assert max(state.step for state in bests) <= depth


# --- beams ---


@pytest.mark.parametrize("target", ["house", "L", "frame"])
def test_oracle__of_width_one_is_greedy(target: str) -> None:
    game = simulator(target)
    oracle, greedy = make_agent("oracle", width=1).solve(game), make_agent("greedy").solve(game)
    assert oracle.sequence == greedy.sequence and oracle.stats.n_refits == greedy.stats.n_refits


def test_oracle__goes_no_deeper_than_it_is_told() -> None:
    assert played(Counted(VALLEY, VALLEY_CHILDREN), width=1, depth=1) == ("r", "a")
    assert played(Counted(VALLEY, VALLEY_CHILDREN), width=3, depth=2) == ("ra" + "rabc", "f")  # widths 1 and 3
    game = simulator("blobs")
    bests = OracleAgent(OracleConfig(width=2, depth=2))._bests(game, Track(game.initial()), Meter.unlimited())
    assert max(best.state.step for _, best in bests) == 2


@pytest.mark.slow
@pytest.mark.parametrize("target", ["house", "frame", "two squares"])
def test_oracle__is_never_below_greedy_and_a_beam(target: str) -> None:
    game = Simulator(TARGETS[target], resolution=16, operators="paper", max_steps=6)
    narrow = [make_agent(name).solve(game) for name in ("greedy", "beam")]
    wide = make_agent("oracle", width=12).solve(game)
    assert_consistent(wide, game)
    assert wide.score.total >= max(solution.score.total for solution in narrow)
    assert wide.stats.n_refits > sum(solution.stats.n_refits for solution in narrow)


# --- an agent as every other ---


@pytest.mark.parametrize("options", [{"width": 2}, {"width": 0, "depth": 1}])
def test_oracle__keeps_what_agents_promise(options: dict[str, Any]) -> None:
    game, agent = simulator("island"), make_agent("oracle", **options)
    reports: list[Progress] = []
    assert_consistent(agent.solve(game, Budget(refits=60), reports.append), game)
    assert reports[-1].n_refits >= 1
    stopped = agent.solve(game, on_progress=interrupt_at(2))
    assert stopped.stats.stopped_by == "interrupted"
    assert_consistent(stopped, game)


def test_act__is_the_first_step_to_the_best() -> None:
    game, agent = Simulator(painted(HOUSE), resolution=64), make_agent("oracle", width=0, depth=1)
    decision = agent.act(game, game.initial())
    roof = game.transition(game.initial(), decision.action)
    assert roof.done == "matched" and decision.value == roof.score.total
    assert agent.act(game, roof).action == STOP
    assert agent.act(Simulator(painted(SQUARE), resolution=64), roof).action == STOP


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"width": 0}, "width = 0, which leaves nothing out: expected a depth"),
        ({"width": -1}, "width=-1: expected a number of at least 1"),
        ({"depth": 0}, "depth = 0: expected at least 1"),
        ({"merge_grid": 0.0}, "merge_grid=0.0: expected a number above 0"),
    ],
)
def test_config__says_what_is_wrong(options: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ConfigError, match=complaint):
        make_agent("oracle", **options)
