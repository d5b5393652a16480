"""`random`: uniform over the legal actions; the floor under every comparison."""

from dataclasses import dataclass

import numpy as np

from agents.base import Agent, Decision
from autopoly_env.errors import ConfigError
from autopoly_env.operators import STOP, Action
from autopoly_env.simulator import Simulator, State


@dataclass(frozen=True)
class RandomConfig:
    """How `random` plays."""

    seed: int = 0
    n_steps: int = 20  # after which it stops

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise ConfigError(f"seed {self.seed}: expected at least 0")


class RandomAgent(Agent):
    """Draws an operator, then one of its legal elements, so that operators with many elements are not favoured."""

    name = "random"
    config_class = RandomConfig

    def __init__(self, config: RandomConfig) -> None:
        self._config = config

    def act(self, simulator: Simulator, state: State) -> Decision:
        legal = simulator.legal_actions(state)[1:]
        if not legal or state.step >= self._config.n_steps:
            return Decision(STOP)
        rng = np.random.default_rng((self._config.seed, state.step))  # whatever was solved before
        by_operator: dict[str, list[Action]] = {}
        for action in legal:
            by_operator.setdefault(action.operator, []).append(action)
        chosen = by_operator[sorted(by_operator)[rng.integers(len(by_operator))]]
        share = 1.0 / len(by_operator)
        policy = {a: share / len(group) for group in by_operator.values() for a in group}
        return Decision(chosen[rng.integers(len(chosen))], policy)
