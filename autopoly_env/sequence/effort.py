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
from autopoly_env.sequence.ids import decoded
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
    """Seconds for a step from `before` to `after`: selecting, the operator's gesture, moving.

    Vertices that go the same way (within `ALIKE`) are selected and moved together. What the operator itself puts in its
    place costs nothing, and what it drags goes one common way for nothing: the one after which least is left to move.
    """
    operator, element, choice = decoded(before, step)
    made = operator.apply(before, element, choice)
    gesture = operator.told.gesture(step)
    ways = after.vertices - made.vertices
    variants = [ways]
    new = [after.vertex_index(name) for name in step.created["vertices"]]
    if gesture.drags and new:
        ways[new] = after.vertices[new] - operator.sources_of(before, element, choice, made)
        variants = [_dragged(ways, new, way) for way in ways[new]]
    moving = min(time_of(_moves(left)) for left in variants)
    return time_of((_selected(gesture), gesture.strokes)) + moving


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


def _moves(ways: FloatArray) -> list[str]:
    """The strokes for vertices that have to go `ways` (V, 2), a text for every group that goes alike.

    A group is what goes as its first vertex does, in the order of the vertices.
    """
    left, moves = ways[np.hypot(*ways.T) > ALIKE], []
    while len(left):
        is_alike = np.hypot(*(left - left[0]).T) <= ALIKE
        moves.append(_CLICK + (int(is_alike.sum()) - 1) * _FURTHER + _MOVE)
        left = left[~is_alike]
    return moves
