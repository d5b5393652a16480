"""Exact area coverage of meshes on a pixel grid, and its exact derivatives; `raster.autograd` has them for torch."""

from autopoly_env.raster.rasteriser import (
    Batch,
    batch_of,
    coverage,
    coverage_many,
    coverage_of_batch,
    coverage_vjp,
    loss_and_gradient,
    loss_and_gradient_many,
    picture_of,
    pixels_of,
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
    "picture_of",
    "pixels_of",
    "workspace",
]
