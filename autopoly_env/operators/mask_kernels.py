"""A Numba kernel that writes the masks of several operators at once: every step needs all of them.

Letters: K operators, V vertices, E edges, F faces, H corners.
"""

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray, IntArray
from autopoly_env.compute import kernel
from autopoly_env.mesh.planar_kernels import splittable_corners
from autopoly_env.mesh.topology_kernels import links_in
from autopoly_env.operators.edit_kernels import dissolvable, joinable
from autopoly_env.operators.hole_kernels import TINY_AREA, roomy_faces

# Which elements an operator works on
ALL_EDGES, RIM_EDGES, JOINABLE_EDGES, SPARE_FACES, ROOMY_FACES, SPLITTABLE_CORNERS, DISSOLVABLE_VERTICES = range(7)
RULE, START, ROOM, N_EACH, CHANGES = range(5)  # columns of a row of the table; CHANGES are the first of six
N_COLUMNS = CHANGES + 6


@kernel
def legal(points: FloatArray, packed: IntArray, table: IntArray, most: IntArray, mask: BoolArray) -> None:
    """Write the masks of K operators to `mask`.

    A row of the `table` (K, 10) says which elements an operator works on, where its mask begins, how many elements have
    room there, how many there are at each place, one or two, and how V, E and F change at each of these. Where that
    would be more than the `most` (3,) that there may be, the action is not legal.
    """
    links = links_in(packed)
    counts = (len(points), len(links.edges), len(links.offsets) - 1)
    for k in range(len(table)):
        found = masked(points, packed, table[k, RULE])
        n_each = table[k, N_EACH]
        for place in range(len(found)):
            for i in range(n_each):
                element = n_each * place + i
                fits = element < table[k, ROOM]
                for kind in range(3):
                    change = table[k, CHANGES + 3 * i + kind]
                    fits = fits and (change <= 0 or counts[kind] + change <= most[kind])
                if fits:
                    mask[table[k, START] + element] = found[place]


@kernel
def masked(points: FloatArray, packed: IntArray, rule: int) -> BoolArray:
    """The mask of the vertices, edges, faces or corners."""
    links = links_in(packed)
    if rule == ALL_EDGES or rule == RIM_EDGES:
        mask = np.empty(len(links.edges), np.bool_)
        for e in range(len(mask)):
            mask[e] = rule == ALL_EDGES or links.sides[e, 1] < 0
        return mask
    if rule == JOINABLE_EDGES:
        return joinable(packed)
    if rule == SPARE_FACES:
        mask = np.empty(len(links.offsets) - 1, np.bool_)
        for f in range(len(mask)):
            mask[f] = len(mask) > 1
        return mask
    if rule == ROOMY_FACES:
        return roomy_faces(points, links.corners, links.offsets, TINY_AREA)
    if rule == SPLITTABLE_CORNERS:
        return splittable_corners(points, links.corners, links.offsets, links.edges)
    return dissolvable(packed, len(points))
