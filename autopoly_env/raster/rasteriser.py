"""Exact area coverage of a mesh on a pixel grid, and its exact derivatives.

Letters: V vertices, B directed boundary edges, R pixels a side, N meshes of a batch. Positions are in the unit square
(x right, y down); a coverage of 1 is a pixel that lies inside the mesh, and where faces overlap it counts them all.
The method is the signed-area accumulation of font rasterisers; the derivative of a pixel's area with respect to the
boundary is the boundary's normal speed, integrated over the part of it that lies in the pixel.
"""

import threading
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.compute import map_threads, n_threads
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh
from autopoly_env.raster import derivative_kernels, raster_kernels
from autopoly_env.raster.raster_kernels import Picture, Pixels, Workspace
from autopoly_env.silhouette import Target

_local = threading.local()
_SERIAL_PIECES = 50_000  # about so many pieces of boundary take as long as it takes to hand work to threads


def workspace(resolution: int, n_edges: int) -> Workspace:
    """Scratch arrays of this thread, large enough for B = `n_edges` boundary edges on an R = `resolution` grid."""
    cells, pieces = resolution * (resolution + raster_kernels.PADDING), n_edges * (2 * resolution + 4)
    held: Workspace | None = getattr(_local, "workspace", None)
    if held is not None and len(held.cells) >= cells and len(held.pieces) >= pieces and len(held.sums) >= n_edges:
        return held
    if held is not None:
        cells, pieces = max(cells, len(held.cells)), max(pieces, len(held.pieces))
    words = cells // 64 + int(np.sqrt(cells)) + 1  # a last word for each row
    sums = max(n_edges, 0 if held is None else len(held.sums))
    _local.workspace = Workspace(
        np.zeros((cells, 4)), np.zeros(words, np.uint64), np.zeros((pieces, 4)), np.zeros((sums, 5))
    )
    return _local.workspace


def _check_resolution(resolution: int) -> None:
    if not 1 <= resolution <= 16384:
        raise ConfigError(f"resolution {resolution}: expected 1 to 16384 pixels a side")


def coverage(mesh: PolyMesh, resolution: int) -> FloatArray:
    """Area of the mesh inside each pixel, as a fraction of the pixel: (R, R) float64.

    >>> coverage(PolyMesh.rectangle(0.0, 0.0, 0.75, 1.0), 2)
    array([[1. , 0.5],
           [1. , 0.5]])
    """
    _check_resolution(resolution)
    edges = mesh.topology.boundary_half_edges
    image = np.empty((resolution, resolution))
    raster_kernels.coverage_image(mesh.vertices, edges, resolution, workspace(resolution, len(edges)), image)
    return image


def picture_of(target: Target) -> Picture:
    """The target as the kernels of derivatives read it."""
    return Picture(target.coverage, target.row_sum, target.row_square_sum, _weight_sum(target))


def pixels_of(target: Target) -> Pixels:
    """The target as the kernels that count pixels read it."""
    return Pixels(target.mask, target.mask_sum, _weight_sum(target), target.by_area)


def _weight_sum(target: Target) -> FloatArray:
    return raster_kernels.NO_WEIGHTS if target.weight_sum is None else target.weight_sum


def loss_and_gradient(mesh: PolyMesh, target: Target) -> tuple[float, FloatArray]:
    """Sum over pixels of (coverage - target)**2, and its gradient (V, 2) with respect to the vertex positions.

    Where the target has weights, each pixel counts by its own.
    Only pixels on the boundary are visited, so the cost grows with R, not with R**2.
    """
    edges = mesh.topology.boundary_half_edges
    gradient = np.empty_like(mesh.vertices)
    loss = derivative_kernels.loss_and_gradient(
        mesh.vertices,
        edges,
        picture_of(target),
        workspace(target.resolution, len(edges)),
        gradient,
    )
    return loss, gradient


class Batch(NamedTuple):
    """N sets of closed loops, one after the other; the edges of each count its own points from 0."""

    points: FloatArray  # (sum of V, 2)
    edges: IntArray  # (sum of B, 2)
    point_starts: IntArray  # (N+1,)
    edge_starts: IntArray  # (N+1,)

    def __len__(self) -> int:
        return len(self.point_starts) - 1


def batch_of(meshes: Sequence[PolyMesh]) -> Batch:
    """The boundaries of N >= 1 meshes as one `Batch`."""
    edges = [mesh.topology.boundary_half_edges for mesh in meshes]
    point_starts = np.zeros(len(meshes) + 1, np.int64)
    edge_starts = np.zeros(len(meshes) + 1, np.int64)
    np.cumsum([len(mesh.vertices) for mesh in meshes], out=point_starts[1:])
    np.cumsum([len(e) for e in edges], out=edge_starts[1:])
    return Batch(np.concatenate([m.vertices for m in meshes]), np.concatenate(edges), point_starts, edge_starts)


def coverage_many(meshes: Sequence[PolyMesh], resolution: int) -> FloatArray:
    """`coverage` of N meshes in one call, on all cores when it pays: (N, R, R)."""
    _check_resolution(resolution)
    if not meshes:
        return np.empty((0, resolution, resolution))
    return coverage_of_batch(batch_of(meshes), resolution)


def coverage_of_batch(batch: Batch, resolution: int) -> FloatArray:
    """As `coverage_many`, for loops that need not belong to a mesh."""
    images = np.empty((len(batch), resolution, resolution))

    def render(first: int, last: int) -> None:
        work = workspace(resolution, _most_edges(batch))
        raster_kernels.coverage_images(*batch, first, last, resolution, work, images)

    _for_each_part(render, batch, resolution)
    return images


def loss_and_gradient_many(meshes: Sequence[PolyMesh], target: Target) -> tuple[FloatArray, list[FloatArray]]:
    """`loss_and_gradient` of N meshes in one call, on all cores when it pays: losses (N,) and N gradients (V, 2)."""
    if not meshes:
        return np.empty(0), []
    batch = batch_of(meshes)
    losses, gradients = np.empty(len(batch)), np.empty_like(batch.points)
    picture = picture_of(target)

    def evaluate(first: int, last: int) -> None:
        work = workspace(target.resolution, _most_edges(batch))
        derivative_kernels.losses_and_gradients(*batch, first, last, picture, work, losses, gradients)

    _for_each_part(evaluate, batch, target.resolution)
    starts = batch.point_starts.tolist()
    return losses, [gradients[a:b] for a, b in pairwise(starts)]


def coverage_vjp(batch: Batch, cotangents: FloatArray) -> FloatArray:
    """Vector-Jacobian product of `coverage_of_batch`: cotangents (N, R, R) to gradients like `batch.points`."""
    gradients = np.empty_like(batch.points)

    def pull_back(first: int, last: int) -> None:
        work = workspace(cotangents.shape[1], _most_edges(batch))
        derivative_kernels.vector_jacobians(*batch, first, last, cotangents, work, gradients)

    _for_each_part(pull_back, batch, cotangents.shape[1])
    return gradients


def _most_edges(batch: Batch) -> int:
    return int(np.diff(batch.edge_starts).max(initial=0))


def _for_each_part(work: Callable[[int, int], None], batch: Batch, resolution: int) -> None:
    """Call `work(first, last)` for parts of the batch that together are all of it, in threads when it pays."""
    n = len(batch)
    pieces = n * 4 * resolution + 8 * len(batch.edges)
    n_parts = 1 if pieces < _SERIAL_PIECES else min(n, 4 * n_threads())
    cuts = [n * k // n_parts for k in range(n_parts + 1)]
    if n_parts == 1:
        work(0, n)
    else:
        map_threads(lambda k: work(cuts[k], cuts[k + 1]), range(n_parts))
