"""`Version`: a construction on its way to another target; its neighbours, and how its meshes follow the last one."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from autopoly_env.errors import AutoPolyError
from autopoly_env.mesh import PolyMesh, images_of
from autopoly_env.operators import HOLE_SIDES, OPERATORS, Action
from autopoly_env.placement import Disagreement
from autopoly_env.score import Score
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.sequence.deformation import ThinPlate
from autopoly_env.sequence.follower import Follower, Taken, moved_to
from autopoly_env.sequence.variation import stay
from autopoly_env.simulator import Simulator, State

_N_BLAMED = 6  # boundary edges that are subdivided and extruded on trial, those with most blame
_NO_SCORE: dict[str, float] = {"iou": 0.0, "complexity": 0, "self_intersections": 0, "total": 0.0}


@dataclass(frozen=True, eq=False)
class Version:
    """A construction for the new target; step i of it is step `origins[i]` of the given one, None where it is new."""

    start: PolyMesh
    taken: tuple[Taken, ...]
    origins: tuple[int | None, ...]
    mesh: PolyMesh  # the last one, refitted; the steps may still lead to one that is not
    score: Score  # of `mesh`, at the simulator's resolution
    told: ConstructionSequence  # the given one, or its mirror image

    @property
    def total(self) -> float:
        return self.score.total

    def shape(self) -> PolyMesh:
        """`mesh`, as budgets show what was found."""
        return self.mesh

    @cached_property
    def sequence(self) -> ConstructionSequence:
        """The steps, not scored."""
        return ConstructionSequence.record({}, self.start, _NO_SCORE, [(*one, _NO_SCORE) for one in self.taken])

    def names(self) -> dict[int, int]:
        """Of every vertex of `told` that is there, its id here."""
        names = {name: name for name in self.start.vertex_ids}
        for origin, step in zip(self.origins, self.sequence.steps, strict=True):
            if origin is not None:
                names.update(
                    zip(self.told.steps[origin - 1].created["vertices"], step.created["vertices"], strict=True)
                )
        return names

    def states(self, simulator: Simulator) -> list[State]:
        """The construction as an agent's."""
        states = [State(self.start, simulator.score(self.start), n_refits=0)]
        for action, choice, mesh in self.taken:
            states.append(State(mesh, simulator.score(mesh), len(states), "", action, choice, n_refits=0))
        return states


def version_of(
    simulator: Simulator,
    told: ConstructionSequence,
    start: PolyMesh,
    taken: Sequence[Taken],
    origins: Sequence[int | None],
    mesh: PolyMesh,
) -> Version:
    """A version as it is, not refitted."""
    return Version(start, tuple(taken), tuple(origins), mesh, simulator.score(mesh), told)


def total_of(version: Version) -> float:
    """r_all of a version, to sort by."""
    return version.total


def first_settled(simulator: Simulator, versions: Sequence[Version]) -> Version | None:
    """The best that can be told with all of its meshes sane."""
    for version in sorted(versions, key=total_of, reverse=True):
        settled = _settled(simulator, version) if simulator.is_sane(version.mesh) else None
        if settled is not None:
            return settled
    return None


def _settled(simulator: Simulator, version: Version) -> Version | None:
    """The version with every earlier mesh brought to the last one; None if one cannot be without a defect."""
    told, last = version.sequence, version.mesh
    meshes = told.meshes()
    bend = ThinPlate.through(meshes[-1].vertices, last.vertices)
    start = _brought(simulator, meshes[0], last)
    follower, taken = Follower(meshes[0], start), []
    for i, step in enumerate(told.steps, 1):
        try:
            action, choice, made = follower.take(step, meshes[i - 1], meshes[i], bend, is_moving=False)
        except AutoPolyError:  # no room for a diagonal or a hole
            return None
        mesh = last if i == len(told.steps) else _brought(simulator, made, last)
        if mesh.vertex_ids != made.vertex_ids or not simulator.is_sane(mesh):
            return None
        follower.settle(mesh)
        taken.append((action, choice, mesh))
    return replace(version, start=start, taken=tuple(taken))


def _brought(simulator: Simulator, mesh: PolyMesh, last: PolyMesh) -> PolyMesh:
    """The mesh with the vertices that stay to the end where they are then, as far as that leaves no defect.

    Where all of them cannot be there at once, they go one after the other, those that cannot staying behind.
    """
    ends = dict(zip(last.vertex_ids, last.vertices.tolist(), strict=True))
    goals = {name: ends[name] for name in mesh.vertex_ids if name in ends}
    moved = moved_to(mesh, goals)
    if simulator.is_sane(moved):
        return moved
    for name, goal in goals.items():
        moved = moved_to(mesh, {name: goal})
        mesh = moved if simulator.is_sane(moved) else mesh
    return mesh


def neighbours(simulator: Simulator, version: Version) -> list[Version]:
    """All versions that are one step away, or one and its mirror image; the last mesh not refitted yet."""
    found = [*_shorter(simulator, version), *_longer(simulator, version)]
    return [one for one in found if len(one.taken) <= simulator.max_steps and _may_be(simulator, one.mesh)]


def _may_be(simulator: Simulator, mesh: PolyMesh) -> bool:
    return simulator.is_sane(mesh) and simulator.guidance.is_symmetric(mesh)


def _shorter(simulator: Simulator, version: Version) -> Iterator[Version]:
    """Each step, or a step and its mirror image, left out in turn, with the later ones that are illegal then."""
    told = version.sequence
    meshes = told.meshes()
    seen = {version.origins}
    for left_out in _left_out(version, simulator.guidance.axis):
        follower, taken, origins = Follower(meshes[0], meshes[0]), [], []
        for i, step in enumerate(told.steps):
            if i not in left_out:
                try:
                    taken.append(follower.take(step, meshes[i], meshes[i + 1], stay))
                except AutoPolyError:
                    continue
                origins.append(i)
        if tuple(origins) not in seen:
            seen.add(tuple(origins))
            kept = tuple(version.origins[i] for i in origins)
            yield version_of(simulator, version.told, version.start, tuple(taken), kept, follower.mesh)


def _left_out(version: Version, axis: float | None) -> Iterator[set[int]]:
    """Numbers of steps, from 0, that are left out together: one, and that which made the mirror images, if any did."""
    images = None if axis is None else images_of(version.mesh, axis)
    ids = version.mesh.vertex_ids
    image = {} if images is None else {ids[v]: ids[w] for v, w in enumerate(images.tolist()) if w >= 0}
    made = [frozenset(step.created["vertices"]).intersection(image) for step in version.sequence.steps]
    makers = {names: i for i, names in enumerate(made) if names}
    for i, names in enumerate(made):
        yield {i, makers.get(frozenset(image[name] for name in names), i)}


def _longer(simulator: Simulator, version: Version) -> Iterator[Version]:
    """One action more in the end: where an edge or a face is to blame, or a vertex of the start is not worth it."""
    disagreement = Disagreement(version.mesh, simulator.silhouette)
    for action in _worth_trying(disagreement, version):
        if action.operator not in simulator.operators:
            continue
        try:
            choice, mesh, halfway = simulator.trial_of(disagreement, action).starts[0]
        except AutoPolyError:
            continue
        new: list[Taken] = [(action, choice, mesh)]
        if halfway is not None:
            new = [(action, choice, halfway.mesh), (halfway.action, halfway.choice, mesh)]
        taken, origins = (*version.taken, *new), (*version.origins, *(None for _ in new))
        yield version_of(simulator, version.told, version.start, taken, origins, mesh)


def _worth_trying(disagreement: Disagreement, version: Version) -> Iterator[Action]:
    mesh = disagreement.mesh
    blame = disagreement.blame[:, :, 0].max(axis=1)
    for row in np.argsort(-blame, kind="stable")[:_N_BLAMED]:
        if blame[row] > 0.0:
            edge = mesh.edge_index(*mesh.topology.boundary_half_edges[row].tolist())
            yield Action("edge_subdivide", edge)
            yield Action("edge_extrude", edge)
    for face in range(len(mesh.faces)):
        if disagreement.excess_in(face) is not None:
            yield from (Action("face_hole", len(HOLE_SIDES) * face + k) for k in range(len(HOLE_SIDES)))
    subdivided = {
        name
        for step in version.sequence.steps
        if step.operator == "edge_subdivide"
        for name in step.created["vertices"]
    }
    for v in np.flatnonzero(OPERATORS["vertex_dissolve"].legal_mask(mesh)).tolist():
        if mesh.vertex_ids[v] not in subdivided:  # those go with their step
            yield Action("vertex_dissolve", v)
