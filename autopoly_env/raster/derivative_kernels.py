"""Numba kernels of the rasteriser's derivatives: losses with gradients, normal equations, vector-Jacobian products.

Only touched cells depend on the vertices; the rest of a row is constant spans, whose squared error prefix sums of the
target give. Letters and units as in `raster_kernels`.

Along one edge all pieces have the same normal. So what they add to a gradient or to J'J is summed up as numbers first,
edge by edge (`Workspace.sums`), and turned into vectors and blocks once per edge.

Pixels may have weights, which the prefix sums of a `Picture` then count. Without (`NO_WEIGHTS`) every pixel weighs 1.
"""

import numpy as np
from numba.cpython.unsafe.numbers import trailing_zeros

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.compute import uncounted_kernel
from autopoly_env.raster.raster_kernels import (
    AREA,
    COVER,
    EDGE,
    END,
    HEAD,
    NEXT,
    PADDING,
    START,
    Picture,
    Workspace,
    clear,
    span_weight,
    walk_boundary,
)

AT_START, AT_END, START_START, START_END, END_END = 0, 1, 2, 3, 4  # of `Workspace.sums`


@uncounted_kernel
def half_gradient(
    points: FloatArray, edges: IntArray, picture: Picture, work: Workspace, gradient: FloatArray
) -> float:  # fmt: skip
    """Return the sum over pixels of (coverage - target)**2; half its gradient per pixel goes into `gradient` (V, 2)."""
    loss = _sum_residuals(points, edges, picture, work, False)
    gradient[:] = 0.0
    _empty_sums(points, edges, picture.coverage.shape[0], work, gradient)
    return loss


@uncounted_kernel
def _sum_residuals(points: FloatArray, edges: IntArray, picture: Picture, work: Workspace, squares: bool) -> float:
    """Return the loss; leave what derivatives need in `work.sums`, with `squares` what J'J needs, too."""
    size = picture.coverage.shape[0]
    walk_boundary(points, edges, size, work, 0, size)
    words = (size + 63) >> 6
    loss = 0.0
    for row in range(size):
        total = 0.0
        column = 0
        for word in range(words):
            bits = work.touched[row * words + word]
            work.touched[row * words + word] = 0
            while bits != 0:
                here = word * 64 + int(trailing_zeros(bits))
                bits &= bits - np.uint64(1)
                cell = row * (size + PADDING) + here
                if here > column:
                    loss += _span_loss(total, row, column, here, picture)
                residual = total + work.cells[cell, AREA] - picture.coverage[row, here]
                total += work.cells[cell, COVER]
                pull = _weighed(residual, row, here, picture.weight_sum)
                loss += residual * pull
                _pull(cell, pull, work)
                if squares:
                    _sum_squares(cell, _weighed(1.0, row, here, picture.weight_sum), work)
                clear(cell, work)
                column = here + 1
        loss += _span_loss(total, row, column, size, picture)
    return loss if not loss < 0.0 else 0.0  # differences of prefix sums may round to less than nothing


@uncounted_kernel
def _weighed(residual: float, row: int, column: int, weight_sum: FloatArray) -> float:
    """The residual of a pixel times its weight."""
    if weight_sum.shape[0] == 0:
        return residual
    return residual * (weight_sum[row, column + 1] - weight_sum[row, column])


@uncounted_kernel
def _span_loss(total: float, row: int, first: int, last: int, picture: Picture) -> float:
    """Squared error of the untouched pixels first..last-1 of a row, which the mesh covers `total` times."""
    return (
        total * total * span_weight(row, first, last, picture.weight_sum)
        - 2.0 * total * (picture.row_sum[row, last] - picture.row_sum[row, first])
        + (picture.row_square_sum[row, last] - picture.row_square_sum[row, first])
    )


@uncounted_kernel
def _pull(cell: int, residual: float, work: Workspace) -> None:
    """Add residual * integrals of (1 - t) and t of one cell's pieces to the sums of their edges."""
    piece = int(work.cells[cell, HEAD]) - 1
    while piece >= 0:
        edge = int(work.pieces[piece, EDGE])
        work.sums[edge, AT_START] += residual * work.pieces[piece, START]
        work.sums[edge, AT_END] += residual * work.pieces[piece, END]
        piece = int(work.pieces[piece, NEXT]) - 1


@uncounted_kernel
def _empty_sums(points: FloatArray, edges: IntArray, size: int, work: Workspace, gradient: FloatArray) -> None:
    """Add what `_pull` summed up to `gradient` (V, 2), per pixel, and leave the sums at zero."""
    for edge in range(edges.shape[0]):
        i, j = edges[edge, 0], edges[edge, 1]
        normal_x = (points[j, 1] - points[i, 1]) * size
        normal_y = (points[i, 0] - points[j, 0]) * size
        at_start, at_end = work.sums[edge, AT_START], work.sums[edge, AT_END]
        gradient[i, 0] += at_start * normal_x
        gradient[i, 1] += at_start * normal_y
        gradient[j, 0] += at_end * normal_x
        gradient[j, 1] += at_end * normal_y
        work.sums[edge, AT_START] = work.sums[edge, AT_END] = 0.0


@uncounted_kernel
def loss_and_gradient(
    points: FloatArray, edges: IntArray, picture: Picture, work: Workspace, gradient: FloatArray
) -> float:  # fmt: skip
    """Sum of squared coverage errors; its gradient with respect to unit-square positions goes into `gradient`."""
    loss = half_gradient(points, edges, picture, work, gradient)
    size = picture.coverage.shape[0]
    for v in range(gradient.shape[0]):
        gradient[v, 0] *= 2.0 * size
        gradient[v, 1] *= 2.0 * size
    return loss


@uncounted_kernel
def normal_equations(
    points: FloatArray, edges: IntArray, picture: Picture, work: Workspace, gradient: FloatArray, normal: FloatArray
) -> float:
    """As `half_gradient`, and write the lower triangle of the sum over edges of J'WJ (2V, 2V), J by one edge alone.

    Unknown 2v is x of vertex v, 2v+1 its y. In pixels that several edges cross this is not all of J'WJ, but it joins
    neighbours only, so that it is solved in no time however many vertices there are.
    """
    loss = _sum_residuals(points, edges, picture, work, True)
    gradient[:] = 0.0
    normal[:] = 0.0
    _empty_squares(points, edges, picture.coverage.shape[0], work, normal)
    _empty_sums(points, edges, picture.coverage.shape[0], work, gradient)
    return loss


@uncounted_kernel
def _sum_squares(cell: int, weight: float, work: Workspace) -> None:
    """Add the products of each piece's two integrals to the sums of its edge."""
    piece = int(work.cells[cell, HEAD]) - 1
    while piece >= 0:
        edge = int(work.pieces[piece, EDGE])
        start, end = work.pieces[piece, START], work.pieces[piece, END]
        work.sums[edge, START_START] += weight * start * start
        work.sums[edge, START_END] += weight * start * end
        work.sums[edge, END_END] += weight * end * end
        piece = int(work.pieces[piece, NEXT]) - 1


@uncounted_kernel
def _empty_squares(points: FloatArray, edges: IntArray, size: int, work: Workspace, normal: FloatArray) -> None:
    """Add what `_sum_squares` summed up to the lower triangle of J'WJ (2V, 2V), and leave the sums at zero."""
    for edge in range(edges.shape[0]):
        i, j = edges[edge, 0], edges[edge, 1]
        x = (points[j, 1] - points[i, 1]) * size
        y = (points[i, 0] - points[j, 0]) * size
        for vertex, kind in ((i, START_START), (j, END_END)):
            normal[2 * vertex, 2 * vertex] += work.sums[edge, kind] * x * x
            normal[2 * vertex + 1, 2 * vertex] += work.sums[edge, kind] * x * y
            normal[2 * vertex + 1, 2 * vertex + 1] += work.sums[edge, kind] * y * y
        u, v, both = 2 * max(i, j), 2 * min(i, j), work.sums[edge, START_END]
        normal[u, v] += both * x * x
        normal[u, v + 1] += both * x * y
        normal[u + 1, v] += both * x * y
        normal[u + 1, v + 1] += both * y * y
        work.sums[edge, START_START] = work.sums[edge, START_END] = work.sums[edge, END_END] = 0.0


@uncounted_kernel
def vector_jacobian(
    points: FloatArray, edges: IntArray, size: int, cotangent: FloatArray, work: Workspace, gradient: FloatArray
) -> None:
    """Write sum over pixels of cotangent (R, R) * d coverage / d position (unit square) into `gradient` (V, 2)."""
    walk_boundary(points, edges, size, work, 0, size)
    words = (size + 63) >> 6
    gradient[:] = 0.0
    for row in range(size):
        for word in range(words):
            bits = work.touched[row * words + word]
            work.touched[row * words + word] = 0
            while bits != 0:
                column = word * 64 + int(trailing_zeros(bits))
                bits &= bits - np.uint64(1)
                cell = row * (size + PADDING) + column
                _pull(cell, cotangent[row, column] * size, work)
                clear(cell, work)
    _empty_sums(points, edges, size, work, gradient)


@uncounted_kernel
def losses_and_gradients(
    points: FloatArray, edges: IntArray, point_starts: IntArray, edge_starts: IntArray, first: int, last: int,
    picture: Picture, work: Workspace, losses: FloatArray, gradients: FloatArray,
) -> None:  # fmt: skip
    """`loss_and_gradient` of meshes first..last of a batch, all against one target."""
    for k in range(first, last):
        losses[k] = loss_and_gradient(
            points[point_starts[k] : point_starts[k + 1]],
            edges[edge_starts[k] : edge_starts[k + 1]],
            picture,
            work,
            gradients[point_starts[k] : point_starts[k + 1]],
        )


@uncounted_kernel
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
