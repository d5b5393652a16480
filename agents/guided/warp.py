"""WarpNet: the affine map and the deformation of a grid that make the rendering look like the target (paper, 4.2).

Letters: B batch, S pixels a side, M x M grid of N control points, Q vertices (padded), E edges (padded).
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

from agents.guided.config import WarpConfig
from agents.guided.layers import Encoder
from agents.guided.tps import control_grid, transport, warp_pictures
from autopoly_env.raster.autograd import coverage


class Theta(NamedTuple):
    """The parameters of the warp."""

    affine: Tensor  # (B, 2, 3) the paper's A: on (x, y, 1)
    deformation: Tensor  # (B, M*M, 2) the paper's D: added to where A takes the control points


class Warp(NamedTuple):
    """One pass: what the network saw, what it said, and what became of the meshes."""

    pictures: Tensor  # (B, 2, S, S)
    theta: Theta
    vertices: Tensor  # (B, Q, 2)
    shown: Tensor  # (B, S, S) the exact rendering of the carried meshes


class WarpNet(nn.Module):
    """A CNN over (I_k, I_T) to theta; untrained it is the identity."""

    rest: Tensor
    identity: Tensor

    def __init__(self, config: WarpConfig) -> None:
        super().__init__()
        self.config = config
        local, n_points = config.deformation == "local", config.grid**2
        self.encoder = Encoder(2, config.widths, config.feature, config.image_size)
        self.head = nn.Linear(config.feature, 6 if local else 6 + 2 * n_points)
        self.field = _Field(config) if local else None
        nn.init.zeros_(self.head.weight)
        nn.init.zeros_(self.head.bias)
        self.register_buffer("rest", control_grid(config.grid), persistent=False)
        self.register_buffer("identity", torch.tensor([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), persistent=False)

    def forward(self, pictures: Tensor) -> Theta:
        """Theta for pictures (B, 2, S, S): the rendering I_k and the target I_T."""
        feature, maps = self.encoder(pictures)
        raw = self.head(feature).float()
        bent = raw[:, 6:].unflatten(1, (-1, 2)) if self.field is None else self.field(feature, maps, self.rest).float()
        return Theta(self.identity + raw[:, :6].unflatten(1, (2, 3)), bent)

    def goals(self, theta: Theta) -> Tensor:
        """(B, M*M, 2) where the control points go."""
        return move_grid(theta, self.rest)

    def carry(self, goals: Tensor, vertices: Tensor) -> Tensor:
        """Vertices (B, Q, 2) carried by the grid: (B, Q, 2)."""
        return transport(vertices, goals, self.config.grid)

    def warps(
        self, pictures: Tensor, vertices: Tensor, edges: Tensor, think: Callable[[Tensor], Theta] | None = None
    ) -> list[Warp]:
        """The config's passes over meshes: `vertices` (B, Q, 2), directed boundary `edges` (B, E, 2) padded with -1.

        Each pass sees the rendering that the one before it has led to; no gradient runs from one to another. `think`
        is called in place of `forward`.
        """
        made: list[Warp] = []
        goal = pictures[:, 1]
        for _ in range(self.config.passes):
            theta = (think or self)(pictures)
            carried = self.carry(self.goals(theta), vertices)
            shown = coverage(carried, edges, self.config.image_size)
            made.append(Warp(pictures, theta, carried, shown))
            vertices = carried.detach()
            pictures = torch.stack((shown.detach().clamp(0.0, 1.0).to(goal), goal), 1)
        return made


class _Field(nn.Module):
    """Feature and feature maps to a displacement at every control point: up to S/4 with skips, then read there."""

    def __init__(self, config: WarpConfig) -> None:
        super().__init__()
        widths = config.widths
        self.size = config.image_size // 16
        self.begin = nn.Linear(config.feature, widths[3] * self.size**2)
        self.levels = nn.ModuleList(
            nn.Sequential(nn.Conv2d(2 * widths[k], widths[k - 1], 3, padding=1), nn.ReLU()) for k in (3, 2)
        )
        last = nn.Conv2d(widths[1], 2, 3, padding=1, bias=False)
        nn.init.zeros_(last.weight)
        self.end = nn.Sequential(nn.Conv2d(2 * widths[1], widths[1], 3, padding=1), nn.ReLU(), last)

    def forward(self, feature: Tensor, maps: Sequence[Tensor], points: Tensor) -> Tensor:
        """(B, N, 2) for control points (N, 2)."""
        x = functional.relu(self.begin(feature)).unflatten(1, (-1, self.size, self.size))
        for level, skip in zip(self.levels, (maps[3], maps[2]), strict=True):
            x = functional.interpolate(level(torch.cat((x, skip), 1)), scale_factor=2.0, mode="nearest")
        moves = self.end(torch.cat((x, maps[1]), 1))
        at = (2.0 * points - 1.0).to(moves).expand(len(moves), 1, -1, -1)
        return functional.grid_sample(moves, at, padding_mode="border", align_corners=False)[:, :, 0].transpose(1, 2)


def move_grid(theta: Theta, rest: Tensor) -> Tensor:
    """Control points (N, 2) under theta: (B, N, 2)."""
    flat = torch.cat((rest, torch.ones_like(rest[:, :1])), 1)
    return flat @ theta.affine.transpose(1, 2) + theta.deformation


def loss_terms(net: WarpNet, warps: Sequence[Warp], with_image: bool = True) -> dict[str, Tensor]:
    """The terms of the loss, each a mean of squares over all passes.

    "image": warped I_k minus I_T, the paper's, at half the resolution, which takes a quarter of the time; 0 if left
    out. "mesh": the carried mesh's rendering, which is exact and differentiable, minus I_T. "bend": the deformation's
    second differences, which keeps the grid from folding.
    """
    rows = [_terms(net, warp, with_image) for warp in warps]
    return {name: torch.stack([row[name] for row in rows]).mean() for name in rows[0]}


def _terms(net: WarpNet, warp: Warp, with_image: bool) -> dict[str, Tensor]:
    goal, m = warp.pictures[:, 1], net.config.grid
    image = goal.new_zeros(())
    if with_image:
        begin, end = functional.avg_pool2d(warp.pictures.float(), 2).unbind(1)
        warped = warp_pictures(begin[:, None], net.goals(warp.theta), net.rest)[:, 0]
        image = functional.mse_loss(warped, end)
    field = warp.theta.deformation.unflatten(1, (m, m))
    bends = [torch.diff(field, n=2, dim=axis).square().mean() for axis in (1, 2)] if m > 2 else [field.new_zeros(())]
    return {
        "image": image,
        "mesh": functional.mse_loss(warp.shown.to(goal.dtype), goal),
        "bend": torch.stack(bends).sum(),
    }
