"""Tell a construction without detours: actions that later ones undo are left out.

A vertex that is subdivided in and dissolved later, a face split off and joined again, an extrusion that is deleted: the
steps of such a detour are left out together where what remains is still a construction, of the same last mesh and by
sane meshes only. What they moved on the way moves with the step before or after.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from autopoly_env.errors import AutoPolyError
from autopoly_env.mesh import FaceRule, PolyMesh, is_sane
from autopoly_env.operators import operator_named
from autopoly_env.score import Score
from autopoly_env.sequence import ConstructionSequence, Step
from autopoly_env.sequence.follower import Follower, Standing, Taken
from autopoly_env.sequence.variation import stay

_MOST_LOST = 0.1  # of the IoU of a mesh on the way

Faces = set[tuple[int, ...]]


class _DetourNeededError(AutoPolyError):
    """What is left of a construction cannot be told without the steps that were left out."""


def tidy(sequence: ConstructionSequence, scored: Callable[[PolyMesh], Score]) -> ConstructionSequence:
    """The sequence without its detours; itself if it has none, and never one that ends otherwise.

    The last mesh is the same but for its ids: the same vertices, bit for bit, in the same faces. `scored` scores the
    meshes on the way that are new; the last keeps its score.
    """
    meshes, j = sequence.meshes(), 0
    while j < len(sequence.steps):
        for detour in _detours(sequence, meshes, j):
            shorter = _without(sequence, meshes, detour, scored)
            if shorter is not None:
                sequence, meshes, j = shorter, shorter.meshes(), j - len(detour)
                break
        j += 1
    return sequence


def _detours(sequence: ConstructionSequence, meshes: Sequence[PolyMesh], j: int) -> Iterator[frozenset[int]]:
    """Sets of steps, from 0, that may undo each other: step j, if it removes, and those that made what it removes."""
    step = sequence.steps[j]
    if not operator_named(step.operator).removes:
        return
    match step.element:
        case {"edge": [a, b]}:
            makers = [i for i in range(j) if _has_edge(meshes[i + 1], a, b) and not _has_edge(meshes[i], a, b)][-1:]
        case _:
            kinds = ("vertices", "faces") if "face" in step.element else ("vertices",)
            gone = {(kind, name) for kind in kinds for name in step.removed[kind]}
            made = [{(kind, name) for kind in kinds for name in s.created[kind]} for s in sequence.steps[:j]]
            makers = [i for i in range(j) if not gone.isdisjoint(made[i])]
    if makers:
        yield frozenset((*makers, j))
    if len(makers) > 1:
        yield from (frozenset((i, j)) for i in reversed(makers))


def _has_edge(mesh: PolyMesh, a: int, b: int) -> bool:
    ids = mesh.vertex_ids
    if a not in ids or b not in ids:
        return False
    return mesh.topology.edge_at(mesh.vertex_index(a), mesh.vertex_index(b)) >= 0


def _without(
    sequence: ConstructionSequence,
    meshes: Sequence[PolyMesh],
    detour: frozenset[int],
    scored: Callable[[PolyMesh], Score],
) -> ConstructionSequence | None:
    """The sequence without the steps of a detour; None if they are needed."""
    steps = sequence.steps
    kept = [k for k in range(len(steps)) if k not in detour]
    first = min(min(detour), max(kept, default=0))  # so that some step is told again, unless none is left
    kept = [k for k in kept if k >= first]
    ends = [*(k + 1 for k in kept[:-1]), len(steps)]  # the last takes over what moved after it
    follower = Follower(meshes[first], meshes[first], end_rule=_end_beyond, face_rule=_smallest_face)
    try:
        taken = [
            _taken(follower, steps[k], meshes[k], meshes[end], sequence.faces)
            for k, end in zip(kept, ends, strict=False)
        ]
    except AutoPolyError:
        return None
    if not _is_same(follower, meshes[-1]):
        return None
    if not taken:  # nothing was done in the end
        return sequence.trim(0)
    scores = [*(scored(mesh).as_dict() for _, _, mesh in taken[:-1]), steps[-1].score]
    if any(new["iou"] < steps[k].score["iou"] - _MOST_LOST for k, new in zip(kept, scores, strict=True)):
        return None
    transitions = [(action, choice, mesh, score) for (action, choice, mesh), score in zip(taken, scores, strict=True)]
    later = ConstructionSequence.record(sequence.settings, meshes[first], sequence.start_score, transitions)
    later = later.with_parts(steps[k].part for k in kept)
    return replace(sequence, steps=(*steps[:first], *later.steps))


def _taken(follower: Follower, step: Step, before: PolyMesh, after: PolyMesh, faces: FaceRule) -> Taken:
    """Take a step again. Raises AutoPolyError where that cannot be done, or leaves a mesh that is not sane."""
    taken = follower.take(step, before, after, stay)
    if not is_sane(follower.mesh, faces):
        raise _DetourNeededError("a mesh on the way is not sane without it")
    return taken


def _end_beyond(standing: Standing, before: PolyMesh, end: int, other: int) -> int:
    """Past a vertex that was left out, the next on the same line: each on the way is a point on an edge."""
    first = end
    while end not in standing.names:
        v = before.vertex_index(end)
        ends = [before.vertex_ids[a + b - v] for a, b in before.edges.tolist() if v in (a, b)]
        beyond = [name for name in ends if name != other]
        if len(beyond) != 1 or len(ends) != 2:
            raise _DetourNeededError(f"vertex {end} is no point on an edge")
        end, other = beyond[0], end
        if end == first:
            raise _DetourNeededError(f"vertex {end} is on a ring that was left out")
    return standing.names[end]


def _smallest_face(standing: Standing, before: PolyMesh, face: int) -> int:
    """The smallest face with all the vertices that the old one has before the step, those left out aside."""
    names, mesh = standing.names, standing.mesh
    old = (before.vertex_ids[v] for v in before.faces[before.face_index(face)])
    wanted = {mesh.vertex_index(names[name]) for name in old if name in names}
    found = [(len(cycle), k) for k, cycle in enumerate(mesh.faces) if wanted.issubset(cycle)]
    if not found:
        raise _DetourNeededError(f"face {face} is not there without it")
    return mesh.face_ids[min(found)[1]]


def _is_same(follower: Follower, last: PolyMesh) -> bool:
    """Whether the mesh is `last`, whatever the ids."""
    old, mesh = {new: old for old, new in follower.names.items()}, follower.mesh
    if tuple(old.get(name) for name in mesh.vertex_ids) != last.vertex_ids:
        return False
    return mesh.vertices.tobytes() == last.vertices.tobytes() and _cycles(mesh.faces) == _cycles(last.faces)


def _cycles(faces: Sequence[Sequence[int]]) -> Faces:
    """The faces, each begun at its least vertex."""
    starts = [list(face).index(min(face)) for face in faces]
    return {(*face[k:], *face[:k]) for k, face in zip(starts, map(tuple, faces), strict=True)}
