"""From the states that an agent has found to a solution: polished, pared, told without detours and scored.

The order is: `pare` takes away what the shape does not need; `Simulator.polish` refits and tunes the last mesh at the
silhouette's own resolution; `aligned` makes it regular where that is asked for; the best prefix is recorded as a
sequence; `tidy` leaves out its detours; `settle` lets vertices move less often.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise

from agents.budget import Meter
from agents.finish.align import aligned
from agents.finish.pare import pare
from agents.finish.settle import settle
from agents.finish.tidy import tidy
from agents.solution import Solution
from autopoly_env.guidance import continued
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import Action, Choice
from autopoly_env.score import Score
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.sequence.file import PlainScore
from autopoly_env.simulator import Simulator, State


def finish(
    simulator: Simulator, states: Sequence[State], meter: Meter, *, keep_steps: bool = False, keep_shape: bool = False
) -> Solution:
    """The solution that `states` construct, the last mesh polished, scored at the silhouette's own resolution.

    What the shape does not need is taken away (`pare`), if the budget is not spent; the steps are told without detours
    (`tidy`) and, where the weights ask for it, with fewer moves (`settle`); none of that if `keep_steps`. With
    `keep_shape` the last mesh is not polished but stays as it is. A start mesh
    that nothing was done to stays as it is; a sequence that was gone on from comes before the new steps. A
    KeyboardInterrupt on the way is noted, and the work done nevertheless.
    """
    try:
        return _finish(simulator, states, meter, keep_steps, keep_shape)
    except KeyboardInterrupt:
        meter.stopped_by = "interrupted"
        return _finish(simulator, states, meter, keep_steps, keep_shape)


def _finish(
    simulator: Simulator, states: Sequence[State], meter: Meter, keep_steps: bool, keep_shape: bool
) -> Solution:
    versions = [states]
    if not (keep_steps or meter.stopped_by == "interrupted" or meter.spent()):
        pared, n_refits, n_taken = pare(simulator, states)
        meter.add_refits(n_refits)
        meter.spent()  # which marks a solve that has gone over its budget only now
        versions += [pared] if n_taken else []
    solutions = [_told(simulator, version, meter, keep_steps, keep_shape) for version in versions]
    return max(solutions, key=lambda solution: simulator.worth(solution.mesh))


def _told(simulator: Simulator, states: Sequence[State], meter: Meter, keep_steps: bool, keep_shape: bool) -> Solution:
    meshes = [state.mesh for state in states]
    if not keep_shape and (len(meshes) > 1 or simulator.guidance.start is None):
        meshes[-1] = _polished(simulator, meshes)
        if simulator.guidance.align:
            meshes[-1] = aligned(simulator, meshes[-1])
    scores = [simulator.final_score(mesh) for mesh in meshes]
    docked = [simulator.off(mesh) for mesh in meshes]
    docked[1:] = (off + simulator.docked(*pair) for off, pair in zip(docked[1:], pairwise(meshes), strict=True))
    ends = [k for k, mesh in enumerate(meshes) if simulator.guidance.is_symmetric(mesh)] or list(range(len(meshes)))
    last = max(ends, key=lambda k: (scores[k].total - docked[k], -k))
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
    worth = [simulator.worth(m) - simulator.docked(before[-1], m) for m in (polished, mesh)]
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
