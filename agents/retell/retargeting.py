"""Retargeting: the steps of one construction, told again for another silhouette, and mended where they do not fit.

First the last mesh is laid over the new target - by bounding box, by moments, or each boundary loop on the contour
nearest to it - as it is or mirrored, and refitted from afar; every earlier mesh follows with its vertices. Then the
construction itself is climbed: of all that are one step shorter (later steps that have lost their element go, too) or
one step longer, refitted, the best is taken while it is better.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from agents.budget import Budget, Meter, Progress
from agents.finish import finish
from agents.finish.align import Regularity
from agents.finish.align import aligned as regular
from agents.retell.frame import EXACT, Frame
from agents.retell.versions import Version, first_settled, neighbours, total_of, version_of
from agents.solution import Solution
from agents.trace.rings import signed_area, trace_rings
from autopoly_env.arrays import FloatArray
from autopoly_env.compute import map_threads
from autopoly_env.errors import AutoPolyError, SequenceError
from autopoly_env.mesh import PolyMesh, images_of, mirrored
from autopoly_env.mesh.symmetry import axis_of
from autopoly_env.raster import coverage
from autopoly_env.refit import FROM_AFAR, LOCAL, THOROUGH, RefitConfig, mended, refit
from autopoly_env.score import Score
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.sequence.follower import Follower, Taken
from autopoly_env.sequence.variation import stay, weights_of
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator

_N_TRIED = 10  # neighbours that are refitted, those that are best as they are
_FROM_AFAR = replace(FROM_AFAR, n_near=40, tolerance=4e-4)  # an outline that lies far off, in no hurry
_N_THOROUGH = 3  # constructions that are refitted again, harder, before the climb ends
_LEAST_GAIN = 1e-9
START_SHARE = 0.5  # of the IoU that the start has on its own target: with less it is on another part of the shape
_WORTH = 10.0  # points of r_all that a start on the same part may cost
_N_BEGINNINGS = 3  # ways to lay the construction over the target that are climbed from, while the budget lasts


@dataclass(frozen=True)
class Retargeted:
    """A construction for the new target, and what has become of the given one's steps."""

    solution: Solution
    n_kept: int
    n_dropped: int
    n_added: int
    before: Score  # of the given last mesh, as it is, on the new target
    refitted: Score  # of the same steps, none lost or added, laid over the new target and refitted: what it began with
    aligned: PolyMesh  # which that is the score of
    start_iou: float  # of the start mesh on the new target
    least_start_iou: float  # below which it begins elsewhere than the given one did
    n_level: int  # edges that are level or plumb as they were in the given one
    n_tilted: int  # edges that were and are not

    @property
    def notes(self) -> dict[str, Any]:
        """What a construction sequence keeps beside the simulator's settings."""
        return {"agent": "retarget", "kept": self.n_kept, "dropped": self.n_dropped, "added": self.n_added}

    @property
    def told(self) -> ConstructionSequence:
        """The sequence, with the notes among its settings."""
        sequence = self.solution.sequence
        return replace(sequence, settings={**sequence.settings, **self.notes})

    @property
    def begins_elsewhere(self) -> bool:
        """Whether the start, which was a body once, is a detail of the new shape."""
        return self.start_iou < self.least_start_iou


def simulator_of(sequence: ConstructionSequence, silhouette: Silhouette, *, keeps_symmetry: bool = True) -> Simulator:
    """The rules that the sequence was made under, as far as it tells them. Raises ConfigError for unknown ones.

    Where its last mesh is symmetric, `keeps_symmetry` asks for the same where the new target has an axis.
    """
    operators, resolution = sequence.settings.get("operators", "full"), sequence.settings.get("resolution", 128)
    is_alike = keeps_symmetry and axis_of(sequence.final()) is not None
    return Simulator(
        silhouette,
        operators=str(operators),
        resolution=resolution if isinstance(resolution, int) else 128,
        weights=weights_of(sequence.settings),
        max_steps=max(100, len(sequence.steps)),
        faces=sequence.faces,
        symmetry="auto" if is_alike else None,
    )


def retarget(
    simulator: Simulator,
    sequence: ConstructionSequence,
    budget: Budget,
    on_progress: Callable[[Progress], None] | None = None,
    *,
    keep_level: bool = False,
) -> Retargeted:
    """Tell `sequence` again for the simulator's target. KeyboardInterrupt ends the search with the best so far.

    Where the simulator has an axis, the outline, which has to be symmetric in the given sequence, stays so. With
    `keep_level` edges that are level or plumb in the last mesh stay so, whatever it costs, where no defect comes of it.
    All scores are at the silhouette's own resolution. Raises SequenceError as `align`.
    """
    meter = Meter(budget, on_progress)
    beginnings = align(simulator, sequence, meter)
    least = START_SHARE * sequence.start_score["iou"]

    def worth(one: Version) -> float:
        return one.total - _WORTH * (_start_iou(simulator, one) < least)

    beginnings.sort(key=worth, reverse=True)
    version = aligned = beginnings[0]
    try:
        for beginning in beginnings:
            for better in improve(simulator, beginning, meter):
                if worth(better) > worth(version):
                    version, aligned = better, beginning
    except KeyboardInterrupt:
        meter.stopped_by = "interrupted"
    before, refitted = simulator.final_score(sequence.final()), simulator.final_score(aligned.mesh)
    levelled = _levelled(simulator, version) if keep_level else None
    if levelled is not None:
        states = levelled.states(simulator)
        version, solution = levelled, finish(simulator, states, meter, keep_steps=True, keep_shape=True)
    else:
        version, solution = _finished(simulator, version, aligned, refitted, meter)
    n_steps = len(solution.sequence.steps)
    n_kept = sum(origin is not None for origin in version.origins[:n_steps])
    n_dropped = len(sequence.steps) - n_kept
    start_iou = solution.sequence.start_score["iou"]
    offs = _off_line(version, solution.mesh)
    n_level = sum(off <= EXACT for off in offs)
    return Retargeted(
        solution,
        n_kept,
        n_dropped,
        n_steps - n_kept,
        before,
        refitted,
        aligned.mesh,
        start_iou,
        least,
        n_level,
        len(offs) - n_level,
    )


def _finished(
    simulator: Simulator, version: Version, aligned: Version, refitted: Score, meter: Meter
) -> tuple[Version, Solution]:
    """The version, finished; or what it began with, where that is better at the image's own resolution."""
    found = [(version, finish(simulator, version.states(simulator), meter, keep_steps=True))]
    if found[0][1].score.total < refitted.total:
        found.append((aligned, finish(simulator, aligned.states(simulator), meter, keep_steps=True)))
    return max(found, key=lambda pair: simulator.worth(pair[1].mesh))


def _levelled(simulator: Simulator, version: Version) -> Version | None:
    """The version polished, level and plumb where the given one was, and regular; None where it cannot be told so."""
    polished = simulator.polish(version.mesh)
    wanted: list[Regularity] = []
    for kind, rows in zip("xy", _lines(version, polished), strict=True):
        last: dict[int, int] = {}  # vertex of each line
        for v, line in rows.items():
            if line in last:
                wanted.append(Regularity(kind, (last[line], v), 0.0))
            last[line] = v
    mesh = regular(simulator, polished, wanted)
    return first_settled(simulator, [replace(version, mesh=mesh, score=simulator.score(mesh))])


def _off_line(version: Version, mesh: PolyMesh) -> list[float]:
    """How far edges of the mesh, the version's last or one before it, are off level or plumb that were so once."""
    return [
        abs(float(mesh.vertices[a, axis] - mesh.vertices[b, axis]))
        for axis, lines in enumerate(_lines(version, mesh))
        for a, b in mesh.edges.tolist()
        if lines.get(a, -1) == lines.get(b, -2)
    ]


def _lines(version: Version, mesh: PolyMesh) -> tuple[dict[int, int], dict[int, int]]:
    """Of vertices of the mesh the plumb lines, and the level ones, that edges of the given last mesh put them on."""
    old = version.told.final()
    frame = Frame.of([old], None, keep_level=True)
    olds = {new: name for name, new in version.names().items()}
    names = {v: olds[name] for v, name in enumerate(mesh.vertex_ids) if olds.get(name) in old.vertex_ids}
    plumb, level = (
        {v: int(group[frame.anchors[old.vertex_index(name)]]) for v, name in names.items()} for group in frame.groups
    )
    return plumb, level


def _start_iou(simulator: Simulator, version: Version) -> float:
    return simulator.score(version.start).iou


def align(simulator: Simulator, sequence: ConstructionSequence, meter: Meter) -> list[Version]:
    """The construction laid over the target in a few ways, the best first; no step is lost or added.

    Where those start on another part of the shape (`START_SHARE`), the best that does not is among them, too.

    Raises SequenceError where no way leaves it without crossings and flipped faces.
    """
    found = [
        version_of(simulator, told, told.start, _taken(told), range(1, len(told.steps) + 1), laid)
        for told in _both_ways(sequence)
        for laid in _allowed(_alike(_laid_over(told.final(), simulator), simulator, told.final()), simulator)
    ]
    from_afar = _refitted(simulator, found, _FROM_AFAR)
    again = _refitted(simulator, from_afar, THOROUGH)
    fitted = [max(one, other, key=total_of) for one, other in zip(from_afar, again, strict=True)]
    aligned = [first_settled(simulator, [one]) for one in sorted(fitted, key=total_of, reverse=True)]
    settled = [one for one in aligned if one is not None]
    meter.count(2 * len(found), max(map(total_of, settled), default=float("-inf")))
    if not settled:
        raise SequenceError(
            "its steps cannot be laid over the target without crossings or forbidden faces; give another sequence"
        )
    least = START_SHARE * sequence.start_score["iou"]
    same = [one for one in settled if _start_iou(simulator, one) >= least]
    return list(dict.fromkeys([*settled[:_N_BEGINNINGS], *same[:1]]))


def improve(simulator: Simulator, version: Version, meter: Meter) -> Iterator[Version]:
    """Better and better constructions, each a step shorter or longer than the one before it."""
    better: Version | None = version
    while better is not None and not meter.spent():
        version, better = better, None
        hopeful = sorted(neighbours(simulator, version), key=total_of, reverse=True)
        found: list[Version] = []
        for part in (hopeful[:_N_TRIED], hopeful[_N_TRIED:]):
            if better is None and not meter.spent():
                fitted = _refitted(simulator, part[: meter.rest().refits], LOCAL)
                meter.count(len(fitted), version.total, version.shape)
                better = first_settled(simulator, _above(fitted, version))
                found += fitted
        if better is None and not meter.spent():
            best = sorted(found, key=total_of, reverse=True)[:_N_THOROUGH]
            harder = _refitted(simulator, [version, *best][: meter.rest().refits], THOROUGH)
            meter.count(len(harder), version.total, version.shape)
            better = first_settled(simulator, _above(harder, version))
        if better is not None:
            yield better


def _above(found: Sequence[Version], version: Version) -> list[Version]:
    return [one for one in found if one.total > version.total + _LEAST_GAIN]


def _taken(sequence: ConstructionSequence) -> list[Taken]:
    meshes = sequence.meshes()
    follower = Follower(meshes[0], meshes[0])
    return [follower.take(step, meshes[i], meshes[i + 1], stay) for i, step in enumerate(sequence.steps)]


def _both_ways(sequence: ConstructionSequence) -> Iterator[ConstructionSequence]:
    yield sequence
    try:
        yield sequence.mirrored()
    except AutoPolyError:  # whatever cannot be told the other way round
        return


def _laid_over(mesh: PolyMesh, simulator: Simulator) -> Iterator[PolyMesh]:
    """The mesh over the target: by the bounding boxes, and by their moments."""
    mask = simulator.silhouette.mask
    rows, columns = np.nonzero(mask)
    pixels = (np.column_stack((columns, rows)) + 0.5) / len(mask)
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    own_low, own_high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    boxed = mesh.with_vertices(low + (mesh.vertices - own_low) * (high - low) / np.maximum(own_high - own_low, 1e-6))
    yield boxed
    yield _on_contours(boxed, simulator)
    own = _inside(mesh)
    if len(own) > 2:
        stretch = np.sqrt(pixels.var(axis=0) / np.maximum(own.var(axis=0), 1e-9))
        yield mesh.with_vertices(np.clip(pixels.mean(axis=0) + (mesh.vertices - own.mean(axis=0)) * stretch, 0.0, 1.0))


def _allowed(meshes: Iterable[PolyMesh], simulator: Simulator) -> Iterator[PolyMesh]:
    """The meshes, mended where they break the simulator's rule of faces; those that cannot be are left out."""
    for mesh in meshes:
        bonds = simulator.guidance.bonds(mesh)
        made = mesh if simulator.faces == "any" else mended(mesh, simulator.faces, bonds)
        if made is not None:
            yield made


def _alike(meshes: Iterable[PolyMesh], simulator: Simulator, old: PolyMesh) -> Iterator[PolyMesh]:
    """The meshes, where the simulator has an axis, with vertices that are mirror images in `old` so about that."""
    axis, own = simulator.guidance.axis, axis_of(old)
    images = None if own is None else images_of(old, own)
    for mesh in meshes:
        if axis is None:
            yield mesh
        elif images is not None:
            bound = images >= 0
            vertices = mesh.vertices.copy()
            vertices[bound] = 0.5 * (mesh.vertices[bound] + mirrored(mesh.vertices[images[bound]], axis))
            made = mesh.with_vertices(vertices)
            if simulator.guidance.is_symmetric(made):
                yield made


def _on_contours(mesh: PolyMesh, simulator: Simulator) -> PolyMesh:
    """The mesh, roughly in place, with each boundary loop on the best polygon of its size of the nearest contour."""
    rings, vertices = trace_rings(simulator.silhouette), mesh.vertices.copy()
    for loop in sorted(mesh.topology.boundary_loops, key=lambda loop: -abs(signed_area(mesh.vertices[loop]))):
        points = mesh.vertices[loop]
        alike = [r for r in rings if r.is_hole == (signed_area(points) < 0.0) and len(r.points) > len(points)]
        if not alike:
            continue
        ring = min(alike, key=lambda r: float(((r.points.mean(axis=0) - points.mean(axis=0)) ** 2).sum()))
        rings = [one for one in rings if one is not ring]
        polygon = ring.contour.polygon(len(points))
        turns = [np.roll(polygon, turn, axis=0) for turn in range(len(polygon))]
        vertices[loop] = min(turns, key=lambda turned: float(((turned - points) ** 2).sum()))
    return mesh.with_vertices(vertices)


def _inside(mesh: PolyMesh) -> FloatArray:
    """(P, 2) the pixels that a mesh covers."""
    rows, columns = np.nonzero(coverage(mesh, 128) >= 0.5)
    points: FloatArray = (np.column_stack((columns, rows)) + 0.5) / 128
    return points


def _refitted(simulator: Simulator, versions: Sequence[Version], config: RefitConfig) -> list[Version]:
    """Each with its last mesh refitted, on all cores."""

    def fit(version: Version) -> Version:
        target, bonds = simulator.refit_target(version.score.iou), simulator.guidance.bonds(version.mesh)
        mesh = refit(version.mesh, target, config, bonds, simulator.faces).mesh
        return replace(version, mesh=mesh, score=simulator.score(mesh))

    return map_threads(fit, versions)
