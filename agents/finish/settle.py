"""Let vertices move less often: the same last mesh, its vertices sooner in their place, or later.

A refit after every action moves everything a little towards what fits best just then. Where the simulator's weights
price that (`w_locality`), each move of a vertex is put off until its next one, or brought forward to its last one or to
when the vertex came, as long as that saves more than the meshes in between lose by it. The last mesh stays as it is.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from autopoly_env.errors import IllegalActionError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import OPERATORS, Action, Choice
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.sequence.ids import decoded
from autopoly_env.sequence.lesson import LEAST_MOVE
from autopoly_env.simulator import Simulator

_MOST_ROUNDS = 4
_LEAST_GAIN = 1e-9
_ON_THE_WAY = 0.05  # what r_all of a mesh on the way counts, beside that of a shape that a search decides for


def settle(sequence: ConstructionSequence, simulator: Simulator) -> ConstructionSequence:
    """The sequence with moves left out where that pays under the simulator's `w_locality`; scored anew.

    Never of less worth, which is the sum over the meshes of r_all, counted a twentieth, less what the step is docked.
    A start mesh that was given stays as it is. Under symmetry, where vertices would have to move in pairs, nothing is
    changed.
    """
    if not simulator.weights.w_locality or not sequence.steps or simulator.guidance.axis is not None:
        return sequence
    film = _Film(simulator, sequence)
    for _ in range(_MOST_ROUNDS):
        if not sum([film.spare(name, time) for time in range(1, len(film.meshes)) for name in film.movers(time)]):
            break
    scores = [simulator.final_score(mesh).as_dict() for mesh in film.meshes]
    rows = zip(film.taken, film.meshes[1:], scores[1:], strict=True)
    transitions = [(action, choice, mesh, score) for (action, choice), mesh, score in rows]
    told = ConstructionSequence.record(sequence.settings, film.meshes[0], scores[0], transitions)
    return told.with_parts(sequence.parts)


@dataclass(frozen=True)
class _Frames:
    """Some meshes in a row, in place of those from `first` on, and what they are worth each."""

    first: int
    meshes: Sequence[PolyMesh]
    worth: Sequence[float]


class _Film:
    """The meshes of a construction, whose vertices may be moved at other times; the last mesh is never changed."""

    def __init__(self, simulator: Simulator, sequence: ConstructionSequence) -> None:
        self._simulator = simulator
        self._first = 0 if simulator.guidance.start is None else 1  # mesh that may be changed
        self.meshes = sequence.meshes()
        self.taken: list[tuple[Action, Choice | None]] = []
        for step, mesh in zip(sequence.steps, self.meshes, strict=False):
            _, element, choice = decoded(mesh, step)
            self.taken.append((Action(step.operator, element), choice))
        self._worth = [self._worth_of(mesh) for mesh in self.meshes]

    def movers(self, time: int) -> list[int]:
        """Ids of the vertices that the step to mesh `time` moves."""
        return [name for name in self.meshes[time - 1].vertex_ids if self._is_moved(name, time)]

    def spare(self, name: int, time: int) -> bool:
        """Leave out the move of a vertex to mesh `time`, one way or the other, if that pays; say whether it did."""
        if not self._is_moved(name, time):
            return False
        first = time - 1
        while first > 0 and name in self.meshes[first - 1].vertex_ids and not self._is_moved(name, first):
            first -= 1
        last = time
        while last + 1 < len(self.meshes) and not self._is_moved(name, last + 1):
            if name not in self.meshes[last + 1].vertex_ids:
                break
            last += 1
        sooner = self._with(name, first, time, self._place(name, time))
        later = self._with(name, time, last + 1, self._place(name, time - 1)) if last + 1 < len(self.meshes) else None
        found = [frames for frames in (sooner, later) if frames is not None and self._gain(frames) > _LEAST_GAIN]
        if not found:
            return False
        best = max(found, key=self._gain)
        end = best.first + len(best.meshes)
        self.meshes[best.first : end], self._worth[best.first : end] = best.meshes, best.worth
        return True

    def _place(self, name: int, time: int) -> tuple[float, float]:
        x, y = self.meshes[time].vertices[self.meshes[time].vertex_index(name)]
        return x, y

    def _is_moved(self, name: int, time: int) -> bool:
        before, after = self.meshes[time - 1], self.meshes[time]
        if name not in before.vertex_ids or name not in after.vertex_ids:
            return False
        (x, y), (u, v) = self._place(name, time - 1), self._place(name, time)
        return float(np.hypot(u - x, v - y)) > LEAST_MOVE

    def _with(self, name: int, first: int, end: int, place: tuple[float, float]) -> _Frames | None:
        """Meshes `first` to `end` - 1 with a vertex in that place; None where they would not be a construction."""
        if first < self._first or end >= len(self.meshes):
            return None
        changed = []
        for mesh in self.meshes[first:end]:
            vertices = mesh.vertices.copy()
            vertices[mesh.vertex_index(name)] = place
            changed.append(mesh.with_vertices(vertices))
        if not all(map(self._simulator.is_sane, changed)):
            return None
        try:
            for mesh, (action, choice) in zip(changed, self.taken[first:end], strict=True):
                OPERATORS[action.operator].apply(mesh, action.element, choice)
        except IllegalActionError:
            return None
        return _Frames(first, changed, [self._worth_of(mesh) for mesh in changed])

    def _worth_of(self, mesh: PolyMesh) -> float:
        return _ON_THE_WAY * self._simulator.final_score(mesh).total

    def _gain(self, frames: _Frames) -> float:
        """How much more the construction is worth with these frames."""
        first, end = frames.first, frames.first + len(frames.meshes)
        before, after = self.meshes[max(0, first - 1) : first], self.meshes[end : end + 1]
        docked = [
            sum(self._simulator.docked(*pair) for pair in pairwise([*before, *meshes, *after]))
            for meshes in (self.meshes[first:end], frames.meshes)
        ]
        return sum(frames.worth) - sum(self._worth[first:end]) + docked[0] - docked[1]
