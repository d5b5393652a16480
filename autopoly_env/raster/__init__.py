"""Exact area coverage of meshes on a pixel grid, and its exact derivatives."""

from autopoly_env.raster.autograd import coverage
from autopoly_env.raster.derivative_kernels import loss_and_gradient
from autopoly_env.raster.rasteriser import (
    Batch,
    batch_of,
    coverage_many,
    coverage_of_batch,
    coverage_vjp,
    loss_and_gradient_many,
    workspace,
)

__all__ = [
    "Batch",
    "batch_of",
    "coverage",
    "coverage_many",
    "coverage_of_batch",
    "coverage_vjp",
    "loss_and_gradient",
    "loss_and_gradient_many",
    "workspace",
]
