"""How much work a solve may do, and how much it has done."""

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from typing import TypeVar

from agents.solution import Stats
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh
from autopoly_env.shown import short
from autopoly_env.simulator import State

_Start = TypeVar("_Start")
Shape = Callable[[], PolyMesh]  # makes the mesh of a shape, or its rings as faces, holes wound backwards


# A tree search is bounded also where its states cost no refit, as those of `nfap-mcts`, or nothing new is made.
STATES_A_REFIT = 200  # states of a tree, and simulations, for each refit of the budget
MOST_STATES = 200_000  # whatever the budget is: about 2 GB


@dataclass(frozen=True)
class Budget:
    """How much work a solve may do; None is no limit. It is looked at between steps: one may overrun it.

    A tree has at most `MOST_STATES` states, and `STATES_A_REFIT` for each refit where these are limited.
    """

    refits: int | None = None
    seconds: float | None = None
    simulations: int | None = None  # of a tree search, what its seeds do not counted

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if value is not None and (name == "seconds" or isinstance(value, int)) and value >= 0:
                continue
            if value is not None:
                kind = "a number" if name == "seconds" else "a whole number"
                raise ConfigError(f"a budget of {short(value)} {name}: expected {kind} of at least 0")

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
    best: Shape | None = None  # the best shape so far, where the agent shows it
    tried: Shape | None = None  # the one that was tried last


class Clock:
    """The seconds that budgets count: those of a pause stand still. One for a process, which solves one at a time."""

    def __init__(self) -> None:
        self._paused = 0.0

    def seconds(self) -> float:
        """Seconds since some moment, pauses left out."""
        return time.perf_counter() - self._paused

    @contextmanager
    def standing(self) -> Iterator[None]:
        """A pause."""
        began = time.perf_counter()
        try:
            yield
        finally:
            self._paused += time.perf_counter() - began


CLOCK = Clock()


class Meter:
    """Counts the work of one solve, reports it, and says when the budget is spent.

    What a part of it (`part`) counts, it counts, too.
    """

    def __init__(
        self, budget: Budget, on_progress: Callable[[Progress], None] | None = None, whole: "Meter | None" = None
    ) -> None:
        self._budget = budget
        n_refits = MOST_STATES if budget.refits is None else STATES_A_REFIT * budget.refits
        self._most_states = min(MOST_STATES, n_refits)
        self._on_progress = on_progress
        self._whole = whole
        self._began = CLOCK.seconds()
        self._n_steps = self._n_refits = self._n_simulations = self._n_nodes = 0
        self._best: Shape | None = None
        self._best_total = float("-inf")
        self.stopped_by = "finished"

    @classmethod
    def unlimited(cls) -> "Meter":
        """A meter that never says stop."""
        return cls(Budget())

    def part(self, share: float) -> "Meter":
        """A meter for a share, 0 to 1, of what is left."""
        return Meter(self.rest().share(share), whole=self)

    def add(self, states: Sequence[State], n_refits: int = 0) -> None:
        """Note the states that one step of work produced.

        `n_refits` that the simulator has counted meanwhile are more than those of the states where some had no room.
        """
        best = max(states, key=lambda state: state.score.total, default=None)
        n_refits = max(n_refits, sum(state.n_refits for state in states))
        if best is None:
            self.count(n_refits, float("-inf"))
        else:
            self.count(n_refits, best.score.total, lambda: best.mesh)

    def add_simulation(self, n_nodes: int) -> None:
        """Note a simulation that made so many new nodes, before what it did is added or counted."""
        self._n_simulations += 1
        self._n_nodes += n_nodes
        if self._whole is not None:
            self._whole.add_simulation(n_nodes)

    def count(self, n_refits: int, best_total: float, shape: Shape | None = None) -> None:
        """Note one step of work that took `n_refits` and whose best shape has r_all `best_total`.

        `shape` makes that one's mesh, for whoever watches; it is called while the step is reported, or never.
        """
        self._n_steps += 1
        self._n_refits += n_refits
        if best_total > self._best_total:
            self._best_total, self._best = best_total, shape or self._best
        if self._whole is not None:
            self._whole.count(n_refits, best_total, shape)
        if self._on_progress is not None:
            seen = self._n_steps, self._n_refits, self._n_nodes
            self._on_progress(Progress(self._best_total, *seen, self._best, shape))

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
        if self.stopped_by == "finished" and max(self._n_nodes, self._n_simulations) >= self._most_states:
            self.stopped_by = "states"
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
        return CLOCK.seconds() - self._began


class Foresight(Meter):
    """A meter for a search whose shapes are foreseen only: it ends where `of` does, by its seconds and states, too.

    Its states and simulations count there, too; its shapes are no results and are not reported.
    """

    def __init__(self, of: Meter) -> None:
        super().__init__(of.rest(), whole=of)

    def count(self, n_refits: int, best_total: float, shape: Shape | None = None) -> None:
        """Note one step of work, which whoever looks ahead counts, if it was worth a refit."""
        self._n_steps += 1
        self._n_refits += n_refits
        self._best_total = max(self._best_total, best_total)
