"""`choice-prior`: the tree search with ChoiceNet's priors."""

from collections.abc import Sequence

from agents.base import Agent
from agents.choice.config import ChoicePriorConfig
from agents.choice.evaluator import ChoiceEvaluator
from agents.choice.joint import JointEvaluator, KnowingEvaluator
from agents.choice.weights import load_choice
from agents.guided.agent import nfap_evaluator
from agents.knowing import KnowingAgent, Known
from agents.search.mcts import MctsAgent


class ChoicePriorAgent(KnowingAgent, MctsAgent):
    """Seeds, then trees with priors that a search has taught, then hops as `mcts`."""

    name = "choice-prior"

    def __init__(self, config: ChoicePriorConfig, incumbents: Sequence[Agent], evaluator: KnowingEvaluator) -> None:
        super().__init__(config, incumbents, evaluator)
        self._choice = evaluator

    @property
    def known(self) -> Known:
        return self._choice.known


def choice_prior(config: ChoicePriorConfig, incumbents: Sequence[Agent] = ()) -> Agent:
    """The agent of a config; `incumbents` are the agents that it names as seeds. Raises as `load_choice`.

    With nFAP-Net as `nfap_evaluator`, too.
    """
    evaluator: KnowingEvaluator = ChoiceEvaluator(load_choice(config.weights), config.temperature)
    if config.with_nfap:
        nfap = nfap_evaluator("choice-prior", config.nfap_weights, config.temperature)
        evaluator = JointEvaluator(nfap, evaluator)
    return ChoicePriorAgent(config, incumbents, evaluator)
