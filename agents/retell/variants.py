"""Variants of a construction: an early step's vertices are pulled somewhere else, and the later steps come along."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from agents.retell.frame import Frame
from autopoly_env.arrays import FloatArray
from autopoly_env.errors import AutoPolyError, SequenceError
from autopoly_env.mesh import PolyMesh, is_sane
from autopoly_env.mesh.symmetry import axis_of
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.sequence.deformation import ThinPlate
from autopoly_env.sequence.follower import PointMap

N_TRIES = 50  # draws for a variant before it is given up
EARLY = 0.35  # share of the steps, from the start, that are edited
_N_PULLS = (1, 3)  # vertices or edges that are pulled in one edit, at least and below
_END_SHARE = 0.8  # of pulls that take a whole end of the shape, the others a vertex or an edge
_LONG, _ASLANT = 1.5, 12.0  # of a shape with directions of its own: length over width, degrees off the upright
_GAP = 0.06  # between the two sides of the line that an end begins at, unit square
_LEAST_PULL = 0.6  # of the amount
_MARGIN = 0.02  # around a variant, unit square
_SAME = 0.3  # of the amount, by which some vertex is to differ from that in every other variant


@dataclass(frozen=True)
class Variant:
    """A construction with an edit in it, carried on to the end."""

    sequence: ConstructionSequence
    step: int  # after which the vertices were pulled, 0 is the start
    moved: tuple[int, ...]  # their ids
    n_tries: int  # draws that it took


def draw_variants(
    sequence: ConstructionSequence,
    n: int,
    amount: float,
    seed: int,
    *,
    keep_level: bool = False,
    keep_symmetry: bool = True,
) -> Iterator[Variant | None]:
    """`n` variants that differ, None for one that was not found in `N_TRIES` draws.

    Every mesh on the way is free of self-intersections and flipped faces, keeps the sequence's rule of faces, and lies
    in the unit square: what leaves it is scaled down as a whole. `amount` is how far an edit pulls, in the unit square.
    With `keep_symmetry` an outline that is symmetric in the end is so in every variant, with `keep_level` every edge
    that is level or plumb stays so. Raises SequenceError where the sequence itself has a defect.
    """
    check_sound(sequence)
    meshes = sequence.meshes()
    finals = [meshes[-1].vertices]
    axis = axis_of(meshes[-1]) if keep_symmetry else None
    frames = [Frame.of(meshes[k:], axis, keep_level=keep_level) for k in range(_n_early(sequence) + 1)]
    for index in range(n):
        variant = _draw(sequence, meshes, frames, amount, np.random.default_rng([seed, index]), finals)
        if variant is not None:
            finals.append(variant.sequence.final().vertices)
        yield variant


def check_sound(sequence: ConstructionSequence) -> None:
    """Raise SequenceError if a mesh on the way crosses itself, or has flipped faces."""
    for number, mesh in enumerate(sequence.meshes()):
        if not is_sane(mesh):
            raise SequenceError(f"step {number}: the mesh after it crosses itself or has flipped faces; mend it first")


def _n_early(sequence: ConstructionSequence) -> int:
    return int(EARLY * len(sequence.steps))


def _draw(
    sequence: ConstructionSequence,
    meshes: list[PolyMesh],
    frames: Sequence[Frame],
    amount: float,
    rng: np.random.Generator,
    finals: list[FloatArray],
) -> Variant | None:
    """A variant whose last mesh is unlike all of `finals`; frame k holds the meshes from number k on."""
    axes = _axes_of(meshes[-1])
    for n_tries in range(1, N_TRIES + 1):
        k = int(rng.integers(0, len(frames)))
        anchors = frames[k].places[frames[k].anchors]
        pulls = frames[k].led(_pulled(meshes[k], anchors, axes, amount, rng))
        bend = frames[k].held(ThinPlate.through(anchors, anchors + pulls))
        moved = [mesh.vertices if i < k else bend(mesh.vertices) for i, mesh in enumerate(meshes)]
        scale, shift = _fitting(moved)
        if any(_is_like(final, scale * moved[-1] + shift, _SAME * amount) for final in finals):
            continue
        if not all(
            is_sane(mesh.with_vertices(points), sequence.faces) for mesh, points in zip(meshes, moved, strict=True)
        ):
            continue
        try:
            varied = sequence.moved_by(partial(_place, k, bend, scale, shift))
        except AutoPolyError:  # a later step has no room
            continue
        if all(is_sane(mesh, sequence.faces) for mesh in varied.meshes()) and _keeps(frames[k], varied.final()):
            names = tuple(name for name, pull in zip(meshes[k].vertex_ids, pulls, strict=False) if pull.any())
            return Variant(_with_its_axis(varied), k, names, n_tries)
    return None


def _keeps(frame: Frame, final: PolyMesh) -> bool:
    """Whether an outline that is to be symmetric is."""
    return not frame.is_symmetric or axis_of(final) is not None


def _with_its_axis(sequence: ConstructionSequence) -> ConstructionSequence:
    """The sequence with the axis that it has now in its settings, where they tell of one."""
    if "symmetry" not in sequence.settings:
        return sequence
    return replace(sequence, settings={**sequence.settings, "symmetry": axis_of(sequence.final())})


def _pulled(
    mesh: PolyMesh, points: FloatArray, axes: FloatArray, amount: float, rng: np.random.Generator
) -> FloatArray:
    """(P, 2) how far each of some points is pulled, in the sum of a few ways; the first are the mesh's vertices."""
    pulls = np.zeros_like(points)
    for _ in range(rng.integers(*_N_PULLS)):
        length = amount * rng.uniform(_LEAST_PULL, 1.0) * rng.choice((-1.0, 1.0))
        if rng.random() < _END_SHARE:
            pulls += length * _end_pulled(points @ axes.T, rng) @ axes
        else:
            a, b = mesh.topology.boundary_half_edges[rng.integers(len(mesh.topology.boundary_half_edges))]
            pulls[[a, b] if rng.random() < 0.5 else [a]] += length * axes[rng.integers(2)]
    return pulls


def _end_pulled(points: FloatArray, rng: np.random.Generator) -> FloatArray:
    """(P, 2) a pull of all points on one side of a line: out (longer legs), wider, or aside; 1 where it is most.

    Points and pulls are (P, 2) along the axes of the shape.
    """
    u = int(rng.integers(2))
    heights = np.sort(points[:, u])
    gaps = np.diff(heights)
    cut = int(rng.choice(np.flatnonzero(gaps >= min(_GAP, gaps.max()))))  # not between two feet of much the same height
    beyond = points[:, u] > 0.5 * (heights[cut] + heights[cut + 1])
    if rng.random() < 0.5:
        beyond = ~beyond
    pulls = np.zeros_like(points)
    kind = rng.random()
    if kind < 0.45:
        pulls[beyond, u] = 1.0
    elif kind < 0.9:
        across = points[:, 1 - u] - points[:, 1 - u].mean()
        pulls[beyond, 1 - u] = (across / max(float(np.abs(across).max()), 1e-12))[beyond]
    else:
        pulls[beyond, 1 - u] = 1.0
    return pulls


def _axes_of(mesh: PolyMesh) -> FloatArray:
    """(2, 2) the two directions, a row each, that a shape has: its principal ones if it is long and lies aslant."""
    spread, axes = np.linalg.eigh(np.cov(mesh.vertices.T))
    is_long = spread[1] > _LONG**2 * max(float(spread[0]), 1e-12)
    is_aslant = np.abs(axes).max() < np.cos(np.radians(_ASLANT))
    directions: FloatArray = axes.T if is_long and is_aslant else np.eye(2)
    return directions


def _fitting(moved: list[FloatArray]) -> tuple[float, FloatArray]:
    """Scale and shift that bring all points into the unit square, 1 and 0 where they lie in it."""
    points = np.concatenate(moved)
    low, high = points.min(axis=0), points.max(axis=0)
    if low.min() >= 0.0 and high.max() <= 1.0:
        return 1.0, np.zeros(2)
    scale = min(1.0, (1.0 - 2.0 * _MARGIN) / float((high - low).max()))
    return scale, np.clip(0.0, _MARGIN - scale * low, 1.0 - _MARGIN - scale * high)


def _place(k: int, bend: PointMap, scale: float, shift: FloatArray, i: int) -> PointMap:
    """Where the points of mesh i go: bent from step k on, then scaled and shifted."""
    return lambda points: scale * (bend(points) if i >= k else points) + shift


def _is_like(one: FloatArray, other: FloatArray, distance: float) -> bool:
    return bool((np.hypot(*(one - other).T) < distance).all())
