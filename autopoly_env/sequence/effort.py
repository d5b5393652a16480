"""How long it takes to follow a construction by hand in Blender, by the keystroke-level model.

Card, Moran and Newell, "The keystroke-level model for user performance time with interactive systems", 1980: what a
practised hand does is a row of keys, pointings and clicks, and each kind takes its time. No machine is asked.
"""

from collections.abc import Iterable

import numpy as np

from autopoly_env.arrays import FloatArray
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators.wording import Gesture
from autopoly_env.sequence.file import Step
from autopoly_env.sequence.ids import decoded, operator_named
from autopoly_env.sequence.sequence import ConstructionSequence

SECONDS = {"K": 0.28, "P": 1.1, "B": 0.1, "M": 1.35}  # a key, pointing, a button down or up, getting ready
ALIKE = 0.005  # of the image's side: displacements that differ by less are one, and less than that is none
_CLICK = "PBB"
_FURTHER = "PBBK"  # one more is selected: a click with shift
_MOVE = "KPBB"  # G, and a click where the selected vertices are wanted


def effort(sequence: ConstructionSequence) -> float:
    """Seconds, at least 0, for all steps; the start mesh is there. Raises SequenceError if it cannot be replayed."""
    meshes = sequence.meshes()
    return sum(map(seconds_of, sequence.steps, meshes, meshes[1:]))


def seconds_of(step: Step, before: PolyMesh, after: PolyMesh) -> float:
    """Seconds for a step from `before` to `after`: selecting, the operator's gesture, moving."""
    gesture = operator_named(step.operator).told.gesture(step)
    return time_of((_selected(gesture), gesture.strokes, *map(_move, groups_to_move(step, before, after))))


def groups_to_move(step: Step, before: PolyMesh, after: PolyMesh) -> list[list[int]]:
    """The vertices of `after`, by index, that are left to be moved by hand after the operator, those together that go
    the same way (within `ALIKE`).

    What the operator itself puts in its place is not among them, and what it drags goes one common way of its own: the
    one after which the rest takes least.
    """
    operator, element, choice = decoded(before, step)
    made = operator.apply(before, element, choice)
    ways = after.vertices - made.vertices
    new = [after.vertex_index(name) for name in step.created["vertices"]]
    if not (operator.told.gesture(step).drags and new):
        return _groups(ways)
    ways[new] = after.vertices[new] - operator.sources_of(before, element, choice, made)
    return min((_groups(_dragged(ways, new, way)) for way in ways[new]), key=lambda groups: time_of(map(_move, groups)))


def time_of(strokes: Iterable[str]) -> float:
    """Seconds for letters of the keystroke-level model."""
    return sum(SECONDS[letter] for letters in strokes for letter in letters)


def _selected(gesture: Gesture) -> str:
    """Getting ready, and selecting what the operator works on."""
    return "M" + (_CLICK + (gesture.n_selected - 1) * _FURTHER if gesture.n_selected else "")


def _dragged(ways: FloatArray, new: list[int], way: FloatArray) -> FloatArray:
    """(V, 2) what is left to go once the vertices `new` have been dragged along `way` (2,)."""
    left = ways.copy()
    left[new] -= way
    return left


def _groups(ways: FloatArray) -> list[list[int]]:
    """The vertices that have to go `ways` (V, 2); a group is what goes as its first vertex does, in their order."""
    left, groups = np.flatnonzero(np.hypot(*ways.T) > ALIKE), []
    while len(left):
        is_alike = np.hypot(*(ways[left] - ways[left[0]]).T) <= ALIKE
        groups.append(left[is_alike].tolist())
        left = left[~is_alike]
    return groups


def _move(group: list[int]) -> str:
    """The strokes that select a group of vertices and move it."""
    return _CLICK + (len(group) - 1) * _FURTHER + _MOVE
