"""What networks say of states: asked for in batches, remembered for one target, forgotten in the end."""

from collections.abc import Sequence

from agents.search.batched import BATCH, BatchedEvaluator
from autopoly_env.mesh import PolyMesh
from autopoly_env.simulator import Simulator, State
from tests.helpers.drawings import FRAME, HOUSE, painted


class Counting(BatchedEvaluator[int]):
    """Says of a state how many vertices it has, and notes what it was asked in one go; knows no big meshes."""

    def __init__(self, n_remembered: int = 100, most: int = 99) -> None:
        super().__init__(n_remembered)
        self.batches: list[list[PolyMesh]] = []
        self._most = most

    def _fits(self, state: State) -> bool:
        return len(state.mesh.vertices) <= self._most

    def _evaluate(self, simulator: Simulator, states: Sequence[State]) -> list[int]:
        self.batches.append([state.mesh for state in states])
        return [len(state.mesh.vertices) for state in states]


def game(shape: object = HOUSE) -> Simulator:
    return Simulator(painted(shape), resolution=32)


def test_states_that_were_made__are_evaluated_with_the_next_that_is_asked_for() -> None:
    evaluator, simulator = Counting(), game(FRAME)
    state = simulator.initial()
    made = evaluator.expand(simulator, state, simulator.legal_actions(state)[1:4])
    plain = simulator.transition_all(state, simulator.legal_actions(state)[1:4])
    assert [one.mesh for one in made] == [one.mesh for one in plain]
    assert evaluator._said_of(simulator, state) == 4
    assert not any(one.done for one in made)
    assert evaluator.batches == [[*(one.mesh for one in made), state.mesh]]
    assert evaluator._said_of(simulator, made[0]) == len(made[0].mesh.vertices) and len(evaluator.batches) == 1


def test_a_batch__has_a_limit_and_leaves_out_what_does_not_fit() -> None:
    evaluator, simulator = Counting(most=5), game(FRAME)
    state = simulator.initial()
    for _ in range(3):
        made = evaluator.expand(simulator, state, simulator.legal_actions(state)[1:])
    assert any(len(one.mesh.vertices) > 5 for one in made)
    evaluator._said_of(simulator, state)
    assert len(evaluator.batches[0]) <= BATCH and all(len(mesh.vertices) <= 5 for mesh in evaluator.batches[0])


def test_another_target__is_another_story() -> None:
    evaluator, simulator, other = Counting(), game(), game(FRAME)
    state = simulator.initial()
    evaluator._said_of(simulator, state)
    evaluator.expand(simulator, state, simulator.legal_actions(state)[1:])
    evaluator._said_of(other, state)
    assert evaluator.batches == [[state.mesh], [state.mesh]]


def test_memory__keeps_those_that_were_asked_for_last() -> None:
    evaluator, simulator = Counting(n_remembered=2), game()
    first, second, third = (simulator.initial(PolyMesh.rectangle(0.1, 0.1, 0.5, 0.1 * k)) for k in (3, 4, 5))
    for state in (first, second, first, third, first, second):
        evaluator._said_of(simulator, state)
    assert evaluator.batches == [[first.mesh], [second.mesh], [third.mesh], [second.mesh]]
