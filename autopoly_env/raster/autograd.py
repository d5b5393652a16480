"""The exact rasteriser as a batched `torch.autograd.Function`, for networks and for plain gradient descent.

Letters: N shapes of a batch, V vertices, B directed boundary edges, R pixels a side.
"""

from typing import Any

import numpy as np
import torch

from autopoly_env.arrays import FloatArray
from autopoly_env.errors import ConfigError
from autopoly_env.raster.rasteriser import Batch, coverage_of_batch, coverage_vjp


class _Coverage(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, vertices: torch.Tensor, edges: torch.Tensor, resolution: int) -> torch.Tensor:
        batch = _batch(vertices, edges)
        ctx.batch, ctx.shape = batch, vertices.shape
        images = torch.from_numpy(coverage_of_batch(batch, resolution))
        return images.to(device=vertices.device, dtype=vertices.dtype)

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx: Any, cotangents: torch.Tensor) -> tuple[torch.Tensor, None, None]:
        gradients = torch.from_numpy(coverage_vjp(ctx.batch, _float64(cotangents))).reshape(ctx.shape)
        return gradients.to(device=cotangents.device, dtype=cotangents.dtype), None, None


def coverage(vertices: torch.Tensor, edges: torch.Tensor, resolution: int) -> torch.Tensor:
    """Area of each shape inside each pixel, differentiable with respect to the vertices: (N, R, R).

    `vertices` (N, V, 2), unit square, any floating dtype and device (the work is done in float64 on the CPU);
    `edges` (B, 2) or (N, B, 2) integers: the directed boundary edges, which form closed loops; rows of -1 pad
    shapes that have fewer. Raises ConfigError for other shapes. First derivatives only.
    """
    if vertices.ndim != 3 or vertices.shape[-1] != 2 or not vertices.is_floating_point():
        raise ConfigError(f"vertices {tuple(vertices.shape)} {vertices.dtype}: expected (N, V, 2) floating point")
    if edges.ndim not in (2, 3) or edges.shape[-1] != 2 or (edges.ndim == 3 and len(edges) != len(vertices)):
        raise ConfigError(f"edges {tuple(edges.shape)}: expected (B, 2) or (N, B, 2) with N = {len(vertices)}")
    if edges.is_floating_point():
        raise ConfigError(f"edges {edges.dtype}: expected integers, the indices of the vertices")
    if not 1 <= resolution <= 16384:
        raise ConfigError(f"resolution {resolution}: expected 1 to 16384 pixels a side")
    if edges.numel() and int(edges.max()) >= vertices.shape[1]:
        raise ConfigError(f"edges name vertex {int(edges.max())}, but there are {vertices.shape[1]} vertices")
    return _Coverage.apply(vertices, edges, resolution)


def _batch(vertices: torch.Tensor, edges: torch.Tensor) -> Batch:
    n, v, _ = vertices.shape
    points = _float64(vertices).reshape(-1, 2)
    rows = np.ascontiguousarray(edges.detach().cpu().numpy(), dtype=np.int64)
    rows = np.broadcast_to(rows, (n, *rows.shape[-2:]))
    real = (rows >= 0).all(axis=-1)
    edge_starts = np.concatenate([[0], np.cumsum(real.sum(axis=1))]).astype(np.int64)
    return Batch(points, np.ascontiguousarray(rows[real]), np.arange(n + 1, dtype=np.int64) * v, edge_starts)


def _float64(tensor: torch.Tensor) -> FloatArray:
    """A contiguous copy, which later changes of the tensor do not reach; NumPy itself has no bfloat16."""
    return tensor.detach().to("cpu", torch.float64, copy=True).contiguous().numpy()
