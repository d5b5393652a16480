"""Roll-outs: play on from a leaf to learn what it may become."""

from collections.abc import Sequence

import numpy as np

from agents.search.evaluator import Evaluator
from agents.solution import Track
from autopoly_env.simulator import Simulator


def roll_out(
    simulator: Simulator, evaluator: Evaluator, track: Track, n_steps: int, rng: np.random.Generator
) -> list[Track]:
    """Up to `n_steps` tracks on from `track`, each action drawn from the evaluator's prior.

    It ends early where nothing is legal, or the action drawn has no room.
    """
    tracks: list[Track] = []
    while len(tracks) < n_steps:
        actions = simulator.legal_actions(track.state)[1:]
        if not actions:
            break
        drawn = rng.choice(len(actions), p=evaluator.prior(simulator, track.state, actions))
        states = evaluator.expand(simulator, track.state, [actions[int(drawn)]])
        if not states:
            break
        track = Track(states[0], track)
        tracks.append(track)
    return tracks


def value_of(totals: Sequence[float], kind: str, discount: float) -> float:
    """What a leaf's total followed by the totals of its roll-out are worth.

    "final" is the last total, "best" the largest, "discounted" the discounted sum of all of them (the paper's eq. 2).
    """
    if kind == "final":
        return totals[-1]
    if kind == "best":
        return max(totals)
    return sum(total * discount**k for k, total in enumerate(totals))
