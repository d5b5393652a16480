"""`oracle`: as much as the operators can reach, for small problems, whatever it costs: to measure other agents by."""

import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

from agents.base import Agent, Decision
from agents.baselines.beam import BeamAgent, BeamConfig
from agents.budget import Budget, Meter, Progress
from agents.finish import finish
from agents.solution import Solution, Track
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import canonical_hash
from autopoly_env.operators import STOP
from autopoly_env.simulator import Simulator, State

_NARROW = (1, 8)  # widths that are tried, too: now and then a narrow beam finds what a wide one has crowded out


@dataclass(frozen=True)
class OracleConfig(BeamConfig):
    """How `oracle` searches."""

    width: int = 64  # of the widest beam; 0: everything that `depth` steps can reach, as long as it takes
    depth: int | None = None  # steps from the start at most

    def __post_init__(self) -> None:
        if self.width == 0 and self.depth is None:
            raise ConfigError("width = 0, which leaves nothing out: expected a depth, such as depth=3")
        if self.depth is not None and self.depth < 1:
            raise ConfigError(f"depth = {self.depth}: expected at least 1")
        BeamConfig(self.width or 1, self.patience, self.stuck_discount, self.merge_grid)  # raises


class OracleAgent(Agent):
    """The best of beams up to a large width, or of a search that leaves nothing out."""

    name = "oracle"
    config_class = OracleConfig

    def __init__(self, config: OracleConfig) -> None:
        self._config = config

    def act(self, simulator: Simulator, state: State) -> Decision:
        """The first step towards the best shape; STOP where none is better."""
        start = Track(state)
        found = (best for _, best in self._bests(simulator, start, Meter.unlimited()))
        best = max(found, key=lambda track: simulator.standing(track.state))
        if best is start:
            return Decision(STOP, value=state.score.total)
        action = best.states()[1].action
        assert action is not None
        return Decision(action, value=best.state.score.total)

    def solve(
        self,
        simulator: Simulator,
        budget: Budget | None = None,
        on_progress: Callable[[Progress], None] | None = None,
    ) -> Solution:
        """As every agent; never worse than a beam of each width, when both are finished."""
        meter = Meter(budget or Budget(), on_progress)
        start = Track(simulator.initial())
        bests = {0: start}
        try:
            meter.add([start.state])
            for number, best in self._bests(simulator, start, meter):
                bests[number] = best
        except KeyboardInterrupt:
            meter.stopped_by = "interrupted"
        solutions = [finish(simulator, best.states(), meter) for best in bests.values()]
        chosen = max(solutions, key=lambda solution: simulator.worth(solution.mesh))
        return replace(chosen, stats=meter.stats())

    def _bests(self, simulator: Simulator, start: Track, meter: Meter) -> Iterator[tuple[int, Track]]:
        """(number of the search, what is the best in it so far), beginning with the start."""
        for number, beam in enumerate(self._beams(start)):
            best = start
            yield number, best
            for track in beam._search(simulator, start, meter):
                if simulator.standing(track.state) > simulator.standing(best.state):
                    best = track
                    yield number, best

    def _beams(self, start: Track) -> "Iterator[_Shallow]":
        config = self._config
        deepest = sys.maxsize if config.depth is None else start.state.step + config.depth
        if config.width == 0:
            yield _Exhaustive(config, deepest)
            return
        for width in (*(narrow for narrow in _NARROW if narrow < config.width), config.width):
            yield _Shallow(replace(config, width=width), deepest)


class _Shallow(BeamAgent):
    """A beam that goes on from no shape of step `deepest` or later."""

    def __init__(self, config: BeamConfig, deepest: int) -> None:
        super().__init__(config)
        self._deepest = deepest

    def _select(self, simulator: Simulator, tracks: Iterable[Track], waived: float) -> list[Track]:
        return super()._select(simulator, [track for track in tracks if track.state.step < self._deepest], waived)


class _Exhaustive(_Shallow):
    """For one solve: goes on from every shape once, the first time that it comes up, after as few steps as it takes.

    Shapes that agree to `merge_grid` count as one.
    """

    def __init__(self, config: OracleConfig, deepest: int) -> None:
        super().__init__(BeamConfig(patience=sys.maxsize, merge_grid=config.merge_grid), deepest)
        self._known: set[str] = set()

    def _search(self, simulator: Simulator, track: Track, meter: Meter) -> Iterator[Track]:
        self._select(simulator, [track], 0.0)
        yield from super()._search(simulator, track, meter)

    def _select(self, simulator: Simulator, tracks: Iterable[Track], waived: float) -> list[Track]:
        fresh = []
        for track in sorted(tracks, key=lambda track: simulator.standing(track.state), reverse=True):
            shape = canonical_hash(track.state.mesh, self._config.merge_grid)
            if track.state.step < self._deepest and shape not in self._known:
                self._known.add(shape)
                fresh.append(track)
        return fresh
