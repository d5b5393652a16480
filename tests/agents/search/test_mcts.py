"""The agents that search trees: what they promise, their incumbents and settings."""

from itertools import pairwise
from typing import Any

import pytest
import shapely

from agents.base import Agent, Decision
from agents.budget import Budget, Meter, Progress
from agents.finish import finish
from agents.registry import make_agent
from agents.search.config import PAPER, MctsConfig
from agents.search.incumbents import SHARE, track_of
from agents.search.mcts import MctsAgent
from agents.solution import Solution
from autopoly_env.errors import ConfigError
from autopoly_env.operators import STOP, Action
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.simulator import Simulator, State
from tests.helpers.drawings import BOTTLE, SQUARE, painted
from tests.helpers.solving import TARGETS, assert_consistent, interrupt_at, quick, simulator

# --- the agents ---


@pytest.mark.slow
@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("name", ["mcts", "mcts_paper"])
def test_solve__is_never_worse_than_the_rectangle_it_begins_with(name: str, target: str) -> None:
    for operators in ("full", "paper"):
        game = simulator(target, operators=operators)
        assert quick(name).solve(game).score.total >= game.final_score(game.initial().mesh).total


@pytest.mark.slow
@pytest.mark.parametrize(("name", "options"), [("mcts", {"seeds": ()}), ("mcts", {}), ("mcts_paper", {})])
def test_solve__is_the_same_for_a_seed_at_a_budget(name: str, options: dict[str, Any]) -> None:
    game, budget = simulator("island"), Budget(refits=150)
    agent = make_agent(name, **options)
    once, again = agent.solve(game, budget), agent.solve(game, budget)
    anew = make_agent(name, **options).solve(simulator("island"), budget)
    assert once.sequence.to_json() == again.sequence.to_json() == anew.sequence.to_json()
    assert once.stats.n_refits == again.stats.n_refits == anew.stats.n_refits


def test_seed__changes_the_order_of_equals() -> None:
    agents = [make_agent("mcts_paper", seed=seed, n_simulations=5) for seed in range(4)]
    assert len({agent.solve(simulator("blobs"), Budget(refits=60)).sequence.to_json() for agent in agents}) > 1


@pytest.mark.parametrize("name", ["mcts", "mcts_paper"])
def test_budget__of_nothing_returns_the_rectangle(name: str) -> None:
    game = simulator("blobs")
    for budget, reason in ((Budget(refits=0), "refits"), (Budget(seconds=0.0), "seconds")):
        solution = make_agent(name).solve(game, budget)
        assert solution.stats.stopped_by == reason
        assert solution.mesh == game.polish(game.initial().mesh) and not solution.sequence.steps


@pytest.mark.slow
@pytest.mark.parametrize("options", [{"seeds": ()}, {}])
def test_budget__is_overrun_by_one_step_at_most(options: dict[str, Any]) -> None:
    game = simulator("blobs")
    for refits in (1, 5, 30, 200):
        reports: list[Progress] = []
        solution = make_agent("mcts", **options).solve(game, Budget(refits=refits), reports.append)
        assert_consistent(solution, game)
        assert all(report.n_refits < refits for report in reports[:-1])
        assert solution.stats.stopped_by in ("refits", "finished")
        assert reports[-1].n_refits <= solution.stats.n_refits
        totals = [report.best_total for report in reports]
        assert totals == sorted(totals)


@pytest.mark.slow
@pytest.mark.parametrize("call", [1, 2, 4, 12])
@pytest.mark.parametrize("options", [{"seeds": ()}, {"seeds": ("greedy",)}, {}])
def test_interrupt__returns_the_best_so_far(options: dict[str, Any], call: int) -> None:
    game = Simulator(TARGETS["blobs"], resolution=40)  # the resolution of the silhouette: scores can be compared
    reports: list[Progress] = []
    interrupt = interrupt_at(call)

    def report(progress: Progress) -> None:
        reports.append(progress)
        interrupt(progress)

    solution = make_agent("mcts", **options).solve(game, on_progress=report)
    assert len(reports) == call
    assert solution.stats.stopped_by == "interrupted"
    assert_consistent(solution, game)
    if "climb" not in options.get("seeds", ("climb",)):
        assert solution.score.total >= reports[-1].best_total


def test_act__takes_what_leads_on_and_stops_where_nothing_is_better() -> None:
    game, agent = simulator("house", resolution=64), make_agent("mcts")
    state = game.initial()
    decision = agent.act(game, state)
    roof = game.transition(state, decision.action)
    assert decision == agent.act(game, state)
    assert sum(decision.policy.values()) == pytest.approx(1.0) and decision.action in decision.policy
    assert roof.done == "matched" and roof.score.total == decision.value
    assert agent.act(game, roof).action == STOP
    square = Simulator(game.silhouette, resolution=64, match_threshold=0.5)
    assert agent.act(square, square.initial()).action == STOP


# --- incumbents ---


@pytest.mark.slow
@pytest.mark.parametrize("target", TARGETS)
def test_seeds__are_never_lost(target: str) -> None:
    game = simulator(target)
    incumbents = [make_agent(name).solve(game) for name in ("trace", "greedy")]
    agent = make_agent("mcts", seeds=("trace", "greedy"), n_simulations=2, patience=1, hop_patience=0)
    solution = agent.solve(game, Budget(refits=5000))
    assert_consistent(solution, game)
    assert solution.score.total >= max(incumbent.score.total for incumbent in incumbents)


@pytest.mark.slow
def test_seeds__do_not_keep_the_search_from_the_rectangle() -> None:
    game = simulator("blobs")
    pure, both = (make_agent("mcts", seeds=seeds, hop_patience=0).solve(game) for seeds in ((), ("trace",)))
    assert both.score.total >= pure.score.total
    assert both.stats.n_refits >= pure.stats.n_refits + make_agent("trace").solve(game).stats.n_refits


class Spy(Agent):
    """Traces, and notes the budgets that it is given."""

    def __init__(self, asked: list[Budget | None]) -> None:
        self._asked = asked

    def act(self, simulator: Simulator, state: State) -> Decision:
        return Decision(STOP)

    def solve(self, simulator: Simulator, budget: Budget | None = None, on_progress: Any = None) -> Solution:
        self._asked.append(budget)
        return make_agent("trace").solve(simulator, budget, on_progress)


def test_seeds__get_a_share_of_what_is_left_of_the_budget() -> None:
    game = simulator("blobs")
    asked: list[Budget | None] = []
    n_initial = 2
    n_traced = make_agent("trace").solve(game, Budget(refits=59)).stats.n_refits
    MctsAgent(MctsConfig(), [Spy(asked), Spy(asked)]).solve(game, Budget(refits=100))
    rest = 100 - n_initial
    assert asked == [Budget(refits=round(SHARE * rest)), Budget(refits=round(SHARE * (rest - n_traced)))]


def test_seeds__run_to_their_end_where_no_budget_is_given() -> None:
    asked: list[Budget | None] = []
    MctsAgent(MctsConfig(n_refits=10, hop_patience=0), [Spy(asked), Spy(asked)]).solve(simulator("blobs"))
    assert asked == [Budget(), Budget()]


def test_target__that_the_rectangle_matches_already_leaves_nothing_to_search() -> None:
    game = Simulator(painted(SQUARE), resolution=64)
    solution = make_agent("mcts", seeds=()).solve(game, Budget(refits=1000))
    assert solution.score.iou == 1.0 and not solution.sequence.steps
    assert solution.stats.n_refits <= 2 and solution.stats.stopped_by == "finished"
    seeded = make_agent("mcts").solve(game, Budget(refits=1000))  # the seeds may find it with a corner less
    assert seeded.score.total >= solution.score.total


def test_seeds__that_cannot_take_guidance_are_left_out() -> None:
    game = simulator("house", symmetry=0.5)
    solution = make_agent("mcts", seeds=("climb", "decimate")).solve(game, Budget(refits=60))
    assert_consistent(solution, game)


@pytest.mark.slow
def test_hop_patience__finds_what_the_tree_does_not() -> None:
    game = simulator("blobs")
    alone, hopping = (make_agent("mcts", seeds=(), hop_patience=n).solve(game, Budget(refits=600)) for n in (0, 1000))
    assert hopping.score.total > alone.score.total


def test_max_steps__is_kept_by_hops() -> None:
    game = simulator("blobs", operators="paper", max_steps=1)  # where an extrusion is best, and its outline two steps
    assert_consistent(quick("mcts").solve(game), game)


def test_n_refits__limits_a_search_without_a_budget() -> None:
    game = simulator("blobs")
    solution = make_agent("mcts", seeds=(), n_refits=100).solve(game)
    assert 100 <= solution.stats.n_refits < 150 and solution.stats.stopped_by == "refits"


@pytest.mark.slow
def test_simulations__limit_a_search() -> None:
    game, seen = simulator("blobs"), []
    solution = make_agent("mcts", seeds=()).solve(game, Budget(simulations=3), seen.append)
    assert solution.stats.stopped_by == "simulations"
    assert 3 <= seen[-1].n_nodes <= 3 * MctsConfig().n_expanded


@pytest.mark.parametrize("target", TARGETS)
def test_track_of__goes_through_the_states_of_a_sequence(target: str) -> None:
    game = simulator(target)
    sequence = make_agent("trace").solve(game).sequence
    states = track_of(game, sequence).states()
    assert [state.mesh for state in states] == sequence.meshes()
    assert [state.step for state in states] == list(range(len(states)))
    assert [state.score for state in states] == [game.score(mesh) for mesh in sequence.meshes()]
    for before, after in pairwise(states):
        assert after.action in game.legal_actions(State(before.mesh, before.score))
    limited = Simulator(game.silhouette, resolution=32, max_steps=len(sequence.steps))
    assert track_of(limited, sequence).state.done in ("max_steps", "matched")


def test_track_of__takes_an_action_and_its_mirror_image_for_one_state() -> None:
    game = Simulator(painted(shapely.Point(0.5, 0.5).buffer(0.35)), resolution=32, symmetry=0.5)
    played, sequence = _begun(game, 2)
    track = track_of(game, sequence)
    assert [state.step for state in track.states()] == [0, 1, 2] and len(sequence.steps) == 4
    assert track.states()[1].mesh == played[1].mesh and track.state.mesh == sequence.final()
    assert track.state.halfway == played[-1].halfway
    assert (
        track_of(game, sequence.trim(3)).state.mesh == played[1].mesh
    )  # an action without its mirror image is no state


def test_track_of__leaves_out_what_the_simulator_goes_on_from() -> None:
    earlier = _begun(Simulator(painted(BOTTLE), resolution=32), 1)[1]
    game = Simulator(painted(BOTTLE), resolution=32, start=earlier)
    solution = make_agent("greedy").solve(game, Budget(refits=60))
    states = track_of(game, solution.sequence).states()
    assert len(states) == len(solution.sequence.steps) > 1 and states[0].mesh == earlier.final()
    assert (
        make_agent("mcts", seeds=("greedy",), n_simulations=1).solve(game, Budget(refits=90)).sequence.trim(1).final()
        == earlier.final()
    )


def _begun(game: Simulator, n_steps: int) -> tuple[list[State], ConstructionSequence]:
    """Edges subdivided greedily, under symmetry two at a time: the states, and what is recorded of them."""
    states = [game.initial()]
    while len(states) <= n_steps:
        n_edges = len(states[-1].mesh.edges)
        children = game.transition_all(states[-1], [Action("edge_subdivide", e) for e in range(n_edges)])
        mirrored = [child for child in children if child.halfway is not None or game.guidance.axis is None]
        states.append(max(mirrored, key=lambda child: child.score.total))
    return states, finish(game, states, Meter.unlimited(), keep_steps=True).sequence


# --- settings ---


def test_paper__is_the_papers_search() -> None:
    assert (PAPER.seeds, PAPER.prior, PAPER.formula, PAPER.n_expanded, PAPER.n_rollout) == ((), "uniform", "uct", 1, 3)
    assert (PAPER.backup, PAPER.value, PAPER.commit, PAPER.merge, PAPER.reuse_tree) == (
        "mean", "final", "value", False, False
    )  # fmt: skip


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"n_simulations": 0}, "n_simulations = 0: expected at least 1"),
        ({"n_expanded": 0}, "n_expanded = 0: expected at least 1"),
        ({"patience": 0}, "patience = 0: expected at least 1"),
        ({"n_rollout": -1}, "n_rollout = -1: expected at least 0"),
        ({"exploration": float("nan")}, "exploration = nan: expected at least 0"),
        ({"seed": -1}, "seed = -1: expected at least 0"),
        ({"widening": 1.5}, "widening = 1.5: expected an exponent, 0 to 1"),
        ({"discount": 0.0}, "discount = 0.0: expected above 0, at most 1"),
        ({"prior": "learned"}, "agent 'mcts', option prior: .* got 'learned'"),
        ({"seeds": ("clim",)}, "agent 'clim' is unknown"),
    ],
)
def test_config__says_in_one_line_what_is_wrong(options: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ConfigError, match=complaint) as caught:
        make_agent("mcts", **options)
    assert "\n" not in str(caught.value)
