"""`greedy` and `beam`: keep the w best shapes, try everything on each, go on for a while where nothing improves."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from agents.base import Agent, Decision
from agents.budget import Meter
from agents.solution import Track
from autopoly_env.arguments import above, at_least
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import canonical_hash
from autopoly_env.operators import STOP
from autopoly_env.simulator import Simulator, State


@dataclass(frozen=True)
class BeamConfig:
    """How `beam` searches."""

    width: int = 8
    patience: int = 4  # steps in a row that may fail to improve the best score
    stuck_discount: float = 0.5  # share of the price of complexity that ranking waives while nothing has improved
    merge_grid: float = 1 / 128  # shapes that agree to this length (unit square) count as one

    def __post_init__(self) -> None:
        at_least(1, width=self.width, patience=self.patience)
        above(0, merge_grid=self.merge_grid)
        if not 0.0 <= self.stuck_discount <= 1.0:
            raise ConfigError(f"stuck_discount = {self.stuck_discount}: expected a share, 0 to 1")


class BeamAgent(Agent):
    """Beam search over whole transitions: every legal action of every kept shape, refitted and scored."""

    name = "beam"
    config_class = BeamConfig

    def __init__(self, config: BeamConfig) -> None:
        self._config = config

    def act(self, simulator: Simulator, state: State) -> Decision:
        """The best child by score; STOP where no child is better."""
        children = simulator.transition_all(state)
        best = max(children, key=lambda child: child.score.total, default=None)
        if best is None or best.action is None or best.score.total <= state.score.total:
            return Decision(STOP, value=state.score.total)
        return Decision(best.action, value=best.score.total)

    def _search(self, simulator: Simulator, track: Track, meter: Meter) -> Iterator[Track]:
        best_total, kept, failures = simulator.standing(track.state), [track], 0
        while kept and failures < self._config.patience and not meter.spent():
            tracks = []
            for parent in kept:
                if meter.spent():
                    break
                n_before = simulator.n_refits
                states = simulator.transition_all(parent.state)
                n_refits = simulator.n_refits - n_before
                children = [Track(state, parent) for state in states if simulator.is_sound(state.mesh)]
                yield from children
                meter.add(states, n_refits)
                tracks += children
            waived = simulator.weights.w_sc * self._config.stuck_discount if failures else 0.0
            kept = self._select(simulator, tracks, waived)
            failures += 1
            top = max((simulator.standing(track.state) for track in kept), default=best_total)
            if top > best_total:
                best_total, failures = top, 0

    def _select(self, simulator: Simulator, tracks: Iterable[Track], waived: float) -> list[Track]:
        """The `width` best of them, best first, no shape twice; complexity counts `waived` less than in the score."""

        def rank(track: Track) -> float:
            return -simulator.standing(track.state) - waived * track.state.score.complexity

        chosen: dict[str, Track] = {}
        for track in sorted(tracks, key=rank):
            chosen.setdefault(canonical_hash(track.state.mesh, self._config.merge_grid), track)
            if len(chosen) == self._config.width:
                break
        return list(chosen.values())


@dataclass(frozen=True)
class GreedyConfig(BeamConfig):
    """How `greedy` searches."""

    width: int = 1


class GreedyAgent(BeamAgent):
    """A beam of width 1."""

    name = "greedy"
    config_class = GreedyConfig
