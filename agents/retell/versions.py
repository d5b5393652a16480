"""`Version`: a construction on its way to another target; its neighbours, and how its meshes follow the last one."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from autopoly_env.errors import AutoPolyError
from autopoly_env.mesh import PolyMesh
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

    @property
    def total(self) -> float:
        return self.score.total

    @cached_property
    def sequence(self) -> ConstructionSequence:
        """The steps, not scored."""
        return ConstructionSequence.record({}, self.start, _NO_SCORE, [(*one, _NO_SCORE) for one in self.taken])

    def states(self, simulator: Simulator) -> list[State]:
        """The construction as an agent's."""
        states = [State(self.start, simulator.score(self.start), n_refits=0)]
        for action, choice, mesh in self.taken:
            states.append(State(mesh, simulator.score(mesh), len(states), "", action, choice, n_refits=0))
        return states


def version_of(
    simulator: Simulator, start: PolyMesh, taken: Sequence[Taken], origins: Sequence[int | None], mesh: PolyMesh
) -> Version:
    """A version as it is, not refitted."""
    return Version(start, tuple(taken), tuple(origins), mesh, simulator.score(mesh))


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
    """All versions that are one step away, the last mesh not refitted yet."""
    found = [*_shorter(simulator, version), *_longer(simulator, version)]
    return [one for one in found if len(one.taken) <= simulator.max_steps and simulator.is_sane(one.mesh)]


def _shorter(simulator: Simulator, version: Version) -> Iterator[Version]:
    """Each step left out in turn, with the later ones that are illegal then."""
    told = version.sequence
    meshes = told.meshes()
    seen = {version.origins}
    for left_out in range(len(told.steps)):
        follower, taken, origins = Follower(meshes[0], meshes[0]), [], []
        for i, step in enumerate(told.steps):
            if i != left_out:
                try:
                    taken.append(follower.take(step, meshes[i], meshes[i + 1], stay))
                except AutoPolyError:
                    continue
                origins.append(i)
        if tuple(origins) not in seen:
            seen.add(tuple(origins))
            kept = tuple(version.origins[i] for i in origins)
            yield version_of(simulator, version.start, tuple(taken), kept, follower.mesh)


def _longer(simulator: Simulator, version: Version) -> Iterator[Version]:
    """One action more in the end: where an edge or a face is to blame, or a vertex of the start is not worth it."""
    disagreement = Disagreement(version.mesh, simulator.silhouette)
    for action in _worth_trying(disagreement, version):
        if action.operator not in simulator.operators:
            continue
        try:
            choice, mesh, _ = simulator.trial_of(disagreement, action).starts[0]
        except AutoPolyError:
            continue
        yield version_of(
            simulator, version.start, (*version.taken, (action, choice, mesh)), (*version.origins, None), mesh
        )


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
