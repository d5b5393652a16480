"""Numba kernels of the exact area-coverage rasteriser: walk the boundary, sum along rows, touch nothing inside.

The coverage of a pixel is the area of the mesh inside it. Each directed boundary edge is cut at the grid lines it
crosses; a *piece* lies in one cell and adds its signed area to that cell and its signed height to all cells right of
it (the accumulation of font rasterisers). Cells that hold a piece are *touched*: a bit set marks them, and between two
touched cells of a row the coverage is constant, so prefix sums of the target give the squared error of the span.

Letters: V vertices, B directed boundary edges, R pixels a side. All positions here are in pixels unless said otherwise.
"""

from typing import NamedTuple

import numpy as np
from numba.cpython.unsafe.numbers import trailing_zeros

from autopoly_env.arrays import BoolArray, FloatArray, IntArray, UIntArray
from autopoly_env.jit import kernel

NO_PIECE = -1


class Workspace(NamedTuple):
    """Scratch arrays, all zero (head: NO_PIECE) between calls, so that nothing of size R*R is cleared in a call."""

    area: FloatArray  # (R*R,) signed area inside the cell; after `residuals`, the residual
    cover: FloatArray  # (R*R,) signed height passed on to the cells on the right
    touched: UIntArray  # (R*words,) bit set, 64 columns a word
    head: IntArray  # (R*R,) first piece of the cell, or NO_PIECE
    piece_edge: IntArray  # (P,) boundary edge of the piece
    piece_next: IntArray  # (P,) next piece of the same cell, or NO_PIECE
    piece_start: FloatArray  # (P,) integral of (1 - t) over the piece
    piece_end: FloatArray  # (P,) integral of t over the piece


@kernel
def _add_piece(n: int, edge: int, cell: int, t0: float, t1: float, work: Workspace) -> int:
    end = 0.5 * (t1 * t1 - t0 * t0)
    work.piece_edge[n] = edge
    work.piece_start[n] = (t1 - t0) - end
    work.piece_end[n] = end
    work.piece_next[n] = work.head[cell]
    work.head[cell] = n
    return n + 1


@kernel
def _touch(row: int, column: int, words: int, work: Workspace) -> None:
    work.touched[row * words + (column >> 6)] |= np.uint64(1) << np.uint64(column & 63)


@kernel
def _walk_left_of_image(y0: float, y1: float, size: int, words: int, work: Workspace) -> None:
    """Rows y0 to y1 of an edge that runs left of the image: the whole row gets its height."""
    low, high = min(y0, y1), max(y0, y1)
    for row in range(max(0, int(np.floor(low))), min(size, int(np.ceil(high)))):
        height = min(high, row + 1.0) - max(low, float(row))
        if y1 > y0:
            height = -height
        work.area[row * size] += height
        work.cover[row * size] += height
        _touch(row, 0, words, work)


@kernel
def _walk_inside(
    x0: float, y0: float, dx: float, dy: float, t: float, t_stop: float,
    edge: int, size: int, words: int, n: int, work: Workspace,
) -> int:  # fmt: skip
    """Cut the part t..t_stop of an edge, which lies inside the image, at the grid lines it crosses."""
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
    row = min(max(row, 0), size - 1)
    next_x = (column + (dx > 0) - x0) / dx if dx != 0.0 else np.inf
    next_y = (row + (dy > 0) - y0) / dy if dy != 0.0 else np.inf
    while True:
        t_next = min(next_x, next_y, t_stop)
        if t_next > t:
            cell = row * size + column
            height = -dy * (t_next - t)
            work.area[cell] += height * (1.0 - (x0 + 0.5 * (t + t_next) * dx - column))
            work.cover[cell] += height
            _touch(row, column, words, work)
            n = _add_piece(n, edge, cell, t, t_next, work)
            t = t_next
        if t >= t_stop:
            return n
        if next_x <= next_y:
            column += step_x
            if column < 0 or column >= size:
                return n
            next_x = (column + (dx > 0) - x0) / dx
        else:
            row += step_y
            if row < 0 or row >= size:
                return n
            next_y = (row + (dy > 0) - y0) / dy


@kernel
def walk_boundary(points: FloatArray, edges: IntArray, size: int, work: Workspace) -> None:
    """Accumulate areas, heights and pieces of all directed boundary edges; `points` (V, 2) in the unit square."""
    words = (size + 63) >> 6
    n = 0
    for edge in range(edges.shape[0]):
        x0, y0 = points[edges[edge, 0], 0] * size, points[edges[edge, 0], 1] * size
        x1, y1 = points[edges[edge, 1], 0] * size, points[edges[edge, 1], 1] * size
        dx, dy = x1 - x0, y1 - y0
        if dx == 0.0 and dy == 0.0:
            continue
        t0, t1 = 0.0, 1.0  # the part between the top and the bottom of the image
        if dy != 0.0:
            ta, tb = -y0 / dy, (size - y0) / dy
            t0, t1 = max(t0, min(ta, tb)), min(t1, max(ta, tb))
        elif y0 < 0.0 or y0 > size:
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
            _walk_left_of_image(y0 + t0 * dy, y0 + ta * dy, size, words, work)
        if tb > ta:
            n = _walk_inside(x0, y0, dx, dy, ta, tb, edge, size, words, n, work)
        if tb < t1 and tb >= ta and x0 + 0.5 * (tb + t1) * dx < 0.0:
            _walk_left_of_image(y0 + tb * dy, y0 + t1 * dy, size, words, work)


@kernel
def coverage_image(points: FloatArray, edges: IntArray, size: int, work: Workspace, image: FloatArray) -> None:
    """Write the (R, R) coverage, unclamped (2 where faces overlap), into `image`."""
    walk_boundary(points, edges, size, work)
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
                cell = row * size + here
                image[row, here] = total + work.area[cell]
                total += work.cover[cell]
                column = here + 1
                work.area[cell] = 0.0
                work.cover[cell] = 0.0
                work.head[cell] = NO_PIECE
        image[row, column:size] = total


@kernel
def residuals(
    size: int, coverage: FloatArray, row_sum: FloatArray, row_square_sum: FloatArray, work: Workspace
) -> float:
    """After `walk_boundary`: leave rendering - target in `area` of the touched cells; return the sum of squares.

    `coverage` (R, R) is the target, `row_sum` and `row_square_sum` (R, R+1) prefix sums of it and of its square.
    """
    words = (size + 63) >> 6
    loss = 0.0
    for row in range(size):
        total = 0.0
        column = 0
        for word in range(words):
            bits = work.touched[row * words + word]
            while bits != 0:
                here = word * 64 + int(trailing_zeros(bits))
                bits &= bits - np.uint64(1)
                cell = row * size + here
                loss += (
                    total * total * (here - column)
                    - 2.0 * total * (row_sum[row, here] - row_sum[row, column])
                    + (row_square_sum[row, here] - row_square_sum[row, column])
                )
                residual = total + work.area[cell] - coverage[row, here]
                total += work.cover[cell]
                work.area[cell] = residual
                loss += residual * residual
                column = here + 1
        loss += (
            total * total * (size - column)
            - 2.0 * total * (row_sum[row, size] - row_sum[row, column])
            + (row_square_sum[row, size] - row_square_sum[row, column])
        )
    return loss if not loss < 0.0 else 0.0  # differences of prefix sums may round to less than nothing


@kernel
def gather_gradient(points: FloatArray, edges: IntArray, size: int, work: Workspace, gradient: FloatArray) -> None:
    """Add sum over touched cells of residual * d coverage / d position (per pixel) to `gradient` (V, 2); clear `work`.

    Half the gradient of the sum of squares after `residuals`; the vector-Jacobian product for any other `area`.
    """
    words = (size + 63) >> 6
    for row in range(size):
        for word in range(words):
            bits = work.touched[row * words + word]
            work.touched[row * words + word] = 0
            while bits != 0:
                cell = row * size + word * 64 + int(trailing_zeros(bits))
                bits &= bits - np.uint64(1)
                residual = work.area[cell]
                piece = work.head[cell]
                while piece != NO_PIECE:
                    i, j = edges[work.piece_edge[piece], 0], edges[work.piece_edge[piece], 1]
                    along_x = residual * (points[j, 1] - points[i, 1]) * size
                    along_y = residual * (points[i, 0] - points[j, 0]) * size
                    gradient[i, 0] += work.piece_start[piece] * along_x
                    gradient[i, 1] += work.piece_start[piece] * along_y
                    gradient[j, 0] += work.piece_end[piece] * along_x
                    gradient[j, 1] += work.piece_end[piece] * along_y
                    piece = work.piece_next[piece]
                work.area[cell] = 0.0
                work.cover[cell] = 0.0
                work.head[cell] = NO_PIECE


@kernel
def gather_normal_equations(
    points: FloatArray, edges: IntArray, size: int, work: Workspace, gradient: FloatArray, normal: FloatArray
) -> None:
    """As `gather_gradient`, and add the lower triangle of J'J (2V, 2V) to `normal`: unknown 2v is x, 2v+1 is y of v."""
    words = (size + 63) >> 6
    n_points = points.shape[0]
    vertices = np.empty(n_points, np.int64)
    rows = np.empty((n_points, 2))
    for row in range(size):
        for word in range(words):
            bits = work.touched[row * words + word]
            work.touched[row * words + word] = 0
            while bits != 0:
                cell = row * size + word * 64 + int(trailing_zeros(bits))
                bits &= bits - np.uint64(1)
                m = _cell_jacobian(points, edges, size, cell, work, vertices, rows)
                residual = work.area[cell]
                for a in range(m):
                    u = 2 * vertices[a]
                    jx, jy = rows[a, 0], rows[a, 1]
                    gradient[vertices[a], 0] += residual * jx
                    gradient[vertices[a], 1] += residual * jy
                    normal[u, u] += jx * jx
                    normal[u + 1, u] += jy * jx
                    normal[u + 1, u + 1] += jy * jy
                    for b in range(a):
                        v = 2 * vertices[b]
                        kx, ky = rows[b, 0], rows[b, 1]
                        if v < u:
                            normal[u, v] += jx * kx
                            normal[u, v + 1] += jx * ky
                            normal[u + 1, v] += jy * kx
                            normal[u + 1, v + 1] += jy * ky
                        else:
                            normal[v, u] += kx * jx
                            normal[v, u + 1] += kx * jy
                            normal[v + 1, u] += ky * jx
                            normal[v + 1, u + 1] += ky * jy
                work.area[cell] = 0.0
                work.cover[cell] = 0.0
                work.head[cell] = NO_PIECE


@kernel
def _cell_jacobian(
    points: FloatArray, edges: IntArray, size: int, cell: int, work: Workspace, vertices: IntArray, rows: FloatArray
) -> int:
    """List the vertices that move the coverage of one cell, with d coverage / d (x, y); return how many they are."""
    m = 0
    piece = work.head[cell]
    while piece != NO_PIECE:
        i, j = edges[work.piece_edge[piece], 0], edges[work.piece_edge[piece], 1]
        normal_x = (points[j, 1] - points[i, 1]) * size
        normal_y = (points[i, 0] - points[j, 0]) * size
        for vertex, weight in ((i, work.piece_start[piece]), (j, work.piece_end[piece])):
            at = 0
            while at < m and vertices[at] != vertex:
                at += 1
            if at == m:
                vertices[m] = vertex
                rows[m, 0] = 0.0
                rows[m, 1] = 0.0
                m += 1
            rows[at, 0] += weight * normal_x
            rows[at, 1] += weight * normal_y
        piece = work.piece_next[piece]
    return m


@kernel
def loss_and_gradient(
    points: FloatArray, edges: IntArray, size: int, coverage: FloatArray, row_sum: FloatArray,
    row_square_sum: FloatArray, work: Workspace, gradient: FloatArray,
) -> float:  # fmt: skip
    """Sum of squared coverage errors; its gradient with respect to unit-square positions goes into `gradient`."""
    walk_boundary(points, edges, size, work)
    loss = residuals(size, coverage, row_sum, row_square_sum, work)
    gradient[:] = 0.0
    gather_gradient(points, edges, size, work, gradient)
    for v in range(gradient.shape[0]):
        gradient[v, 0] *= 2.0 * size
        gradient[v, 1] *= 2.0 * size
    return loss


@kernel
def vector_jacobian(
    points: FloatArray, edges: IntArray, size: int, cotangent: FloatArray, work: Workspace, gradient: FloatArray
) -> None:
    """Write sum over pixels of cotangent (R, R) * d coverage / d position (unit square) into `gradient` (V, 2)."""
    walk_boundary(points, edges, size, work)
    words = (size + 63) >> 6
    for row in range(size):
        for word in range(words):
            bits = work.touched[row * words + word]
            while bits != 0:
                column = word * 64 + int(trailing_zeros(bits))
                bits &= bits - np.uint64(1)
                work.area[row * size + column] = cotangent[row, column]
    gradient[:] = 0.0
    gather_gradient(points, edges, size, work, gradient)
    for v in range(gradient.shape[0]):
        gradient[v, 0] *= size
        gradient[v, 1] *= size


@kernel
def overlap_counts(
    points: FloatArray, edges: IntArray, size: int, mask: BoolArray, mask_sum: IntArray, work: Workspace
) -> tuple[int, int]:
    """Pixels with coverage >= 0.5: (those inside the target mask, all of them). `mask_sum` (R, R+1) along rows."""
    walk_boundary(points, edges, size, work)
    words = (size + 63) >> 6
    inside, filled = 0, 0
    for row in range(size):
        total = 0.0
        column = 0
        for word in range(words):
            bits = work.touched[row * words + word]
            work.touched[row * words + word] = 0
            while bits != 0:
                here = word * 64 + int(trailing_zeros(bits))
                bits &= bits - np.uint64(1)
                cell = row * size + here
                if total >= 0.5:
                    filled += here - column
                    inside += mask_sum[row, here] - mask_sum[row, column]
                if total + work.area[cell] >= 0.5:
                    filled += 1
                    inside += mask[row, here]
                total += work.cover[cell]
                column = here + 1
                work.area[cell] = 0.0
                work.cover[cell] = 0.0
                work.head[cell] = NO_PIECE
        if total >= 0.5:
            filled += size - column
            inside += mask_sum[row, size] - mask_sum[row, column]
    return inside, filled


@kernel
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


@kernel
def losses_and_gradients(
    points: FloatArray, edges: IntArray, point_starts: IntArray, edge_starts: IntArray, first: int, last: int,
    coverage: FloatArray, row_sum: FloatArray, row_square_sum: FloatArray, work: Workspace,
    losses: FloatArray, gradients: FloatArray,
) -> None:  # fmt: skip
    """`loss_and_gradient` of meshes first..last of a batch, all against one target."""
    size = coverage.shape[0]
    for k in range(first, last):
        losses[k] = loss_and_gradient(
            points[point_starts[k] : point_starts[k + 1]],
            edges[edge_starts[k] : edge_starts[k + 1]],
            size,
            coverage,
            row_sum,
            row_square_sum,
            work,
            gradients[point_starts[k] : point_starts[k + 1]],
        )


@kernel
def vector_jacobians(
    points: FloatArray, edges: IntArray, point_starts: IntArray, edge_starts: IntArray, first: int, last: int,
    cotangents: FloatArray, work: Workspace, gradients: FloatArray,
) -> None:  # fmt: skip
    """`vector_jacobian` of meshes first..last of a batch, each with its own cotangent image."""
    for k in range(first, last):
        vector_jacobian(
            points[point_starts[k] : point_starts[k + 1]],
            edges[edge_starts[k] : edge_starts[k + 1]],
            cotangents.shape[1],
            cotangents[k],
            work,
            gradients[point_starts[k] : point_starts[k + 1]],
        )
