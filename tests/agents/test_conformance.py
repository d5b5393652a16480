"""Every agent conforms, those with networks, too; and whoever breaks a rule is told which."""

import doctest
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from agents import conformance
from agents.base import Agent, Decision
from agents.budget import Budget, Progress
from agents.conformance import check_agent, sample_silhouettes
from agents.registry import AGENTS
from agents.solution import Solution
from autopoly_env.errors import ConformanceError
from autopoly_env.operators import STOP, Action
from autopoly_env.simulator import Simulator, State
from tests.helpers.choosing import saved_choice
from tests.helpers.networks import saved_networks, saved_policy
from tests.helpers.solving import TARGETS, assert_consistent, quick, simulator

POLICIES = ("ppo", "maskable-ppo", "a2c", "dqn")
AT_HOME = {"quads": ("modeller",)}  # operators that an agent needs
WITH_NETWORKS = ("nfap-prior", "nfap-mcts", "choice-prior", "rl-prior", *POLICIES)


@pytest.fixture(scope="module")
def options(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, Any]]:
    """What the agents with networks need to be made, and to be soon done."""
    folder = tmp_path_factory.mktemp("networks")
    networks, weights = saved_networks(folder), {"weights": saved_policy(folder)}
    few = {"n_simulations": 2, "patience": 1}
    nfap = {"nfap_weights": networks["nfap"], "n": 2, "n_expanded": 1, **few}
    return {
        "nfap-prior": {**nfap, "seeds": (), "hop_patience": 1},
        "nfap-mcts": {**nfap, "geometry": "warpnet", "warpnet_weights": networks["warpnet"]},
        "choice-prior": {"weights": saved_choice(folder), "seeds": (), "hop_patience": 1, **few},
        "rl-prior": {**weights, **few},
        **dict.fromkeys(POLICIES, weights),
    }


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "operators"),
    [
        (name, operators)
        for name in AGENTS
        for operators in AT_HOME.get(name, ("full", "paper"))
        if name not in WITH_NETWORKS
    ],
)
def test_agent__conforms(name: str, operators: str) -> None:
    options = {"mcts": {"n_simulations": 2, "hop_patience": 1}}.get(name, {})
    agent, other = (quick(name, **options) for _ in range(2))
    shapes = [TARGETS["island"], TARGETS["blobs"]]
    rules = {"operators": operators, "faces": "quads" if operators == "modeller" else "any"}
    check_agent(agent, shapes, reports_a_step=2 if name == "mcts_paper" else 1, **rules)
    once = {target: agent.solve(simulator(target, **rules)) for target in TARGETS}
    for target, solution in once.items():
        assert_consistent(solution, simulator(target, **rules))
    anew = other.solve(simulator("island", **rules))
    assert once["island"].sequence.to_json() == anew.sequence.to_json() != once["house"].sequence.to_json()


@pytest.mark.slow
@pytest.mark.parametrize("name", WITH_NETWORKS)
def test_agent_with_networks__conforms(name: str, options: dict[str, dict[str, Any]]) -> None:
    agent, anew = (quick(name, **options[name]) for _ in range(2))
    check_agent(agent, [TARGETS["house"], TARGETS["island"]], max_steps=3)
    game = simulator("island", max_steps=3)
    once = agent.solve(game)
    assert_consistent(once, game)
    assert once.sequence.to_json() == anew.solve(game).sequence.to_json()


def test_registry__has_no_other_agents() -> None:
    assert set(WITH_NETWORKS) < set(AGENTS)


def test_examples__are_true() -> None:
    assert doctest.testmod(conformance).failed == 0


def test_samples__are_more_than_a_rectangle() -> None:
    assert [shape.name for shape in sample_silhouettes()] == ["tower", "frame"]
    assert all(0.2 < shape.mask.mean() < 0.5 and not shape.mask[0].any() for shape in sample_silhouettes())


# --- agents that break a rule ---


class Plain(Agent):
    """Takes the first action that scores higher, and lets a test spoil what comes of it."""

    name = "plain"
    spoil: Callable[[Solution], Any] = staticmethod(lambda solution: solution)

    def act(self, simulator: Simulator, state: State) -> Decision:
        better = [one for one in simulator.transition_all(state) if one.score.total > state.score.total]
        return Decision(better[0].action or STOP) if better else Decision(STOP)

    def solve(self, simulator: Simulator, budget: Budget | None = None, on_progress: Any = None) -> Any:
        return self.spoil(super().solve(simulator, budget, on_progress))


class Forgetful(Plain):
    """Plays on whatever the budget."""

    def solve(self, simulator: Simulator, budget: Budget | None = None, on_progress: Any = None) -> Any:
        return super().solve(simulator, None, on_progress)


class Silent(Plain):
    def solve(self, simulator: Simulator, budget: Budget | None = None, on_progress: Any = None) -> Any:
        return super().solve(simulator, budget)


class Moody(Plain):
    """Does not start from the same place twice."""

    n_solved = 0

    def act(self, simulator: Simulator, state: State) -> Decision:
        return Decision(STOP) if self.n_solved % 3 else super().act(simulator, state)

    def solve(self, simulator: Simulator, budget: Budget | None = None, on_progress: Any = None) -> Any:
        self.n_solved += 1
        return super().solve(simulator, budget, on_progress)


class Deaf(Plain):
    """Lets Ctrl-C through."""

    def solve(self, simulator: Simulator, budget: Budget | None = None, on_progress: Any = None) -> Any:
        stopped = []

        def report(progress: Progress) -> None:
            try:
                on_progress(progress)
            except KeyboardInterrupt:
                stopped.append(progress)

        solution = super().solve(simulator, budget, report if on_progress else None)
        if stopped:
            raise KeyboardInterrupt
        return solution


class Stubborn(Deaf):
    """Goes on after Ctrl-C."""

    def solve(self, simulator: Simulator, budget: Budget | None = None, on_progress: Any = None) -> Any:
        try:
            return super().solve(simulator, budget, on_progress)
        except KeyboardInterrupt:
            return super().solve(simulator, budget)


class Blind(Plain):
    """Does not look at the guidance."""

    def solve(self, simulator: Simulator, budget: Budget | None = None, on_progress: Any = None) -> Any:
        plain = Simulator(simulator.silhouette, resolution=simulator.resolution, max_steps=simulator.max_steps)
        return super().solve(plain if simulator.guidance.names else simulator, budget, on_progress)


class Unwilling(Plain):
    takes_guidance = False


class Wild(Plain):
    def act(self, simulator: Simulator, state: State) -> Decision:
        return Decision(Action("edge_subdivide", 999))


class Overconfident(Plain):
    def act(self, simulator: Simulator, state: State) -> Decision:
        return replace(super().act(simulator, state), policy={STOP: 0.7, simulator.legal_actions(state)[1]: 0.7})


class Undecided(Plain):
    def act(self, simulator: Simulator, state: State) -> Any:
        return super().act(simulator, state).action


def spoilt(spoil: Callable[[Solution], Any]) -> Agent:
    agent = Plain()
    agent.spoil = spoil  # type: ignore[method-assign]
    return agent


def moved(solution: Solution) -> Solution:
    return replace(solution, mesh=solution.mesh.with_vertices(solution.mesh.vertices + 1e-12))


def boasting(solution: Solution) -> Solution:
    return replace(solution, score=replace(solution.score, total=99.0))


def unsettled(solution: Solution) -> Solution:
    return replace(solution, sequence=replace(solution.sequence, settings={}))


def mistold(solution: Solution) -> Solution:
    start_score = {**solution.sequence.start_score, "total": -1.0}
    return replace(solution, sequence=replace(solution.sequence, start_score=start_score))


SMALL: dict[str, Any] = {"resolution": 16, "max_steps": 4}


@pytest.mark.slow
def test_plain__conforms() -> None:
    check_agent(Plain(), **SMALL)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("agent", "rule"),
    [
        (spoilt(lambda _: None), r"test_conformance:Plain: solve returned None; expected a Solution"),
        (spoilt(lambda s: replace(s, mesh=None)), r"the mesh of its Solution is None; expected a PolyMesh"),
        (spoilt(moved), "they must be the same, bit for bit"),
        (spoilt(boasting), "the score is not the mesh's `final_score`"),
        (spoilt(mistold), "step 0: the score is not its `final_score`"),
        (spoilt(unsettled), "settings lack the simulator's"),
        (Moody(), "another sequence the second time"),
        (Forgetful(), "a budget of 0 refits: it goes on after"),
        (Silent(), "no progress is reported"),
        (Deaf(), "KeyboardInterrupt in report 1 comes out of solve"),
        (Stubborn(), "KeyboardInterrupt in report 1: stopped_by is 'finished'; expected interrupted"),
        (Blind(), "lack the simulator's|a locked vertex is not where it was"),
        (Unwilling(), "does not refuse start, locked with a ConfigError"),
        (Wild(), "IllegalActionError.* from .*:Wild; expected a Solution from its solve"),
        (Overconfident(), "a policy that does not sum to 1"),
        (Undecided(), r":Undecided: act returned Action.*; expected a Decision"),
        (Plain, "is no agent"),
    ],
    ids=lambda value: value if isinstance(value, str) else type(value).__name__,
)
def test_check__names_the_rule_that_is_broken(agent: Agent, rule: str) -> None:
    with pytest.raises(ConformanceError, match=rule) as caught:
        check_agent(agent, **SMALL)
    assert "\n" not in str(caught.value)
