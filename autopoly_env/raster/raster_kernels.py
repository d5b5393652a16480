"""Numba kernels of the exact area-coverage rasteriser: walk the boundary, sum along rows, touch nothing inside.

The coverage of a pixel is the area of the mesh inside it. Each directed boundary edge is cut at the grid lines it
crosses; a *piece* lies in one cell and adds its signed area to that cell and its signed height to all cells right of
it (the accumulation of font rasterisers). Cells that hold a piece are *touched*: a bit set marks them, and between two
touched cells of a row the coverage is constant, so prefix sums of the target give the squared error of the span.

Five kernels walk over the touched cells of each row, bit by bit, each with the loop written out. A function that gives
the next touched column would be shorter and give the same, but takes 1.05 times as long (loss and gradient; the normal
equations 1.04; medians over 8 and 32 corners at 64, 128 and 256 pixels a side).

Letters: V vertices, B directed boundary edges, R pixels a side. All positions here are in pixels unless said otherwise.
"""

from typing import NamedTuple

import numpy as np
from numba.cpython.unsafe.numbers import trailing_zeros

from autopoly_env.arrays import BoolArray, FloatArray, IntArray, UIntArray
from autopoly_env.compute import uncounted_kernel


class Workspace(NamedTuple):
    """Scratch arrays, all zero between calls, so that nothing of size R*R is cleared in a call.

    A cell's three numbers lie side by side and rows of cells are padded, for the cache: a steep edge visits one cell a
    row, and rows a power of two apart would share its lines.
    """

    cells: FloatArray  # (R*(R+PADDING), 4) signed AREA inside the cell (later the residual), COVER passed on, 1 + HEAD
    touched: UIntArray  # (R*words,) bit set, 64 columns a word
    pieces: FloatArray  # (P, 4) EDGE, integrals START of (1 - t) and END of t, NEXT piece of the same cell
    sums: FloatArray  # (B, 5) over the pieces of each edge, of what derivatives add up: see `derivative_kernels`


NO_WEIGHTS = np.empty((0, 0))  # where every pixel weighs 1
NO_WEIGHTS.setflags(write=False)


class Picture(NamedTuple):
    """A target as it is compared with a rendering, pixel by pixel: see `autopoly_env.silhouette.Target`."""

    coverage: FloatArray  # (R, R)
    row_sum: FloatArray  # (R, R+1) prefix sums of it along the rows
    row_square_sum: FloatArray  # (R, R+1) the same of its square
    weight_sum: FloatArray = NO_WEIGHTS  # (R, R+1) of the pixels' weights, which the two sums above then count, too


class Pixels(NamedTuple):
    """A target as the IoU counts it: see `autopoly_env.silhouette.Target`."""

    mask: BoolArray  # (R, R)
    mask_sum: FloatArray  # (R, R+1) prefix sums of it along the rows, of the weights if there are any
    weight_sum: FloatArray = NO_WEIGHTS  # (R, R+1)
    by_area: bool = False  # whether a pixel counts by the share of it that is covered, and not as covered by half


AREA, COVER, HEAD = 0, 1, 2  # HEAD is 1 + the cell's first piece, 0 for none
EDGE, START, END, NEXT = 0, 1, 2, 3
PADDING = 8


@uncounted_kernel
def _add_piece(n: int, edge: int, cell: int, t0: float, t1: float, work: Workspace) -> int:
    end = 0.5 * (t1 * t1 - t0 * t0)
    work.pieces[n, EDGE] = edge
    work.pieces[n, START] = (t1 - t0) - end
    work.pieces[n, END] = end
    work.pieces[n, NEXT] = work.cells[cell, HEAD]
    work.cells[cell, HEAD] = n + 1
    return n + 1


@uncounted_kernel
def clear(cell: int, work: Workspace) -> None:
    work.cells[cell, AREA] = 0.0
    work.cells[cell, COVER] = 0.0
    work.cells[cell, HEAD] = 0.0


@uncounted_kernel
def _touch(row: int, column: int, words: int, work: Workspace) -> None:
    work.touched[row * words + (column >> 6)] |= np.uint64(1) << np.uint64(column & 63)


@uncounted_kernel
def _walk_left_of_image(
    y0: float, y1: float, size: int, words: int, work: Workspace, first_row: int, last_row: int
) -> None:
    """Rows y0 to y1 of an edge that runs left of the image: the whole row gets its height."""
    low, high = min(y0, y1), max(y0, y1)
    for row in range(max(first_row, int(np.floor(low))), min(last_row, int(np.ceil(high)))):
        height = min(high, row + 1.0) - max(low, float(row))
        if y1 > y0:
            height = -height
        work.cells[row * (size + PADDING), AREA] += height
        work.cells[row * (size + PADDING), COVER] += height
        _touch(row, 0, words, work)


@uncounted_kernel
def _walk_inside(
    x0: float, y0: float, dx: float, dy: float, t: float, t_stop: float,
    edge: int, size: int, words: int, n: int, work: Workspace, first_row: int, last_row: int,
) -> int:  # fmt: skip
    """Cut the part t..t_stop of an edge, which lies inside the rows, at the grid lines it crosses."""
    step_x = 1 if dx > 0 else -1
    step_y = 1 if dy > 0 else -1
    x, y = x0 + t * dx, y0 + t * dy
    column = int(np.floor(x))
    row = int(np.floor(y))
    if dx < 0 and x == column:
        column -= 1
    if dy < 0 and y == row:
        row -= 1
    column = min(max(column, 0), size - 1)
    row = min(max(row, first_row), last_row - 1)
    per_x = 1.0 / dx if dx != 0.0 else np.inf
    per_y = 1.0 / dy if dy != 0.0 else np.inf
    next_x = (column + (dx > 0) - x0) * per_x if dx != 0.0 else np.inf
    next_y = (row + (dy > 0) - y0) * per_y if dy != 0.0 else np.inf
    while True:
        t_next = min(next_x, next_y, t_stop)
        if t_next > t:
            cell = row * (size + PADDING) + column
            height = -dy * (t_next - t)
            work.cells[cell, AREA] += height * (1.0 - (x0 + 0.5 * (t + t_next) * dx - column))
            work.cells[cell, COVER] += height
            _touch(row, column, words, work)
            n = _add_piece(n, edge, cell, t, t_next, work)
            t = t_next
        if t >= t_stop:
            return n
        if next_x <= next_y:
            column += step_x
            if column < 0 or column >= size:
                return n
            next_x = (column + (dx > 0) - x0) * per_x
        else:
            row += step_y
            if row < first_row or row >= last_row:
                return n
            next_y = (row + (dy > 0) - y0) * per_y


@uncounted_kernel
def _crossing(row: int, y0: float, dy: float, size: int) -> float:
    """Where along an edge the top of a row is: just where `_walk_inside` cuts it, but at the image's borders."""
    return (row - y0) / dy if row == 0 or row == size else (row - y0) * (1.0 / dy)


@uncounted_kernel
def walk_boundary(
    points: FloatArray, edges: IntArray, size: int, work: Workspace, first_row: int, last_row: int
) -> None:
    """Accumulate areas, heights and pieces of all directed boundary edges; `points` (V, 2) in the unit square.

    Only in rows first_row..last_row-1, where the numbers are those of the whole picture but for rounding, and hardly
    ever that; 0 and R for all.
    """
    words = (size + 63) >> 6
    n = 0
    for edge in range(edges.shape[0]):
        x0, y0 = points[edges[edge, 0], 0] * size, points[edges[edge, 0], 1] * size
        x1, y1 = points[edges[edge, 1], 0] * size, points[edges[edge, 1], 1] * size
        dx, dy = x1 - x0, y1 - y0
        if dx == 0.0 and dy == 0.0:
            continue
        t0, t1 = 0.0, 1.0  # the part between the top and the bottom of the rows
        if dy != 0.0:
            ta, tb = _crossing(first_row, y0, dy, size), _crossing(last_row, y0, dy, size)
            t0, t1 = max(t0, min(ta, tb)), min(t1, max(ta, tb))
        elif y0 < first_row or y0 > last_row:
            continue
        if t0 >= t1:
            continue
        ta, tb = t0, t1  # the part between its left and its right border
        if dx != 0.0:
            left, right = -x0 / dx, (size - x0) / dx
            ta, tb = max(t0, min(left, right)), min(t1, max(left, right))
        elif x0 < 0.0:
            ta, tb = t1, t1
        elif x0 > size:
            continue
        ta, tb = min(ta, t1), max(tb, t0)
        if ta > t0 and x0 + 0.5 * (t0 + ta) * dx < 0.0:
            _walk_left_of_image(y0 + t0 * dy, y0 + ta * dy, size, words, work, first_row, last_row)
        if tb > ta:
            n = _walk_inside(x0, y0, dx, dy, ta, tb, edge, size, words, n, work, first_row, last_row)
        if tb < t1 and tb >= ta and x0 + 0.5 * (tb + t1) * dx < 0.0:
            _walk_left_of_image(y0 + tb * dy, y0 + t1 * dy, size, words, work, first_row, last_row)


@uncounted_kernel
def coverage_image(points: FloatArray, edges: IntArray, size: int, work: Workspace, image: FloatArray) -> None:
    """Write the (R, R) coverage, unclamped (2 where faces overlap), into `image`."""
    walk_boundary(points, edges, size, work, 0, size)
    words = (size + 63) >> 6
    for row in range(size):
        total = 0.0
        column = 0
        for word in range(words):
            bits = work.touched[row * words + word]
            work.touched[row * words + word] = 0
            while bits != 0:
                here = word * 64 + int(trailing_zeros(bits))
                bits &= bits - np.uint64(1)
                image[row, column:here] = total
                cell = row * (size + PADDING) + here
                image[row, here] = total + work.cells[cell, AREA]
                total += work.cells[cell, COVER]
                column = here + 1
                clear(cell, work)
        image[row, column:size] = total


@uncounted_kernel
def span_weight(row: int, first: int, last: int, weight_sum: FloatArray) -> float:
    """What the pixels first..last-1 of a row weigh together: each 1, or as `weight_sum` (R, R+1) along rows says."""
    if weight_sum.shape[0] == 0:
        return float(last - first)
    return weight_sum[row, last] - weight_sum[row, first]


@uncounted_kernel
def _share(covered: float, by_area: bool) -> float:
    """What a pixel with this coverage counts."""
    if by_area:
        return min(max(covered, 0.0), 1.0)
    return 1.0 if covered >= 0.5 else 0.0


@uncounted_kernel
def overlap_counts(points: FloatArray, edges: IntArray, pixels: Pixels, work: Workspace) -> tuple[float, float]:
    """Pixels with coverage >= 0.5: (those inside the target mask, all of them); weighed where pixels have weights.

    Where the pixels count by area, the areas that are covered: (inside the target mask, all).
    """
    return overlap_counts_in_rows(points, edges, pixels, work, 0, pixels.mask.shape[0])


@uncounted_kernel
def overlap_counts_in_rows(
    points: FloatArray, edges: IntArray, pixels: Pixels, work: Workspace, first_row: int, last_row: int
) -> tuple[float, float]:
    """`overlap_counts` of rows first_row..last_row-1 alone, at the cost of what lies in them."""
    mask, mask_sum, weight_sum, by_area = pixels
    size = mask.shape[0]
    walk_boundary(points, edges, size, work, first_row, last_row)
    words = (size + 63) >> 6
    inside, filled = 0.0, 0.0
    for row in range(first_row, last_row):
        total = 0.0
        column = 0
        for word in range(words):
            bits = work.touched[row * words + word]
            work.touched[row * words + word] = 0
            while bits != 0:
                here = word * 64 + int(trailing_zeros(bits))
                bits &= bits - np.uint64(1)
                cell = row * (size + PADDING) + here
                share = _share(total, by_area)
                if share > 0.0:
                    filled += share * span_weight(row, column, here, weight_sum)
                    inside += share * (mask_sum[row, here] - mask_sum[row, column])
                share = _share(total + work.cells[cell, AREA], by_area)
                if share > 0.0:
                    weight = share * span_weight(row, here, here + 1, weight_sum)
                    filled += weight
                    if mask[row, here]:
                        inside += weight
                total += work.cells[cell, COVER]
                column = here + 1
                clear(cell, work)
        share = _share(total, by_area)
        if share > 0.0:
            filled += share * span_weight(row, column, size, weight_sum)
            inside += share * (mask_sum[row, size] - mask_sum[row, column])
    return inside, filled


@uncounted_kernel
def coverage_images(
    points: FloatArray, edges: IntArray, point_starts: IntArray, edge_starts: IntArray, first: int, last: int,
    size: int, work: Workspace, images: FloatArray,
) -> None:  # fmt: skip
    """`coverage_image` of meshes first..last of a batch, stored one after the other; edges count from 0 per mesh."""
    for k in range(first, last):
        coverage_image(
            points[point_starts[k] : point_starts[k + 1]],
            edges[edge_starts[k] : edge_starts[k + 1]],
            size,
            work,
            images[k],
        )
