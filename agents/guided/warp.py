"""WarpNet: the affine map and the deformation of a grid that make the rendering look like the target (paper, 4.2).

Letters: B batch, S pixels a side, M x M grid, Q vertices (padded).
"""

from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

from agents.guided.config import WarpConfig
from agents.guided.layers import Encoder
from agents.guided.tps import control_grid, transport, warp_pictures
from autopoly_env.torch_raster import coverage


class Theta(NamedTuple):
    """The parameters of the warp."""

    affine: Tensor  # (B, 2, 3) the paper's A: on (x, y, 1)
    deformation: Tensor  # (B, M*M, 2) the paper's D: added to where A takes the control points


class WarpNet(nn.Module):
    """A CNN over (I_k, I_T) to theta; untrained it is the identity."""

    rest: Tensor
    identity: Tensor

    def __init__(self, config: WarpConfig) -> None:
        super().__init__()
        self.config = config
        self.encoder = Encoder(2, config.widths, config.feature, config.image_size)
        self.head = nn.Linear(config.feature, 6 + 2 * config.grid**2)
        nn.init.zeros_(self.head.weight)
        nn.init.zeros_(self.head.bias)
        self.register_buffer("rest", control_grid(config.grid), persistent=False)
        self.register_buffer("identity", torch.tensor([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), persistent=False)

    def forward(self, pictures: Tensor) -> Theta:
        """Theta for pictures (B, 2, S, S): the rendering I_k and the target I_T."""
        feature, _ = self.encoder(pictures)
        raw = self.head(feature).float()
        return Theta(self.identity + raw[:, :6].unflatten(1, (2, 3)), raw[:, 6:].unflatten(1, (-1, 2)))

    def goals(self, theta: Theta) -> Tensor:
        """(B, M*M, 2) where the control points go."""
        return move_grid(theta, self.rest)

    def carry(self, goals: Tensor, vertices: Tensor) -> Tensor:
        """Vertices (B, Q, 2) carried by the grid: (B, Q, 2)."""
        return transport(vertices, goals, self.config.grid)


def move_grid(theta: Theta, rest: Tensor) -> Tensor:
    """Control points (N, 2) under theta: (B, N, 2)."""
    flat = torch.cat((rest, torch.ones_like(rest[:, :1])), 1)
    return flat @ theta.affine.transpose(1, 2) + theta.deformation


class WarpLabels(NamedTuple):
    """What a batch is to be warped to, and the meshes that the pictures show."""

    pictures: Tensor  # (B, 2, S, S)
    vertices: Tensor  # (B, Q, 2), padded with 0
    edges: Tensor  # (B, E, 2) directed boundary edges, padded with -1


def loss_terms(net: WarpNet, theta: Theta, truth: WarpLabels) -> dict[str, Tensor]:
    """The terms of the loss, each a mean of squares.

    "image": warped I_k minus I_T, the paper's, at half the resolution, which takes a quarter of the time. "mesh": the
    carried mesh's rendering, which is exact and differentiable, minus I_T. "bend": the deformation's second
    differences, which keeps the grid from folding.
    """
    goals, goal = net.goals(theta), truth.pictures[:, 1]
    begin, end = functional.avg_pool2d(truth.pictures.float(), 2).unbind(1)
    warped = warp_pictures(begin[:, None], goals, net.rest)[:, 0]
    shown = coverage(net.carry(goals, truth.vertices), truth.edges, net.config.image_size)
    m = net.config.grid
    field = theta.deformation.unflatten(1, (m, m))
    bends = [torch.diff(field, n=2, dim=axis).square().mean() for axis in (1, 2)] if m > 2 else [field.new_zeros(())]
    return {
        "image": functional.mse_loss(warped, end),
        "mesh": functional.mse_loss(shown.to(goal.dtype), goal),
        "bend": torch.stack(bends).sum(),
    }
