"""Thin-plate splines, the bilinear sampler, and the transport of points by a warped grid of triangles.

Letters: B batch, N control points (of an M x M grid row by row), Q points, S pixels a side. Positions are in the unit
square, x right, y down. The spline is Bookstein's (1989): of all maps that take the control points where they belong it
bends least; an affine map it reproduces exactly.
"""

import torch
from torch import Tensor
from torch.nn import functional

_RIDGE = 1e-6  # keeps the spline's matrix regular where control points fall together


def control_grid(m: int) -> Tensor:
    """(M*M, 2) the control points at rest: an even grid over the unit square, row by row."""
    steps = torch.linspace(0.0, 1.0, m)
    y, x = torch.meshgrid(steps, steps, indexing="ij")
    return torch.stack((x, y), -1).reshape(-1, 2)


def pixel_centres(size: int) -> Tensor:
    """(S*S, 2) row by row."""
    steps = (torch.arange(size) + 0.5) / size
    y, x = torch.meshgrid(steps, steps, indexing="ij")
    return torch.stack((x, y), -1).reshape(-1, 2)


def fit_spline(sources: Tensor, goals: Tensor) -> Tensor:
    """Coefficients (B, N+3, 2) of the spline that takes `sources` (B, N, 2) to `goals` (B, N, 2)."""
    n_batch, n, _ = sources.shape
    border = torch.cat((torch.ones_like(sources[..., :1]), sources), -1)
    kernel = _bending(sources, sources) + _RIDGE * torch.eye(n, dtype=sources.dtype, device=sources.device)
    top = torch.cat((kernel, border), 2)
    bottom = torch.cat((border.transpose(1, 2), (-_RIDGE * torch.eye(3).to(border)).expand(n_batch, 3, 3)), 2)
    wanted = torch.cat((goals, goals.new_zeros(n_batch, 3, 2)), 1)
    return torch.linalg.solve(torch.cat((top, bottom), 1), wanted)


def apply_spline(coefficients: Tensor, sources: Tensor, points: Tensor) -> Tensor:
    """Where the spline of `fit_spline` takes `points` (Q, 2) or (B, Q, 2): (B, Q, 2)."""
    points = points.expand(len(sources), *points.shape[-2:])
    affine = torch.cat((torch.ones_like(points[..., :1]), points), -1)
    n = sources.shape[1]
    return _bending(points, sources) @ coefficients[:, :n] + affine @ coefficients[:, n:]


def _bending(points: Tensor, sources: Tensor) -> Tensor:
    """U(r) = r^2 log r^2 between points (B, Q, 2) and sources (B, N, 2): (B, Q, N)."""
    square = (points[:, :, None] - sources[:, None]).square().sum(-1)
    return square * square.clamp(min=1e-12).log()


def sample_bilinear(pictures: Tensor, points: Tensor) -> Tensor:
    """Pictures (B, C, S, S) read between pixel centres at points (B, Q, 2): (B, C, Q); 0 outside the picture."""
    return functional.grid_sample(pictures, (2.0 * points - 1.0)[:, :, None], align_corners=False)[..., 0]


def warp_pictures(pictures: Tensor, goals: Tensor, rest: Tensor) -> Tensor:
    """Pictures (B, C, S, S) as they look once the control points `rest` (N, 2) have moved to `goals` (B, N, 2).

    The sampler asks of each new pixel where it comes from, so the spline runs backwards, from `goals` to `rest`.
    """
    size = pictures.shape[-1]
    coefficients = fit_spline(goals, rest.expand_as(goals))
    origins = apply_spline(coefficients, goals, pixel_centres(size).to(goals))
    return sample_bilinear(pictures, origins).unflatten(-1, (size, size))


def transport(points: Tensor, goals: Tensor, m: int) -> Tensor:
    """Points (B, Q, 2) carried along by the triangles of the grid, whose corners have moved to `goals` (B, M*M, 2).

    Every square of the grid is two triangles, cut from its lower left to its upper right corner; a point keeps its
    barycentric coordinates in the triangle that holds it (paper, section 4.2). A point outside the grid goes with
    the nearest square, by whose triangle it is extrapolated.
    """
    scaled = points * (m - 1)
    cell = scaled.detach().floor().clamp(0, m - 2)
    u, v = (scaled - cell).unbind(-1)
    column, row = cell.long().unbind(-1)
    upper = u + v <= 1.0  # the triangle at the square's upper left
    near = torch.where(upper, row * m + column, (row + 1) * m + column + 1)
    across = torch.where(upper, row * m + column + 1, (row + 1) * m + column)
    down = torch.where(upper, (row + 1) * m + column, row * m + column + 1)
    along_x, along_y = torch.where(upper, u, 1.0 - u), torch.where(upper, v, 1.0 - v)

    def corner(index: Tensor) -> Tensor:
        return goals.gather(1, index[..., None].expand(-1, -1, 2))

    rest = 1.0 - along_x - along_y
    return rest[..., None] * corner(near) + along_x[..., None] * corner(across) + along_y[..., None] * corner(down)
