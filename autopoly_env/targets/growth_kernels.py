"""Numba kernels of how random constructions grow: an action drawn and done, all vertices moved at random, and a look.

Randomness comes as `draws`, uniform numbers of which a kernel uses as many as it needs, in order, and says how many.
Lengths as in `growth`. Letters: V vertices, F faces, H half-edges.
"""

from typing import NamedTuple

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray, IntArray
from autopoly_env.compute import kernel, uncounted_kernel
from autopoly_env.mesh.planar_kernels import ring_of, split_imbalance
from autopoly_env.mesh.topology_kernels import links_in
from autopoly_env.operators.edit_kernels import (
    DELETE,
    EXTRUDE,
    HOLE,
    SPLIT,
    SUBDIVIDE,
    edited,
    extrusion,
)
from autopoly_env.operators.hole_kernels import HOLE_SIDES, plan_bridges
from autopoly_env.operators.mask_kernels import (
    ALL_EDGES,
    DISSOLVABLE_VERTICES,
    RIM_EDGES,
    ROOMY_FACES,
    SPARE_FACES,
    SPLITTABLE_CORNERS,
    masked,
)
from autopoly_env.raster.raster_kernels import Workspace
from autopoly_env.targets.construction_kernels import Limits, clearance, is_sound

# Where each edit works, in the order of their numbers
_RULES = (ALL_EDGES, RIM_EDGES, SPARE_FACES, DISSOLVABLE_VERTICES, SPLITTABLE_CORNERS, ROOMY_FACES)
N_DRAWS = 40  # actions drawn for a change before the construction is given up
N_SHAKES = 6  # random translations tried for an action, each a little smaller
N_POINTS = 12  # tried for the middle of a hole
SHAKE = 0.05  # how far a translation takes a vertex, in square roots of the shape's area
STUCK, MORE_DRAWS = -1, -2  # in the place of a number of steps
KIND, ELEMENT, OTHER = range(3)  # columns of a step; OTHER is what was left free by it: the corner that a split goes to
_N_PULLS = 3  # draws for where new vertices are pulled to
_SAME = 1e-12  # areas of a split that are alike


class Step(NamedTuple):
    """What became of an action."""

    n_used: int  # draws
    points: FloatArray  # (V, 2) after it and a random translation; empty where it failed
    packed: IntArray  # the topology after it


@uncounted_kernel
def _most_draws(n_vertices: int) -> int:
    """How many draws a change of a mesh with so many vertices may take: at most two steps and what chooses them."""
    return 2 * (4 + 2 * N_POINTS + N_SHAKES * (_N_PULLS + 2 * (n_vertices + 4)))


@kernel
def grow(
    start: FloatArray, packed: IntArray, kinds: IntArray, n_changes: int, draws: FloatArray, limits: Limits,
    work: Workspace, image: FloatArray,
) -> tuple[int, int, IntArray, FloatArray, IntArray, FloatArray, IntArray, IntArray]:  # fmt: skip
    """Change the outline of a mesh `n_changes` times, each by a random action of one of the `kinds`, drawn in turn.

    No two outlines have the same numbers of corners. A split comes with the deletion of one of the two parts.

    Returned are the number of steps (or `STUCK`, or `MORE_DRAWS`), the draws used, the steps (n, 3), the places of the
    vertices after each, one after the other, and where those of each end (n,), the corners (n, 4, 2) and the bridges
    (n, 4) of the holes, and the topology in the end.
    """
    most = 2 * n_changes
    steps, ends = np.full((most, 3), -1, np.int64), np.empty(most, np.int64)
    holes, bridges = np.zeros((most, 4, 2)), np.zeros((most, 4), np.int64)
    places, outlines = np.empty((0, 2)), _outline_of(packed)
    points, n_steps, n_used = start, 0, 0
    for _change in range(n_changes):
        begun = n_steps
        for _draw in range(N_DRAWS):
            if len(draws) - n_used < _most_draws(len(points) + 2):
                return MORE_DRAWS, 0, steps, places, ends, holes, bridges, packed
            steps[n_steps] = -1
            steps[n_steps, KIND] = kinds[int(len(kinds) * draws[n_used])]
            n_used += 1
            known = outlines[:0] if steps[n_steps, KIND] == SPLIT else outlines
            made = _step(
                points, packed, steps[n_steps], known, holes[n_steps], bridges[n_steps], draws[n_used:], limits, work,
                image,
            )  # fmt: skip
            n_used += made.n_used
            if len(made.points) > 0 and steps[n_steps, KIND] == SPLIT:
                links = links_in(packed)
                part = links.owners[steps[n_steps, ELEMENT]] if draws[n_used] < 0.5 else len(links.offsets) - 1
                steps[n_steps + 1, KIND], steps[n_steps + 1, ELEMENT] = DELETE, part
                rest = _step(
                    made.points, made.packed, steps[n_steps + 1], outlines, holes[n_steps], bridges[n_steps],
                    draws[n_used + 1 :], limits, work, image,
                )  # fmt: skip
                n_used += 1 + rest.n_used
                if len(rest.points) > 0:
                    places, ends[n_steps] = np.concatenate((places, made.points)), len(places) + len(made.points)
                    n_steps += 1
                made = rest
            if len(made.points) > 0:
                places, ends[n_steps] = np.concatenate((places, made.points)), len(places) + len(made.points)
                points, packed, n_steps = made.points, made.packed, n_steps + 1
                outlines = np.concatenate((outlines, _outline_of(packed)))
                break
        if n_steps == begun:
            return STUCK, n_used, steps, places, ends, holes, bridges, packed
    return n_steps, n_used, steps[:n_steps], places, ends[:n_steps], holes[:n_steps], bridges[:n_steps], packed


@kernel
def _step(
    points: FloatArray, packed: IntArray, action: IntArray, outlines: IntArray, hole: FloatArray, bridges: IntArray,
    draws: FloatArray, limits: Limits, work: Workspace, image: FloatArray,
) -> Step:  # fmt: skip
    """An `action` (3,) done, on its element or, where that is -1, on one that is drawn of the legal ones.

    It fails where none is legal, where the outline has the numbers of corners that one of the `outlines` has (see
    `_is_among`), and where no translation leaves the shape sound. What was drawn is written to `action`, of a hole to
    `hole` (4, 2) and `bridges` (4,).
    """
    kind, element, n, n_used = action[KIND], action[ELEMENT], len(points), 0
    failed = np.empty((0, 2))
    legal = _legal(points, packed, kind)
    if len(legal) == 0:
        return Step(0, failed, packed)
    if element < 0:
        element, n_used = legal[int(len(legal) * draws[0])], 1
        action[ELEMENT] = element
    if kind == SPLIT:
        action[OTHER] = _most_even(points, packed, element)
    if kind == HOLE:
        fits, n_drawn = _plan(points, packed, element, hole, bridges, draws[n_used:])
        n_used += n_drawn
        if not fits:
            return Step(n_used, failed, packed)
    made, kept = edited(packed, n, kind, element, bridges if kind == HOLE else action[OTHER:])
    if _is_among(outlines, made):
        return Step(n_used, failed, packed)
    begun = np.empty((len(kept), 2))
    for v in range(len(kept)):
        if kept[v] < n:
            begun[v, 0], begun[v, 1] = points[kept[v], 0], points[kept[v], 1]
    _place(points, packed, kind, element, hole, begun)
    shaken, n_shaking = _translated(points, packed, kind, element, begun, made, draws[n_used:], limits, work, image)
    return Step(n_used + n_shaking, shaken, made)


@kernel
def _translated(
    points: FloatArray, packed: IntArray, kind: int, element: int, begun: FloatArray, made: IntArray,
    draws: FloatArray, limits: Limits, work: Workspace, image: FloatArray,
) -> tuple[FloatArray, int]:  # fmt: skip
    """`begun` (V, 2), with the packed topology `made`, moved at random until it is sound, and the draws that took.

    New vertices of what is subdivided and extruded are pulled far away, all others moved by a little. `points` and
    `packed` are of the mesh before. Empty where it is not sound after `N_SHAKES` translations, each a little smaller.
    """
    size, n_used = np.sqrt(_area(points, packed)), 0
    moved = np.empty_like(begun)
    for attempt in range(N_SHAKES):
        moved[:] = begun
        n_used += _pull(points, packed, kind, element, moved, draws[n_used:])
        length = (1.0 - attempt / N_SHAKES) * SHAKE * size
        for v in range(len(moved)):
            for axis in range(2):
                moved[v, axis] += length * (2.0 * draws[n_used] - 1.0)
                n_used += 1
        if is_sound(moved, made, limits, work, image):
            return moved, n_used
    return moved[:0], n_used


@kernel
def _outline_of(packed: IntArray) -> IntArray:
    """The number of the outline's loops, then the number of corners of each, the least first."""
    ends = links_in(packed).loop_ends
    found = np.empty(len(ends) + 1, np.int64)
    found[0] = len(ends)
    for loop in range(len(ends)):
        size, k = ends[loop] - (ends[loop - 1] if loop > 0 else 0), loop + 1
        while k > 1 and found[k - 1] > size:
            found[k] = found[k - 1]
            k -= 1
        found[k] = size
    return found


@kernel
def _is_among(outlines: IntArray, packed: IntArray) -> bool:
    """Whether what `_outline_of` gives is one of the `outlines`, which are laid end to end."""
    own, begin = _outline_of(packed), 0
    while begin < len(outlines):
        is_same = outlines[begin] == own[0]
        for k in range(outlines[begin]):
            is_same = is_same and outlines[begin + 1 + k] == own[1 + k]
        if is_same:
            return True
        begin += 1 + outlines[begin]
    return False


@kernel
def _legal(points: FloatArray, packed: IntArray, kind: int) -> IntArray:
    """The elements that an action of a kind may work on, ascending."""
    places = _where(masked(points, packed, _RULES[kind]))
    if kind != HOLE:
        return places
    legal = np.empty(len(HOLE_SIDES) * len(places), np.int64)
    for k in range(len(legal)):
        legal[k] = len(HOLE_SIDES) * places[k // len(HOLE_SIDES)] + k % len(HOLE_SIDES)
    return legal


@kernel
def _where(mask: BoolArray) -> IntArray:
    """The indices (n,) at which it is true."""
    found, n = np.empty(len(mask), np.int64), 0
    for k in range(len(mask)):
        if mask[k]:
            found[n] = k
            n += 1
    return found[:n]


@kernel
def _most_even(points: FloatArray, packed: IntArray, corner: int) -> int:
    """The corner to which the split from a corner is most even; of equals the first in the face."""
    links = links_in(packed)
    face = links.owners[corner]
    first = links.offsets[face]
    costs = split_imbalance(points, links.corners[first : links.offsets[face + 1]], links.edges, corner - first)
    least = np.inf
    for cost in costs:
        least = min(least, cost)
    k = 0
    while not costs[k] <= least + _SAME:
        k += 1
    return first + k


@kernel
def _plan(
    points: FloatArray, packed: IntArray, element: int, hole: FloatArray, bridges: IntArray, draws: FloatArray
) -> tuple[bool, int]:  # fmt: skip
    """A regular hole about the roomiest of a few random points in the face; whether it fits, and the draws used."""
    links, face, n_sides = links_in(packed), element // 2, HOLE_SIDES[element % 2]
    ring = ring_of(points, links.corners[links.offsets[face] : links.offsets[face + 1]])
    low_x, high_x, low_y, high_y = np.inf, -np.inf, np.inf, -np.inf
    for k in range(len(ring)):
        low_x, high_x = min(low_x, ring[k, 0]), max(high_x, ring[k, 0])
        low_y, high_y = min(low_y, ring[k, 1]), max(high_y, ring[k, 1])
    room, x, y = -np.inf, 0.0, 0.0
    for k in range(N_POINTS):
        u = 0.5 * (low_x + high_x) + 0.5 * (high_x - low_x) * (2.0 * draws[2 * k] - 1.0)
        v = 0.5 * (low_y + high_y) + 0.5 * (high_y - low_y) * (2.0 * draws[2 * k + 1] - 1.0)
        clear = clearance(ring, u, v)
        if clear > room:
            room, x, y = clear, u, v
    if room <= 0.0:
        return False, 2 * N_POINTS
    radius = _between(0.4, 0.75, draws[2 * N_POINTS + 1]) * room
    for k in range(n_sides):
        angle = 2.0 * np.pi * (draws[2 * N_POINTS] + k) / n_sides
        hole[k, 0], hole[k, 1] = x + radius * np.cos(angle), y + radius * np.sin(angle)
    fits = plan_bridges(ring, hole[:n_sides], bridges)
    return fits, 2 * N_POINTS + 2


@kernel
def _place(
    points: FloatArray, packed: IntArray, kind: int, element: int, hole: FloatArray, begun: FloatArray
) -> None:  # fmt: skip
    """Put the new vertices, the last ones of `begun`, where the operator does."""
    links, n = links_in(packed), len(points)
    if kind == SUBDIVIDE:
        a, b = links.edges[element, 0], links.edges[element, 1]
        for axis in range(2):
            begun[n, axis] = 0.5 * (points[a, axis] + points[b, axis])
    elif kind == EXTRUDE:
        side = links.sides[element, 0]
        a, b = links.half_edges[side, 0], links.half_edges[side, 1]
        begun[n, 0], begun[n, 1], begun[n + 1, 0], begun[n + 1, 1] = extrusion(points, links.edges, a, b)
    elif kind == HOLE:
        for k in range(len(begun) - n):
            begun[n + k, 0], begun[n + k, 1] = hole[k, 0], hole[k, 1]


@kernel
def _pull(
    points: FloatArray, packed: IntArray, kind: int, element: int, moved: FloatArray, draws: FloatArray
) -> int:  # fmt: skip
    """Move the new vertices far from the edge that they come from; the draws that took.

    A midpoint goes to either side of its edge; an extruded edge farther out, wider or narrower, shifted.
    """
    if kind != SUBDIVIDE and kind != EXTRUDE:
        return 0
    links, n = links_in(packed), len(points)
    side = links.sides[element, 0]
    tail, head = links.half_edges[side, 0], links.half_edges[side, 1]
    along_x, along_y = points[head, 0] - points[tail, 0], points[head, 1] - points[tail, 1]
    out_x, out_y = along_y, -along_x
    if kind == SUBDIVIDE:
        far = _between(0.2, 0.6, draws[0]) * (1.0 if draws[1] < 0.6 else -1.0)
        shift = _between(-0.3, 0.3, draws[2])
        moved[n, 0] = moved[n, 0] + far * out_x + shift * along_x
        moved[n, 1] = moved[n, 1] + far * out_y + shift * along_y
        return _N_PULLS
    far, shift, wide = _between(0.0, 1.0, draws[0]), _between(-0.35, 0.35, draws[1]), _between(0.35, 1.3, draws[2])
    mean_x, mean_y = (moved[n, 0] + moved[n + 1, 0]) / 2.0, (moved[n, 1] + moved[n + 1, 1]) / 2.0
    middle_x, middle_y = mean_x + far * out_x + shift * along_x, mean_y + far * out_y + shift * along_y
    for v in range(n, n + 2):
        moved[v, 0], moved[v, 1] = middle_x + wide * (moved[v, 0] - mean_x), middle_y + wide * (moved[v, 1] - mean_y)
    return _N_PULLS


@uncounted_kernel
def _between(low: float, high: float, draw: float) -> float:
    return low + (high - low) * draw


@kernel
def _area(points: FloatArray, packed: IntArray) -> float:
    """Of all faces."""
    links, area = links_in(packed), 0.0
    for h in range(len(links.corners)):
        a, b = links.half_edges[h, 0], links.half_edges[h, 1]
        area += 0.5 * (points[a, 0] * points[b, 1] - points[b, 0] * points[a, 1])
    return area
