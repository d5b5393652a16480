"""What comes of a solve: the states on the way, and the best shape with the sequence that builds it."""

from dataclasses import dataclass

from autopoly_env.mesh import PolyMesh
from autopoly_env.score import Score
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.simulator import State

OVER_BUDGET = "over budget"


@dataclass(frozen=True)
class Stats:
    """What a solve cost."""

    n_refits: int
    seconds: float
    # "finished", "interrupted", or what was spent: "refits", "seconds", "simulations" or "states"; OVER_BUDGET where an
    # agent did more refits than it was given, and did not count them
    stopped_by: str


@dataclass(frozen=True)
class Solution:
    """The best shape found, and the sequence that builds it; scored at the silhouette's own resolution."""

    sequence: ConstructionSequence
    mesh: PolyMesh
    score: Score
    stats: Stats


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
