"""What the weights of a network know, as they say it, and agents that heed it.

Actions of operators that the weights do not know are masked by whoever asks the network; a rule of faces or a price of
complexity that they do not know is refused, and so are operators of which they know none.
"""

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

from agents.base import Agent, Decision
from agents.budget import Budget, Progress
from agents.solution import Solution
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import FaceRule
from autopoly_env.operators import operator_named
from autopoly_env.simulator import Simulator, State


@dataclass(frozen=True)
class Known:
    """What weights may be asked about."""

    classes: tuple[str, ...]  # of actions, by name
    rules: tuple[FaceRule, ...]  # none: they are not told the rule
    w_sc: tuple[float, float] | None  # prices, from and to; None: they are not told the price

    def check(self, simulator: Simulator) -> None:
        """Raise ConfigError where they know nothing of the simulator's rule, price or any of its operators."""
        if self.rules and simulator.faces not in self.rules:
            known = ", ".join(self.rules)
            raise ConfigError(f"these weights know faces={known}, not {simulator.faces}: give one of them, or others")
        low, high = self.w_sc or (0.0, float("inf"))
        if not low <= simulator.weights.w_sc <= high:
            raise ConfigError(
                f"these weights know w_sc {low:g} to {high:g}, not {simulator.weights.w_sc:g}: give others"
            )
        if self.rules and len(self.unknown(simulator)) == len(simulator.operators):
            raise ConfigError(
                f"these weights know {', '.join(self.classes)}, none of which is an operator here: give others"
            )

    def shared_with(self, other: "Known") -> "Known":
        """The rules and prices that both know, and the actions that either does."""
        rules = tuple(rule for rule in self.rules if rule in other.rules) if self.rules and other.rules else ()
        if self.w_sc is None or other.w_sc is None:
            w_sc = self.w_sc or other.w_sc
        else:
            w_sc = max(self.w_sc[0], other.w_sc[0]), min(self.w_sc[1], other.w_sc[1])
        return Known(tuple(dict.fromkeys((*self.classes, *other.classes))), rules or self.rules or other.rules, w_sc)

    def unknown(self, simulator: Simulator) -> list[str]:
        """The simulator's operators that they do not know: their actions come last."""
        return [name for name in simulator.operators if not set(operator_named(name).classes) & set(self.classes)]


class KnowingAgent(Agent):
    """Refuses what its weights do not know."""

    @property
    @abstractmethod
    def known(self) -> Known:
        """What its weights know."""

    def check(self, simulator: Simulator) -> None:
        """As every agent; raises ConfigError also where the weights do not know the rule, price or operators."""
        super().check(simulator)
        self.known.check(simulator)

    def act(self, simulator: Simulator, state: State) -> Decision:
        """As every agent; raises ConfigError as `check`."""
        self.known.check(simulator)
        return super().act(simulator, state)  # type: ignore[safe-super]

    def solve(
        self,
        simulator: Simulator,
        budget: Budget | None = None,
        on_progress: Callable[[Progress], None] | None = None,
    ) -> Solution:
        """As every agent; raises ConfigError as `check`."""
        self.known.check(simulator)
        return super().solve(simulator, budget, on_progress)
