"""What a construction sequence is worth as a lesson: sound prefixes, the big shape first, one change at a time.

The score judges the last mesh only, and only its outline. Somebody who learns from the sequence, or edits it, meets
every mesh on the way, does every step by hand, and goes on with the faces that there are in the end.
"""

from dataclasses import dataclass, fields
from itertools import pairwise

import numpy as np

from autopoly_env.arrays import FloatArray
from autopoly_env.mesh import PolyMesh, is_sane
from autopoly_env.sequence.effort import effort
from autopoly_env.sequence.parts import parts_of
from autopoly_env.sequence.sequence import ConstructionSequence

LEAST_MOVE = 0.01  # of the image's side: a vertex that moves less is said to stay
LEAST_TURN = -1e-9  # cross product (unit square) of the edges at a corner; with less the corner is reflex


@dataclass(frozen=True)
class Lesson:
    """How a sequence of n steps, and so n + 1 meshes, reads."""

    valid: float  # 0 to 1, share of the meshes without crossings and flipped, empty or forbidden faces: 1 is expected
    blocking_in: float  # 0 to 1, area under the curve of r_sm over the steps: high where the big shape comes first
    moved: float  # 0 to 1, mean share of the vertices already there that a step moves: LOW is good, 0 is local
    n_actions: int  # n
    quads: float  # 0 to 1, share of the last mesh's faces that have four corners
    ngons: int  # its faces of five corners and more
    concave: int  # its faces with a reflex corner: LOW is good
    effort: float  # seconds to follow the steps by hand, see `autopoly_env.sequence.effort`: LOW is good
    returns: int  # steps that go back to a part that was left, see `autopoly_env.sequence.parts`: 0 is good

    @classmethod
    def of(cls, sequence: ConstructionSequence) -> "Lesson":
        """Judge a sequence by its meshes, its steps, and the scores that it keeps.

        `blocking_in` joins r_sm (the IoU kept with the start and with each step) by straight lines, one step wide, and
        divides the area below them by n: the mean of the n + 1 values, the first and the last counted half. A sequence
        without steps has its start's IoU.

        `moved` is the mean over the steps of `share_moved`: 0.25 says that a step moves, on average, a quarter of the
        vertices that were there before it. It is high for sequences that are refitted after every action, as the
        paper's are: there a step may move everything. Without steps it is 0.

        Raises SequenceError if the sequence cannot be replayed.
        """
        meshes = sequence.meshes()
        ious = [float(score["iou"]) for score in (sequence.start_score, *(step.score for step in sequence.steps))]
        shares = [share_moved(before, after) for before, after in pairwise(meshes)]
        sizes = [len(face) for face in meshes[-1].faces]
        return cls(
            valid=sum(is_sane(mesh, sequence.faces) for mesh in meshes) / len(meshes),
            blocking_in=_area_below(ious),
            moved=float(np.mean(shares)) if shares else 0.0,
            n_actions=len(shares),
            quads=sizes.count(4) / len(sizes),
            ngons=sum(size > 4 for size in sizes),
            concave=n_concave(meshes[-1]),
            effort=effort(sequence),
            returns=parts_of(sequence).n_returns,
        )


LESSON_FIELDS = tuple(field.name for field in fields(Lesson))


def n_concave(mesh: PolyMesh) -> int:
    """Faces with a corner that turns the other way than the face does, by more than `LEAST_TURN` says."""
    turns = [_turns(mesh.vertices[list(face)]) for face in mesh.faces]
    return sum(
        bool((ways * np.sign(area) < LEAST_TURN).any()) for ways, area in zip(turns, mesh.face_areas(), strict=True)
    )


def share_moved(before: PolyMesh, after: PolyMesh) -> float:
    """Share, 0 to 1, of the vertices in both meshes that are more than `LEAST_MOVE` apart; 0 if there are none."""
    distances = moves(before, after)
    return float((distances > LEAST_MOVE).mean()) if len(distances) else 0.0


def moves(before: PolyMesh, after: PolyMesh) -> FloatArray:
    """Distances (unit square) between the places of each vertex that is in both meshes, by their ids."""
    rows = {name: row for row, name in enumerate(after.vertex_ids)}
    pairs = [(row, rows[name]) for row, name in enumerate(before.vertex_ids) if name in rows]
    old, new = np.array(pairs, np.int64).reshape(-1, 2).T
    return np.asarray(np.hypot(*(after.vertices[new] - before.vertices[old]).T))


def _turns(ring: FloatArray) -> FloatArray:
    """(n,) cross product of the edges before and after each corner of a ring (n, 2)."""
    before, after = ring - np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0) - ring
    turns: FloatArray = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    return turns


def _area_below(values: list[float]) -> float:
    return float(np.trapezoid(values)) / (len(values) - 1) if len(values) > 1 else values[0]
