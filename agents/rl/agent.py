"""`ppo`, `maskable-ppo`, `a2c`, `dqn`: trained policies as agents; `rl-prior`: the tree search with one as prior."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from agents.base import Agent, Decision
from agents.budget import Meter
from agents.extras import require
from agents.rl.config import RlConfig, RlPriorConfig
from agents.search.mcts import MctsAgent
from agents.solution import Track
from autopoly_env.compute import n_threads
from autopoly_env.operators import STOP
from autopoly_env.simulator import Simulator, State

if TYPE_CHECKING:
    from agents.rl.player import Player

PRIOR = "maskable-ppo"  # whose weights `rl-prior` takes


class RlAgent(Agent):
    """Plays what a policy says, once or `k` times, of which the best counts. A budget may end it earlier."""

    def __init__(self, name: str, config: RlConfig, player: "Player") -> None:
        self.name = name
        self._config, self._player = config, player

    def check(self, simulator: Simulator) -> None:
        """As every agent; raises ConfigError also where the weights do not know the rule, price or operators."""
        super().check(simulator)
        self._player.check(simulator)

    def act(self, simulator: Simulator, state: State) -> Decision:
        """The likeliest action, or one that is drawn."""
        config = self._config
        if state.step >= self._player.spec.max_steps:
            return Decision(STOP)
        action = self._player.ranked(simulator, state, self._rng(0, state.step), config.temperature)[0]
        return Decision(action, self._player.probabilities(simulator, state, config.temperature))

    def _search(self, simulator: Simulator, track: Track, meter: Meter) -> Iterator[Track]:
        """All plays, one after the other, each from `track` on."""
        for number in range(self._config.k):
            if meter.spent():
                return
            rng = self._rng(number, track.state.step)
            yield from self._player.play(simulator, track, meter, rng, self._config.temperature)

    def _rng(self, number: int, step: int) -> np.random.Generator | None:
        """What the play of this number is drawn with from a step on; None where it takes what is likeliest."""
        if self._config.play == "greedy" and number == 0:
            return None
        return np.random.default_rng((self._config.seed, number, step))


class RlPriorAgent(MctsAgent):
    """Tree search with a policy's priors and exact refits."""

    name = "rl-prior"

    def __init__(self, config: RlPriorConfig, incumbents: Sequence[Agent], player: "Player") -> None:
        from agents.rl.evaluator import RlEvaluator

        super().__init__(config, incumbents, RlEvaluator(player, config.temperature))
        self._player = player

    def check(self, simulator: Simulator) -> None:
        """As every agent; raises ConfigError also where the weights do not know the rule, price or operators."""
        super().check(simulator)
        self._player.check(simulator)


def rl_agent(name: str, config: RlConfig) -> Agent:
    """The agent of a config. Raises ConfigError if its weights are missing or damaged."""
    return RlAgent(name, config, _player(name, name, config.weights))


def rl_prior(config: RlPriorConfig, incumbents: Sequence[Agent] = ()) -> Agent:
    """The agent of a config; `incumbents` are the agents that it names as seeds. Raises ConfigError as `rl_agent`."""
    return RlPriorAgent(config, incumbents, _player("rl-prior", PRIOR, config.weights))


def _player(name: str, owner: str, weights: str) -> "Player":
    """The policy in a file, or the one that comes with agent `owner`. Keeps torch to this process's threads."""
    require("learn", f"agent {name!r}", "safetensors", "torch")
    import torch

    from agents.rl.player import Player
    from agents.rl.weights import file_of, load_policy

    torch.set_num_threads(n_threads())
    net, _ = load_policy(file_of(owner, weights))
    return Player(net, name)
