"""What a refit knows of a mesh and its target, as arrays, and how unknowns become a mesh that is kept if it is sane.

The unknowns are the N boundary vertices, numbered along the boundary loops so that the normal matrix is almost
banded; the other vertices do not show in the picture and follow their neighbours. Under a rule of faces all V vertices
are unknowns, those of the boundary first (N = V, `rule_kernels`). Letters: V vertices, N boundary
vertices, B directed boundary edges, E edges, F faces, R pixels a side. Positions are in the unit square.
"""

from typing import NamedTuple

import numpy as np

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.compute import inlined, kernel, uncounted_kernel
from autopoly_env.mesh.corner_kernels import keeps_turns
from autopoly_env.mesh.geometry_kernels import count_defects
from autopoly_env.mesh.topology_kernels import links_in, part_of
from autopoly_env.raster.derivative_kernels import half_gradient
from autopoly_env.raster.raster_kernels import Picture, Workspace
from autopoly_env.refit.rule_kernels import Rule, hold


class Ties(NamedTuple):
    """What keeps unknowns from moving freely."""

    leader: IntArray  # (N,) the unknown of which this one is the mirror image; itself where it is none, -1 where locked
    on_axis: IntArray  # (N,) 1 for the unknowns that stay on the axis, 0 for the others
    axis: float  # x of the axis


class Shape(NamedTuple):
    """What the refit needs of a topology, as arrays."""

    edges: IntArray  # (E, 2) these four are those of `Links`
    sides: IntArray  # (E, 2)
    corners: IntArray  # (H,)
    offsets: IntArray  # (F+1,)
    boundary: IntArray  # (N,) vertex of each unknown
    loops: IntArray  # (B, 2) directed boundary edges between unknowns
    inner: IntArray  # (K,) vertices that are not on the boundary
    neighbours: IntArray  # vertices joined to each inner vertex, one after the other
    neighbour_offsets: IntArray  # (K+1,)
    ties: Ties
    rule: Rule


@inlined
def shape_of(packed: IntArray, bound: IntArray, axis: float, asked: float) -> Shape:
    """What a refit needs of a packed topology.

    `bound` is empty where all unknowns are free and faces may have any corners. Otherwise it is packed, too, and says
    of the parts that are not the topology's own: boundary, inner, neighbours, neighbour_offsets; leader and on_axis of
    `Ties`; triples, inner, neighbours, neighbour_offsets and images of `Rule`.
    """
    links = links_in(packed)
    if len(bound) == 0:
        nothing = packed[:0]
        ties = Ties(nothing, nothing, axis)
        rule = Rule(nothing.reshape((0, 3)), nothing, nothing, nothing, nothing, asked)
        return Shape(
            links.edges, links.sides, links.corners, links.offsets, links.outer, links.loops, links.inner,
            links.neighbours, links.neighbour_offsets, ties, rule,
        )  # fmt: skip
    ties = Ties(part_of(bound, 4), part_of(bound, 5), axis)
    rule = Rule(
        part_of(bound, 6).reshape((-1, 3)), part_of(bound, 7), part_of(bound, 8), part_of(bound, 9), part_of(bound, 10),
        asked,
    )  # fmt: skip
    return Shape(
        links.edges, links.sides, links.corners, links.offsets, part_of(bound, 0), links.loops, part_of(bound, 1),
        part_of(bound, 2), part_of(bound, 3), ties, rule,
    )  # fmt: skip


class Settings(NamedTuple):
    """The dials of a refit; `autopoly_env.refit.RefitConfig` says what they mean."""

    first_level: int
    n_near: int
    n_far: int
    stiffness: float
    damping: float
    tolerance: float
    keep_defects: bool


class Progress(NamedTuple):
    """Where a refit stands: what it began with and the best sane mesh found so far, in arrays that kernels write to."""

    start: FloatArray  # (V, 2)
    points: FloatArray  # (V, 2) of the best
    trial: FloatArray  # (V, 2) scratch
    boxes: FloatArray  # (E, 4) scratch
    record: FloatArray  # (7,) LOSS at the current level, MOST_..., N_EVALUATIONS, LOW, HIGH


LOSS, MOST_CROSSINGS, MOST_FLIPPED, N_EVALUATIONS = 0, 1, 2, 3
LOW, HIGH = 4, 5  # of the box that positions stay in
MOST_HAIRLINES = 6
_SWEEPS = 30  # over the vertices off the boundary, at most
_SETTLED = 1e-7  # unit square, that one of them moves in a sweep


@uncounted_kernel
def put(values: FloatArray, into: FloatArray) -> None:
    """Copy an array (n, m). Numba's own assignment would compile for seconds, for its texts of shapes that differ."""
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            into[i, j] = values[i, j]


@uncounted_kernel
def obey(ties: Ties, boundary: IntArray, best: Progress, unknowns: FloatArray) -> None:
    """Put the unknowns that are tied where their ties want them: locked ones at their start, images opposite."""
    if ties.leader.shape[0] == 0:
        return
    start = best.start
    low, high = best.record[LOW], best.record[HIGH]
    left, right = max(low, 2.0 * ties.axis - high), min(high, 2.0 * ties.axis - low)  # so that images stay inside
    for n in range(unknowns.shape[0]):
        leader = ties.leader[n]
        if leader < 0:
            unknowns[n, 0], unknowns[n, 1] = start[boundary[n], 0], start[boundary[n], 1]
        elif ties.on_axis[n]:
            unknowns[n, 0] = ties.axis
        elif leader != n:
            unknowns[leader, 0] = min(max(unknowns[leader, 0], left), right)
            unknowns[n, 0] = 2.0 * ties.axis - unknowns[leader, 0]
            unknowns[n, 1] = unknowns[leader, 1]


@uncounted_kernel
def tie_gradient(ties: Ties, gradient: FloatArray) -> None:
    """Turn a gradient (N, 2) of free unknowns into that of the leading ones, 0 for those that do not lead."""
    if ties.leader.shape[0] == 0:
        return
    for n in range(gradient.shape[0]):
        leader = ties.leader[n]
        if leader >= 0 and leader != n:
            gradient[leader, 0] -= gradient[n, 0]
            gradient[leader, 1] += gradient[n, 1]
        if ties.on_axis[n]:
            gradient[n, 0] = 0.0
        if leader != n:
            gradient[n, 0] = 0.0
            gradient[n, 1] = 0.0


@uncounted_kernel
def tie_normal(ties: Ties, normal: FloatArray) -> None:
    """The same for the lower triangle of J'J (2N, 2N): rows and columns of images are added to those of their leaders,
    and all that do not lead become those of the unit matrix."""
    if ties.leader.shape[0] == 0:
        return
    size = normal.shape[0]
    for i in range(size):
        for j in range(i):
            normal[j, i] = normal[i, j]
    for k in range(size):
        n, axis = k >> 1, k & 1
        leader = ties.leader[n]
        if leader == n and not (axis == 0 and ties.on_axis[n]):
            continue
        if leader >= 0 and leader != n:
            sign = -1.0 if axis == 0 else 1.0
            for i in range(size):
                normal[2 * leader + axis, i] += sign * normal[k, i]
            for i in range(size):
                normal[i, 2 * leader + axis] += sign * normal[i, k]
        for i in range(size):
            normal[k, i] = 0.0
            normal[i, k] = 0.0
        normal[k, k] = 1.0


@uncounted_kernel
def spread(unknowns: FloatArray, shape: Shape, best: Progress) -> None:
    """Write all V positions into `best.trial`: boundary vertices from `unknowns`, inner ones by their neighbours' mean
    move."""
    start, points = best.start, best.trial
    low, high = best.record[LOW], best.record[HIGH]
    put(start, points)
    for n in range(shape.boundary.shape[0]):
        points[shape.boundary[n], 0] = unknowns[n, 0]
        points[shape.boundary[n], 1] = unknowns[n, 1]
    if shape.inner.shape[0] == 0:
        return
    for _sweep in range(_SWEEPS):
        longest = 0.0
        for k in range(shape.inner.shape[0]):
            v = shape.inner[k]
            first, last = shape.neighbour_offsets[k], shape.neighbour_offsets[k + 1]
            for axis in range(2):
                move = 0.0
                for m in range(first, last):
                    u = shape.neighbours[m]
                    move += points[u, axis] - start[u, axis]
                place = min(max(start[v, axis] + move / (last - first), low), high)
                longest = max(longest, abs(place - points[v, axis]))
                points[v, axis] = place
        if longest < _SETTLED:
            return


@uncounted_kernel
def offer(unknowns: FloatArray, shape: Shape, loss: float, best: Progress) -> bool:
    """Keep the mesh if it is sane and its loss is the least so far; say whether it is sane."""
    spread(unknowns, shape, best)
    crossings, _, hairlines, flipped = count_defects(
        best.trial, shape.edges, shape.sides, shape.corners, shape.offsets, best.boxes
    )
    sane = crossings <= best.record[MOST_CROSSINGS] and flipped <= best.record[MOST_FLIPPED]
    sane = sane and hairlines <= best.record[MOST_HAIRLINES]
    sane = sane and keeps_rule(shape, best.trial, best.start)
    if sane and loss < best.record[LOSS]:
        best.record[LOSS] = loss
        put(best.trial, best.points)
    return sane


@uncounted_kernel
def keeps_rule(shape: Shape, points: FloatArray, start: FloatArray) -> bool:
    """Whether every corner turns as it should, or by no less than it did at the start."""
    if shape.rule.triples.shape[0] == 0:
        return True
    return keeps_turns(points, start, shape.corners, shape.offsets, shape.rule.asked)


@uncounted_kernel
def loss_at(unknowns: FloatArray, shape: Shape, picture: Picture, work: Workspace, gradient: FloatArray) -> float:
    """Sum of squared coverage errors; half its gradient per pixel goes into `gradient` (N, 2)."""
    loss = half_gradient(unknowns, shape.loops, picture, work, gradient)
    tie_gradient(shape.ties, gradient)
    return loss


@uncounted_kernel
def take_boundary(points: FloatArray, shape: Shape, unknowns: FloatArray) -> None:
    for k in range(shape.boundary.shape[0]):
        unknowns[k, 0] = points[shape.boundary[k], 0]
        unknowns[k, 1] = points[shape.boundary[k], 1]


@uncounted_kernel
def is_at(unknowns: FloatArray, shape: Shape, best: Progress) -> bool:
    """Whether the unknowns are those of the best mesh so far."""
    for k in range(shape.boundary.shape[0]):
        v = shape.boundary[k]
        if best.points[v, 0] != unknowns[k, 0] or best.points[v, 1] != unknowns[k, 1]:
            return False
    return True


@kernel
def rebase(shape: Shape, picture: Picture, work: Workspace, scratch: FloatArray, best: Progress) -> None:
    """Restate the loss of the best mesh so far at another level."""
    unknowns = np.empty((shape.boundary.shape[0], 2))
    take_boundary(best.points, shape, unknowns)
    best.record[LOSS] = loss_at(unknowns, shape, picture, work, scratch)


@kernel
def hold_vertices(
    points: FloatArray, packed: IntArray, bound: IntArray, axis: float, asked: float, low: float, high: float
) -> None:
    """`hold` of the unknowns among `points` (V, 2), in place; the arguments between are those of `shape_of`."""
    shape = shape_of(packed, bound, axis, asked)
    unknowns = np.empty((shape.boundary.shape[0], 2))
    take_boundary(points, shape, unknowns)
    hold(shape.rule, unknowns, low, high)
    for k in range(shape.boundary.shape[0]):
        points[shape.boundary[k], 0], points[shape.boundary[k], 1] = unknowns[k, 0], unknowns[k, 1]
