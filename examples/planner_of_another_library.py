"""Our Simulator in the hands of another library's planner: of the package `mcts`, which asks five methods of a state.

pip install -e . mcts==1.0.4
python -m examples.planner_of_another_library examples/mug.png
"""

import random
import sys

from mcts import mcts

from autopoly_env.operators import STOP, Action
from autopoly_env.silhouette import load_silhouette
from autopoly_env.simulator import Simulator, State


class Position:
    """A State, in the words of `mcts`: a game of one player."""

    def __init__(self, simulator: Simulator, state: State) -> None:
        self.simulator, self.state = simulator, state

    def getCurrentPlayer(self) -> int:  # noqa: N802
        return 1

    def getPossibleActions(self) -> list[Action]:  # noqa: N802
        return self.simulator.legal_actions(self.state)

    def takeAction(self, action: Action) -> "Position":  # noqa: N802
        (after,) = self.simulator.step_many([self.state], [action])
        return Position(self.simulator, after or self.simulator.idle(self.state))  # where there is no room, nothing

    def isTerminal(self) -> bool:  # noqa: N802
        return bool(self.state.done)

    def getReward(self) -> float:  # noqa: N802
        return self.state.score.total / 100.0


def short_rollout(position: Position) -> float:
    """What a shape is worth after two more actions, any; the package's own plays to the end."""
    for _ in range(2):
        if not position.isTerminal():
            position = position.takeAction(random.choice(position.getPossibleActions()))
    return position.getReward()


if __name__ == "__main__":
    random.seed(0)
    position = Position(simulator := Simulator(load_silhouette(sys.argv[1]), max_steps=10), simulator.initial())
    while not position.isTerminal():
        action = mcts(iterationLimit=80, rolloutPolicy=short_rollout).search(position)
        position = position.takeAction(action)
        print(f"r_all {position.state.score.total:.1f} after {action.operator if action != STOP else 'stop'}")
