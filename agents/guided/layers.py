"""The convolutions that both networks are built of: an encoder to a feature vector, a decoder back to pictures.

Letters: B batch, C channels, S pixels a side, D numbers in the feature.
"""

from collections.abc import Sequence
from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional


class Encoder(nn.Module):
    """Pictures (B, C, S, S) to a feature (B, D); four convolutions of stride 2."""

    def __init__(self, n_inputs: int, widths: Sequence[int], feature: int, size: int) -> None:
        super().__init__()
        channels = [n_inputs, *widths]
        self.convolutions = nn.ModuleList(
            nn.Sequential(nn.Conv2d(a, b, 3, stride=2, padding=1), nn.GroupNorm(1, b), nn.ReLU())
            for a, b in pairwise(channels)
        )
        self.head = nn.Linear(widths[-1] * (size // 16) ** 2, feature)

    def forward(self, pictures: Tensor) -> tuple[Tensor, list[Tensor]]:
        """The feature (B, D), and the feature maps at S/2, S/4, S/8, S/16."""
        maps = []
        x = pictures
        for convolution in self.convolutions:
            x = convolution(x)
            maps.append(x)
        return functional.relu(self.head(x.flatten(1))), maps


class Decoder(nn.Module):
    """A feature (B, D) to pictures (B, n_outputs, S, S), without a last non-linearity.

    With `skips` the encoder's feature map of the same size joins at every level.
    """

    def __init__(self, n_outputs: int, widths: Sequence[int], feature: int, size: int, skips: bool) -> None:
        super().__init__()
        self.size, self.skips = size // 16, skips
        self.begin = nn.Linear(feature, widths[-1] * self.size**2)
        levels = []
        for k in range(len(widths) - 1, 0, -1):
            n_in = widths[k] + (widths[k] if skips else 0)
            levels.append(nn.Sequential(nn.Conv2d(n_in, widths[k - 1], 3, padding=1), nn.ReLU()))
        self.levels = nn.ModuleList(levels)
        n_last = widths[0] * (2 if skips else 1)
        self.end = nn.Conv2d(n_last, 4 * n_outputs, 3, padding=1)

    @property
    def n_last(self) -> int:
        """Channels of what `last_maps` gives."""
        return self.end.in_channels

    def forward(self, feature: Tensor, maps: Sequence[Tensor]) -> Tensor:
        return self.draw(self.last_maps(feature, maps))

    def draw(self, last: Tensor) -> Tensor:
        """The pictures, from `last_maps`."""
        return functional.pixel_shuffle(self.end(last), 2)

    def last_maps(self, feature: Tensor, maps: Sequence[Tensor]) -> Tensor:
        """(B, C, S/2, S/2) what the pictures are drawn from."""
        x = functional.relu(self.begin(feature)).unflatten(1, (-1, self.size, self.size))
        for level, skip in zip(self.levels, reversed(maps[1:]), strict=True):
            x = functional.interpolate(level(self._joined(x, skip)), scale_factor=2.0, mode="nearest")
        return self._joined(x, maps[0])

    def begin_with(self, logit: float) -> None:
        """Let the pictures be about `logit` everywhere before anything is learnt."""
        if self.end.bias is not None:
            nn.init.constant_(self.end.bias, logit)

    def _joined(self, x: Tensor, skip: Tensor) -> Tensor:
        return torch.cat((x, skip), 1) if self.skips else x


def n_parameters(module: nn.Module) -> int:
    """How many numbers a network has learnt."""
    return sum(parameter.numel() for parameter in module.parameters())
