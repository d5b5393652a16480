"""Numba kernels that say where the rendering and the target disagree, and which boundary edge is to blame for what.

Letters: R pixels a side, L regions of connected disagreement, V vertices, B directed boundary edges.
"""

import numpy as np

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.compute import kernel, uncounted_kernel
from autopoly_env.mesh.topology_kernels import links_in
from autopoly_env.raster.raster_kernels import Workspace, coverage_image

MASS, FAR_X, FAR_Y, LOW, HIGH, DEPTH = range(6)
AREA, DEEP_X, DEEP_Y, RADIUS, MEAN_X, MEAN_Y, VAR_X, VAR_Y, COV_XY = range(9)


@kernel
def disagreement_of(
    points: FloatArray, packed: IntArray, target: FloatArray, weights: FloatArray, threshold: float, work: Workspace
) -> tuple[FloatArray, IntArray, int, FloatArray]:
    """(R, R) the target's coverage less that of the mesh, its regions as `regions_of` labels them, their number L, and
    which edges of the boundary are to blame, as `blame_edges` says.

    `packed` is the mesh's topology. Where `weights` (R, R) are not empty, pixels of weight 0 do not
    disagree, and the difference of the others counts as much as they weigh.
    """
    size, boundary = len(target), links_in(packed).boundary
    difference = np.empty((size, size))
    coverage_image(points, boundary, size, work, difference)
    for row in range(size):
        for column in range(size):
            difference[row, column] = target[row, column] - min(difference[row, column], 1.0)
            if len(weights) > 0 and not weights[row, column] > 0.0:
                difference[row, column] = 0.0
    labels, n_labels = regions_of(difference, threshold)
    for row in range(len(weights)):
        for column in range(size):
            difference[row, column] *= weights[row, column]
    return difference, labels, n_labels, blame_edges(points, boundary, difference, labels, n_labels)


@kernel
def regions_of(difference: FloatArray, threshold: float) -> tuple[IntArray, int]:
    """Label (R, R) the 4-connected regions where `difference` is above the threshold or below its negative.

    Returns the labels, -1 where the two agree, and their number L.
    """
    size = difference.shape[0]
    labels = np.full((size, size), -1, np.int64)
    stack = np.empty(size * size, np.int64)
    n_labels = 0
    for first_row in range(size):
        for first_column in range(size):
            first = difference[first_row, first_column]
            if not abs(first) > threshold or labels[first_row, first_column] >= 0:
                continue
            labels[first_row, first_column] = n_labels
            stack[0] = first_row * size + first_column
            height = 1
            while height > 0:
                height -= 1
                row, column = stack[height] // size, stack[height] % size
                for step_r, step_c in ((0, 1), (1, 0), (0, -1), (-1, 0)):
                    r, c = row + step_r, column + step_c
                    if r < 0 or c < 0 or r >= size or c >= size or labels[r, c] >= 0:
                        continue
                    d = difference[r, c]
                    if abs(d) > threshold and (d > 0.0) == (first > 0.0):
                        labels[r, c] = n_labels
                        stack[height] = r * size + c
                        height += 1
            n_labels += 1
    return labels, n_labels


@kernel
def blame_edges(
    points: FloatArray, edges: IntArray, difference: FloatArray, labels: IntArray, n_labels: int
) -> FloatArray:
    """Give every disagreeing pixel to its nearest boundary edge: (B, 2, 6), [:, 0] what is missing, [:, 1] the excess.

    An edge answers for the region with most of its pixels (by area): MASS is their area in the unit square, FAR_X and
    FAR_Y the pixel farthest from the edge, DEPTH its distance from the line, LOW and HIGH the stretch along the edge
    (0 to 1) that the pixels span.
    """
    size = difference.shape[0]
    n_edges = edges.shape[0]
    table = np.zeros((n_edges, n_labels, 6))
    missing = np.zeros(n_labels, np.bool_)
    for edge in range(n_edges):
        for label in range(n_labels):
            table[edge, label, LOW], table[edge, label, HIGH], table[edge, label, DEPTH] = 1.0, 0.0, -1.0
    for row in range(size):
        for column in range(size):
            label = labels[row, column]
            if label < 0:
                continue
            missing[label] = difference[row, column] > 0.0
            x, y = (column + 0.5) / size, (row + 0.5) / size
            edge, along, across = _nearest_edge(points, edges, x, y)
            entry = table[edge, label]
            entry[MASS] += abs(difference[row, column]) / (size * size)
            entry[LOW], entry[HIGH] = min(entry[LOW], along), max(entry[HIGH], along)
            if across > entry[DEPTH]:
                entry[DEPTH], entry[FAR_X], entry[FAR_Y] = across, x, y
    blame = np.zeros((n_edges, 2, 6))
    for edge in range(n_edges):
        for label in range(n_labels):
            side = 0 if missing[label] else 1
            if table[edge, label, MASS] > blame[edge, side, MASS]:
                blame[edge, side] = table[edge, label]
    return blame


@uncounted_kernel
def _nearest_edge(points: FloatArray, edges: IntArray, x: float, y: float) -> tuple[int, float, float]:
    """The boundary edge nearest to (x, y), the foot of the perpendicular along it (0 to 1), and the distance."""
    nearest, least, foot = 0, np.inf, 0.0
    for edge in range(edges.shape[0]):
        ax, ay = points[edges[edge, 0], 0], points[edges[edge, 0], 1]
        dx, dy = points[edges[edge, 1], 0] - ax, points[edges[edge, 1], 1] - ay
        square = dx * dx + dy * dy
        along = ((x - ax) * dx + (y - ay) * dy) / square if square > 0.0 else 0.0
        along = min(max(along, 0.0), 1.0)
        distance = (x - ax - along * dx) ** 2 + (y - ay - along * dy) ** 2
        if distance < least:
            nearest, least, foot = edge, distance, along
    return nearest, foot, np.sqrt(least)


@kernel
def measure_regions(difference: FloatArray, labels: IntArray, n_labels: int) -> FloatArray:
    """Per region (L, 9), unit square: signed AREA (missing positive), deepest pixel and its distance to the rim,
    mean and variances of the pixels' positions."""
    size = difference.shape[0]
    found = np.zeros((n_labels, 9))
    count = np.zeros(n_labels)
    depth = _depths(labels)
    for row in range(size):
        for column in range(size):
            label = labels[row, column]
            if label < 0:
                continue
            x, y = (column + 0.5) / size, (row + 0.5) / size
            region = found[label]
            count[label] += 1.0
            region[AREA] += difference[row, column] / (size * size)
            region[MEAN_X] += x
            region[MEAN_Y] += y
            region[VAR_X] += x * x
            region[VAR_Y] += y * y
            region[COV_XY] += x * y
            if depth[row, column] / size > region[RADIUS]:
                region[RADIUS], region[DEEP_X], region[DEEP_Y] = depth[row, column] / size, x, y
    for label in range(n_labels):
        region = found[label]
        for k in range(MEAN_X, COV_XY + 1):
            region[k] /= count[label]
        region[VAR_X] -= region[MEAN_X] ** 2
        region[VAR_Y] -= region[MEAN_Y] ** 2
        region[COV_XY] -= region[MEAN_X] * region[MEAN_Y]
    return found


@kernel
def _depths(labels: IntArray) -> FloatArray:
    """Distance in pixels from each pixel to the nearest one of another label (two-pass chamfer, 1 and 1.41)."""
    size = labels.shape[0]
    depth = np.zeros((size, size))
    for sweep in range(2):
        for k in range(size * size):
            cell = k if sweep == 0 else size * size - 1 - k
            row, column = cell // size, cell % size
            if labels[row, column] < 0:
                continue
            least = np.inf if sweep == 0 else depth[row, column]
            step = -1 if sweep == 0 else 1
            for step_r, step_c, cost in (
                (0, step, 1.0), (step, 0, 1.0), (step, step, 1.4142), (step, -step, 1.4142),
            ):  # fmt: skip
                r, c = row + step_r, column + step_c
                outside = r < 0 or c < 0 or r >= size or c >= size or labels[r, c] != labels[row, column]
                least = min(least, 0.5 if outside else depth[r, c] + cost)
            depth[row, column] = least
    return depth
