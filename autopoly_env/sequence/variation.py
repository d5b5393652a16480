"""Edits of a construction, each carried on to its end: a step changed, put in or left out, the rest taken again.

How an edit is carried on: the vertices of the edited mesh, where they were and where they are now, define one smooth
deformation of the plane (`ThinPlate`), and every later position goes where that takes it. So a foot that is pulled down
takes the leg along, which later steps have made, and what lies far from it hardly moves. The later steps are the same
actions on the same elements; the points of holes are deformed, too.

No target is at hand: the meshes are scored against the picture of the last one, whose IoU is 1.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

from autopoly_env.arrays import FloatArray
from autopoly_env.errors import AutoPolyError, SequenceError
from autopoly_env.mesh import PolyMesh
from autopoly_env.mesh import mirrored as mirrored_points
from autopoly_env.operators import Action, Choice
from autopoly_env.operators.wording import element_words
from autopoly_env.raster import coverage
from autopoly_env.score import ScoreWeights, score
from autopoly_env.sequence.deformation import ThinPlate
from autopoly_env.sequence.file import PlainScore, Step
from autopoly_env.sequence.follower import Follower, PointMap, Taken, mirror_image, moved_to
from autopoly_env.silhouette import Silhouette

_MOST_WEIGHT = 1e9  # that settings may tell; they are of any content
RESOLUTION = 256  # of the picture of the last mesh

Positions = Mapping[int, tuple[float, float]]  # by vertex id, in the unit square


class Replayed(NamedTuple):
    """A construction with all of its meshes: number 0 is the start, number i what step i made."""

    settings: Mapping[str, Any]
    meshes: Sequence[PolyMesh]
    steps: tuple[Step, ...]


class Recording(NamedTuple):
    """What `ConstructionSequence.record` makes a sequence of."""

    settings: dict[str, Any]
    start: PolyMesh
    start_score: PlainScore
    transitions: list[tuple[Action, Choice | None, PolyMesh, PlainScore]]


def with_changes(old: Replayed, k: int, moved: Positions, choice: Mapping[str, Any] | None) -> Recording:
    """The construction with vertices moved after step k (0: of the start mesh), or with another choice in it.

    Raises SequenceError where a step, this or a later one, is illegal then.
    """
    meshes, steps = old.meshes, old.steps
    edited = meshes[0] if k == 0 else _chosen_anew(meshes[k - 1], meshes[k], steps[k - 1], k, choice)
    if k == 0 and choice is not None:
        raise SequenceError("the start has no choice to change; give a step, from 1")
    try:
        edited = moved_to(edited, dict(moved))
    except AutoPolyError as error:
        raise SequenceError(f"step {k}: {error}") from None
    if k > 0 and choice is not None:
        steps = (*steps[: k - 1], replace(steps[k - 1], choice=dict(choice)), *steps[k:])
    bend = ThinPlate.through(meshes[k].vertices, edited.vertices)
    changed = Replayed(old.settings, [*meshes[:k], edited, *meshes[k + 1 :]], steps)
    return moved_by(changed, lambda i: bend if i > k else stay)


def with_insertion(old: Replayed, k: int, step: Step) -> Recording:
    """The construction with one more step after step k (0: first); it names what the mesh there has.

    Its `created`, `removed` and `score` are found anew. Raises SequenceError where a step is illegal then.
    """
    meshes = old.meshes
    follower = Follower(meshes[0], meshes[0])
    taken = []
    for number in range(1, len(meshes) + 1):
        if number == k + 1:
            taken.append(_told(number, step, follower.do, step))
        if number < len(meshes):
            later = old.steps[number - 1]
            taken.append(_told(number, later, follower.take, later, meshes[number - 1], meshes[number], stay))
    return _rescored(old.settings, meshes[0], taken)


def without(old: Replayed, k: int) -> Recording:
    """The construction without step k, from 1. Raises SequenceError where a later step is illegal then."""
    meshes = old.meshes
    follower = Follower(meshes[0], meshes[0])
    taken = [
        _told(number, step, follower.take, step, meshes[number - 1], meshes[number], stay)
        for number, step in enumerate(old.steps, 1)
        if number != k
    ]
    return _rescored(old.settings, meshes[0], taken)


def moved_by(old: Replayed, place: Callable[[int], PointMap]) -> Recording:
    """The same steps, mesh number i moved by `place(i)`. Raises SequenceError naming the step that is illegal then."""
    meshes = old.meshes
    start = meshes[0].with_vertices(place(0)(meshes[0].vertices))
    follower = Follower(meshes[0], start)
    taken = [
        _told(i, step, follower.take, step, meshes[i - 1], meshes[i], place(i)) for i, step in enumerate(old.steps, 1)
    ]
    return _rescored(old.settings, start, taken)


def mirrored(old: Replayed) -> Recording:
    """The mirror image at x = 1/2: the same actions on mirrored elements. Raises SequenceError as the others."""
    meshes = old.meshes
    follower = Follower(meshes[0], mirror_image(meshes[0]), is_mirrored=True)
    start = follower.mesh
    image = partial(mirrored_points, axis=0.5)
    taken = [
        _told(i, step, follower.take, step, meshes[i - 1], meshes[i], image) for i, step in enumerate(old.steps, 1)
    ]
    return _rescored(old.settings, start, taken)


def mirrored_label(label: str) -> str:
    """The label of a part, the words left and right exchanged."""
    return re.sub(r"\b(left|right)\b", lambda word: {"left": "right", "right": "left"}[word[0]], label)


def _rescored(settings: Mapping[str, Any], start: PolyMesh, taken: Sequence[Taken]) -> Recording:
    """What was taken, scored against the picture of its last mesh."""

    meshes = [start, *(mesh for _, _, mesh in taken)]
    target = picture_of(meshes[-1], str(settings.get("target", "shape"))).target(RESOLUTION)
    weights = weights_of(settings)
    scores = [score(mesh, target, weights).as_dict() for mesh in meshes]
    told = {**settings, "scored_at": RESOLUTION, "scored_against": "its last mesh"}
    transitions = [(*one, number) for one, number in zip(taken, scores[1:], strict=True)]
    return Recording(told, start, scores[0], transitions)


def picture_of(mesh: PolyMesh, name: str) -> Silhouette:
    """The silhouette that a mesh shows. Raises SequenceError if it shows none."""
    mask = coverage(mesh, RESOLUTION) >= 0.5
    if not mask.any():
        raise SequenceError("the last mesh covers no pixel of the unit square; give a smaller change")
    return Silhouette(mask, name)


def weights_of(settings: Mapping[str, Any]) -> ScoreWeights:
    """The weights under which a sequence was scored; the default for those that its settings do not tell."""
    default = ScoreWeights()
    told = {name: settings.get(name, value) for name, value in vars(default).items()}
    if all(type(value) in (int, float) and 0.0 <= value <= _MOST_WEIGHT for value in told.values()):
        return ScoreWeights(**told)
    return default


def _chosen_anew(before: PolyMesh, after: PolyMesh, step: Step, k: int, choice: Mapping[str, Any] | None) -> PolyMesh:
    """The mesh after step k with another choice: what the step makes is where the operator puts it."""
    if choice is None:
        return after
    changed = replace(step, choice=dict(choice), moved=tuple(m for m in step.moved if m[0] not in _made(step)))
    follower = Follower(before, before)
    _, _, mesh = _told(k, step, follower.do, changed)
    return mesh


def _made(step: Step) -> set[int]:
    return set(step.created["vertices"])


def _told(number: int, step: Step, take: Callable[..., Taken], *arguments: object) -> Taken:
    """What `take` gives, its errors with the step's number and name."""
    try:
        return take(*arguments)
    except AutoPolyError as error:
        raise SequenceError(f"step {number}, {step.operator} {element_words(step)}: {error}") from None


def stay(points: FloatArray) -> FloatArray:
    """Where points go that do not move."""
    return points
