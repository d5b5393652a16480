"""What every agent is: something that chooses actions, and something that solves a target within a budget."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

from agents.budget import Budget, Meter, Progress
from agents.finish import finish
from agents.solution import Solution, Track
from autopoly_env.errors import ConfigError, ConformanceError, IllegalActionError
from autopoly_env.operators import STOP, Action
from autopoly_env.simulator import Simulator, State


@dataclass(frozen=True)
class Decision:
    """What an agent does next."""

    action: Action
    policy: dict[Action, float] = field(default_factory=dict)  # probability of each action considered, if known
    value: float | None = None  # r_all that the agent expects in the end, if it has a view


class Agent(ABC):
    """Chooses actions. `solve` plays them out; an agent that does not play step by step overrides it instead."""

    name = "agent"
    config_class: ClassVar[type[Any] | None] = None  # a dataclass, all with defaults, that __init__ takes one of
    runs_simulations = False  # what a budget may limit
    takes_guidance = True  # a start mesh and locked vertices, which the transitions it plays keep to
    takes_symmetry = True  # the last mesh is symmetric where that is asked for
    takes_faces = True  # a rule of faces, which these transitions keep as well

    def check(self, simulator: Simulator) -> None:
        """Raise ConfigError if it cannot take what the simulator asks for: its guidance, rule of faces, operators."""
        check_guidance(self, simulator.guidance.names)
        check_faces(self, simulator)

    def suits(self, simulator: Simulator) -> bool:
        """Whether `check` finds nothing."""
        try:
            self.check(simulator)
        except ConfigError:
            return False
        return True

    @abstractmethod
    def act(self, simulator: Simulator, state: State) -> Decision:
        """Choose the next action in `state`."""

    def solve(
        self,
        simulator: Simulator,
        budget: Budget | None = None,
        on_progress: Callable[[Progress], None] | None = None,
    ) -> Solution:
        """Build the target; return the best-scoring prefix of the states that were visited.

        Stops at the budget, too. KeyboardInterrupt (Ctrl-C) ends the search and returns the best so far, with
        `stats.stopped_by` "interrupted".
        """
        meter = Meter(budget or Budget(), on_progress)
        best = Track(simulator.initial())
        try:
            meter.add([best.state])
            for track in self._search(simulator, best, meter):
                if simulator.standing(track.state) > simulator.standing(best.state):
                    best = track
        except KeyboardInterrupt:
            meter.stopped_by = "interrupted"
        return finish(simulator, best.states(), meter)

    def _search(self, simulator: Simulator, track: Track, meter: Meter) -> Iterator[Track]:
        """Play from `track` on until it is over or the budget is spent; yield what might be the best so far.

        All refits count that the simulator does meanwhile, those of `act` among them. A step without room is idle.
        """
        while not track.state.done and not meter.spent():
            n_before = simulator.n_refits
            action = self._decided(simulator, track.state).action
            try:
                state = simulator.transition(track.state, action)
            except IllegalActionError:
                if action not in simulator.legal_actions(track.state):
                    raise
                state = simulator.idle(track.state)
            meter.add([state], simulator.n_refits - n_before)
            track = Track(state, track)
            yield track

    def _decided(self, simulator: Simulator, state: State) -> Decision:
        """What `act` decides. Raises ConformanceError where that is no decision."""
        decision: Any = self.act(simulator, state)
        if isinstance(decision, Decision) and isinstance(decision.action, Action):
            return decision
        raise ConformanceError(f"{full_name(self)}: act returned {decision!r:.60}; expected a Decision with an Action")


class WholeAgent(Agent):
    """Finds its shape as a whole instead of playing step by step: as a rule without guidance and rules of faces."""

    takes_guidance = False
    takes_symmetry = False
    takes_faces = False

    def act(self, simulator: Simulator, state: State) -> Decision:
        """Always STOP: only `solve` finds shapes."""
        return Decision(STOP)

    def solve(
        self,
        simulator: Simulator,
        budget: Budget | None = None,
        on_progress: Callable[[Progress], None] | None = None,
    ) -> Solution:
        """As every agent. Raises ConfigError as `check` does."""
        self.check(simulator)
        return self._find(simulator, Meter(budget or Budget(), on_progress))

    @abstractmethod
    def _find(self, simulator: Simulator, meter: Meter) -> Solution:
        """As `solve`, within what `meter` allows."""


def full_name(agent: Agent) -> str:
    """The agent's class and the module that it is in, as in my.module:MyAgent."""
    return f"{type(agent).__module__}:{type(agent).__qualname__}"


def check_guidance(agent: Agent, names: Sequence[str]) -> None:
    """Raise ConfigError if an agent cannot take the guidance of these names (start, locked, symmetry)."""
    refused = [name for name in names if not (agent.takes_symmetry if name == "symmetry" else agent.takes_guidance)]
    if refused:
        raise ConfigError(
            f"{agent.name} finds outlines as a whole and cannot heed {refused[0]!r}: choose an agent that plays step "
            "by step, such as mcts, beam or greedy (docs/guidance.md)"
        )


def check_faces(agent: Agent, simulator: Simulator) -> None:
    """Raise ConfigError if an agent cannot keep the simulator's rule of faces."""
    if simulator.faces != "any" and not agent.takes_faces:
        raise ConfigError(
            f"{agent.name} finds outlines, whatever their faces, and cannot keep faces={simulator.faces}: choose an "
            "agent that plays step by step, such as mcts, beam or greedy, or faces=any"
        )
