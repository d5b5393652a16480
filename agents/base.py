"""What every agent is: something that chooses actions, and something that solves a target within a budget."""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice, pairwise
from typing import TypeVar

from agents.pare import pare
from agents.settle import settle
from agents.tidy import tidy
from autopoly_env.errors import ConfigError
from autopoly_env.guidance import continued
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import STOP, Action, Choice
from autopoly_env.score import Score
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.sequence.file import Score as PlainScore
from autopoly_env.simulator import Simulator, State

_Start = TypeVar("_Start")


@dataclass(frozen=True)
class Decision:
    """What an agent does next."""

    action: Action
    policy: dict[Action, float] = field(default_factory=dict)  # probability of each action considered, if known
    value: float | None = None  # r_all that the agent expects in the end, if it has a view


@dataclass(frozen=True)
class Budget:
    """How much work a solve may do; None is no limit. It is looked at between steps: one may overrun it."""

    refits: int | None = None
    seconds: float | None = None
    simulations: int | None = None  # of a tree search, what its seeds do not counted

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if value is not None and not value >= 0:
                raise ConfigError(f"a budget of {value} {name}: expected at least 0")

    def share(self, part: float) -> "Budget":
        """A part, 0 to 1, of it."""
        return Budget(
            None if self.refits is None else round(part * self.refits),
            None if self.seconds is None else part * self.seconds,
            None if self.simulations is None else round(part * self.simulations),
        )


@dataclass(frozen=True)
class Progress:
    """Where a solve stands, for a progress bar."""

    best_total: float  # r_all of the best shape so far
    n_steps: int
    n_refits: int
    n_nodes: int = 0  # of the search tree, where there is one


@dataclass(frozen=True)
class Stats:
    """What a solve cost."""

    n_refits: int
    seconds: float
    stopped_by: str  # "finished", "interrupted", or what was spent: "refits", "seconds" or "simulations"


@dataclass(frozen=True)
class Solution:
    """The best shape found, and the sequence that builds it; scored at the silhouette's own resolution."""

    sequence: ConstructionSequence
    mesh: PolyMesh
    score: Score
    stats: Stats


class Meter:
    """Counts the work of one solve, reports it, and says when the budget is spent.

    What a part of it (`part`) counts, it counts, too.
    """

    def __init__(
        self, budget: Budget, on_progress: Callable[[Progress], None] | None = None, whole: "Meter | None" = None
    ) -> None:
        self._budget = budget
        self._on_progress = on_progress
        self._whole = whole
        self._began = time.perf_counter()
        self._n_steps = self._n_refits = self._n_simulations = self._n_nodes = 0
        self._best_total = float("-inf")
        self.stopped_by = "finished"

    @classmethod
    def unlimited(cls) -> "Meter":
        """A meter that never says stop."""
        return cls(Budget())

    def part(self, share: float) -> "Meter":
        """A meter for a share, 0 to 1, of what is left."""
        return Meter(self.rest().share(share), whole=self)

    def add(self, states: Sequence[State]) -> None:
        """Note the states that one step of work produced."""
        best = max((state.score.total for state in states), default=float("-inf"))
        self.count(sum(state.n_refits for state in states), best)

    def add_simulation(self, n_nodes: int) -> None:
        """Note a simulation that made so many new nodes, before what it did is added or counted."""
        self._n_simulations += 1
        self._n_nodes += n_nodes
        if self._whole is not None:
            self._whole.add_simulation(n_nodes)

    def count(self, n_refits: int, best_total: float) -> None:
        """Note one step of work that took `n_refits` and whose best shape has r_all `best_total`."""
        self._n_steps += 1
        self._n_refits += n_refits
        self._best_total = max(self._best_total, best_total)
        if self._whole is not None:
            self._whole.count(n_refits, best_total)
        if self._on_progress is not None:
            self._on_progress(Progress(self._best_total, self._n_steps, self._n_refits, self._n_nodes))

    def add_refits(self, n_refits: int) -> None:
        """Note refits that are no step of the work, and so nothing to report."""
        self._n_refits += n_refits
        if self._whole is not None:
            self._whole.add_refits(n_refits)

    def spent(self) -> bool:
        """Whether the budget is used up, or the one that this is a part of."""
        used = {"refits": self._n_refits, "seconds": self._seconds(), "simulations": self._n_simulations}
        for name, limit in vars(self._budget).items():
            if limit is not None and used[name] >= limit:
                self.stopped_by = name
                break
        if self._whole is not None and self._whole.spent():
            self.stopped_by = self._whole.stopped_by
        return self.stopped_by != "finished"

    def rest(self) -> Budget:
        """What is left of the budget."""
        refits, seconds, simulations = self._budget.refits, self._budget.seconds, self._budget.simulations
        return Budget(
            None if refits is None else max(0, refits - self._n_refits),
            None if seconds is None else max(0.0, seconds - self._seconds()),
            None if simulations is None else max(0, simulations - self._n_simulations),
        )

    def affordable(self, starts: Iterable[_Start]) -> list[_Start]:
        """As many of the things to refit as refits are left for."""
        return list(islice(starts, self.rest().refits))

    def stats(self) -> Stats:
        """The work so far."""
        return Stats(self._n_refits, self._seconds(), self.stopped_by)

    def _seconds(self) -> float:
        return time.perf_counter() - self._began


@dataclass(frozen=True)
class Track:
    """A state and the states that led to it."""

    state: State
    before: "Track | None" = None

    def states(self) -> list[State]:
        """From the initial state to this one."""
        track: Track | None = self
        states = []
        while track is not None:
            states.append(track.state)
            track = track.before
        return states[::-1]


class Agent(ABC):
    """Chooses actions. `solve` plays them out; an agent that does not play step by step overrides it instead."""

    name = "agent"
    runs_simulations = False  # what a budget may limit
    takes_guidance = True  # a start mesh, locked vertices and symmetry, which the transitions it plays keep to

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
                if track.state.score.total > best.state.score.total:
                    best = track
        except KeyboardInterrupt:
            meter.stopped_by = "interrupted"
        return finish(simulator, best.states(), meter)

    def _search(self, simulator: Simulator, track: Track, meter: Meter) -> Iterator[Track]:
        """Play from `track` on until it is over or the budget is spent; yield what might be the best so far."""
        while not track.state.done and not meter.spent():
            state = simulator.transition(track.state, self.act(simulator, track.state).action)
            meter.add([state])
            track = Track(state, track)
            yield track


class WholeAgent(Agent):
    """Finds its shape as a whole instead of playing step by step, and so without guidance."""

    takes_guidance = False

    def act(self, simulator: Simulator, state: State) -> Decision:
        """Always STOP: only `solve` finds shapes."""
        return Decision(STOP)

    def solve(
        self,
        simulator: Simulator,
        budget: Budget | None = None,
        on_progress: Callable[[Progress], None] | None = None,
    ) -> Solution:
        """As every agent. Raises ConfigError where the simulator has guidance that it cannot take."""
        check_guidance(self, simulator.guidance.names)
        return self._find(simulator, Meter(budget or Budget(), on_progress))

    @abstractmethod
    def _find(self, simulator: Simulator, meter: Meter) -> Solution:
        """As `solve`, within what `meter` allows."""


def check_guidance(agent: Agent, names: Sequence[str]) -> None:
    """Raise ConfigError if an agent cannot take the guidance of these names (start, locked, symmetry)."""
    if names and not agent.takes_guidance:
        raise ConfigError(
            f"{agent.name} finds outlines as a whole and cannot heed {names[0]!r}: choose an agent that plays step by "
            "step, which are beam, greedy, random and mcts"
        )


def finish(simulator: Simulator, states: Sequence[State], meter: Meter, *, keep_steps: bool = False) -> Solution:
    """The solution that `states` construct, the last mesh polished, scored at the silhouette's own resolution.

    What the shape does not need is taken away (`pare`), if the budget is not spent; the steps are told without detours
    (`tidy`) and, where the weights ask for it, with fewer moves (`settle`); none of that if `keep_steps`. A start mesh
    that nothing was done to stays as it is; a sequence that was gone on from comes before the new steps. A
    KeyboardInterrupt on the way is noted, and the work done nevertheless.
    """
    try:
        return _finish(simulator, states, meter, keep_steps)
    except KeyboardInterrupt:
        meter.stopped_by = "interrupted"
        return _finish(simulator, states, meter, keep_steps)


def _finish(simulator: Simulator, states: Sequence[State], meter: Meter, keep_steps: bool) -> Solution:
    versions = [states]
    if not (keep_steps or meter.stopped_by == "interrupted" or meter.spent()):
        pared, n_refits, n_taken = pare(simulator, states)
        meter.add_refits(n_refits)
        versions += [pared] if n_taken else []
    solutions = [_told(simulator, version, meter, keep_steps) for version in versions]
    return max(solutions, key=lambda solution: solution.score.total)


def _told(simulator: Simulator, states: Sequence[State], meter: Meter, keep_steps: bool) -> Solution:
    meshes = [state.mesh for state in states]
    if len(meshes) > 1 or simulator.guidance.start is None:
        meshes[-1] = _polished(simulator, meshes)
    scores = [simulator.final_score(mesh) for mesh in meshes]
    docked = [0.0, *(simulator.docked(*pair) for pair in pairwise(meshes))]
    last = max(range(len(scores)), key=lambda k: (scores[k].total - docked[k], -k))
    settings = {**simulator.settings(), "scored_at": simulator.silhouette.resolution}
    transitions = [
        transition
        for state, mesh, score in zip(states[1 : last + 1], meshes[1:], scores[1:], strict=False)
        for transition in _transitions_of(simulator, state, mesh, score)
    ]
    sequence = ConstructionSequence.record(settings, meshes[0], scores[0].as_dict(), transitions)
    if not keep_steps:
        sequence = settle(tidy(sequence, simulator.final_score), simulator)
    mesh, earlier = sequence.final(), simulator.guidance.earlier
    if earlier is not None:
        sequence = continued(earlier, sequence, [simulator.final_score(m).as_dict() for m in earlier.meshes()])
    return Solution(sequence, mesh, scores[last], meter.stats())


def _polished(simulator: Simulator, meshes: Sequence[PolyMesh]) -> PolyMesh:
    """The last mesh polished, unless that moves too much of what was there before the last step."""
    *before, mesh = meshes
    polished = simulator.polish(mesh)
    if not before or not simulator.docked(before[-1], polished):
        return polished
    worth = [simulator.final_score(m).total - simulator.docked(before[-1], m) for m in (polished, mesh)]
    return polished if worth[0] >= worth[1] else mesh


def _transitions_of(
    simulator: Simulator, state: State, mesh: PolyMesh, score: Score
) -> Iterator[tuple[Action, Choice | None, PolyMesh, PlainScore]]:
    """The steps, one or two, that led to a state, with `mesh` for its mesh, as a sequence records them."""
    if state.action is None:
        return
    if state.halfway is None:
        yield state.action, state.choice, mesh, score.as_dict()
        return
    between = state.halfway
    yield state.action, state.choice, between.mesh, simulator.final_score(between.mesh).as_dict()
    yield between.action, between.choice, mesh, score.as_dict()
