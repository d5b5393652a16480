"""`choice-prior`: the tree search with ChoiceNet's priors."""

from collections.abc import Callable, Sequence

from agents.base import Agent, Decision
from agents.budget import Budget, Progress
from agents.choice.config import ChoicePriorConfig
from agents.choice.evaluator import ChoiceEvaluator
from agents.choice.weights import load_choice
from agents.search.mcts import MctsAgent
from agents.solution import Solution
from autopoly_env.simulator import Simulator, State


class ChoicePriorAgent(MctsAgent):
    """Seeds, then trees with priors that a search has taught, then hops as `mcts`."""

    name = "choice-prior"

    def __init__(self, config: ChoicePriorConfig, incumbents: Sequence[Agent], evaluator: ChoiceEvaluator) -> None:
        super().__init__(config, incumbents, evaluator)
        self._choice = evaluator

    def check(self, simulator: Simulator) -> None:
        """As every agent; raises ConfigError also where the weights do not know the rule, price or operators."""
        super().check(simulator)
        self._choice.check(simulator)

    def act(self, simulator: Simulator, state: State) -> Decision:
        """As every agent; raises ConfigError as `check`."""
        self._choice.check(simulator)
        return super().act(simulator, state)

    def solve(
        self,
        simulator: Simulator,
        budget: Budget | None = None,
        on_progress: Callable[[Progress], None] | None = None,
    ) -> Solution:
        """As every agent; raises ConfigError as `check`."""
        self._choice.check(simulator)
        return super().solve(simulator, budget, on_progress)


def choice_prior(config: ChoicePriorConfig, incumbents: Sequence[Agent] = ()) -> Agent:
    """The agent of a config; `incumbents` are the agents that it names as seeds. Raises as `load_choice`."""
    return ChoicePriorAgent(config, incumbents, ChoiceEvaluator(load_choice(config.weights), config.temperature))
