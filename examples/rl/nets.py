"""The network of the recipes that have to bring one: two layers on all that is observed. It needs torch."""

from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from examples.rl.measuring import SEED


class Net(nn.Module):
    """Takes the arrays of an observation, (B, ...) each, and gives (B, n_outputs). It begins the same every time."""

    def __init__(self, space: Any, n_outputs: int) -> None:
        super().__init__()
        torch.manual_seed(SEED)
        boxes = getattr(space, "spaces", {"observation": space}).values()
        n_inputs = sum(int(np.prod(box.shape)) for box in boxes)
        self.layers = nn.Sequential(
            nn.LayerNorm(n_inputs), nn.Linear(n_inputs, 128), nn.Tanh(), nn.Linear(128, int(n_outputs))
        )

    def forward(self, *arrays: Tensor) -> Tensor:
        n_axes = arrays[-1].ndim - 1  # of the batch: the last array is a vector
        output: Tensor = self.layers(torch.cat([array.float().flatten(n_axes) for array in arrays], -1))
        return output


def as_batch(observation: dict[str, Any], mask: Any) -> tuple[dict[str, Tensor], Tensor]:
    """What one environment shows, and its mask, as tensors of a batch of one."""
    return {name: torch.from_numpy(array)[None] for name, array in observation.items()}, torch.from_numpy(mask)[None]
