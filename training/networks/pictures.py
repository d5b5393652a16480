"""Pictures for the log of a training run: what the networks say beside the truth."""

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from agents.guided.nfap import Foresight
from agents.guided.tps import warp_pictures
from agents.guided.warp import Warp, WarpNet
from autopoly_env.arrays import ByteArray
from training.networks.streams import Batch

_GAP = 2  # pixels between pictures
_SCALE = 2


def draw_nfap(foresight: Foresight, batch: Batch) -> ByteArray:
    """A row for each sample: current, target, then for every stage the true and the foreseen image and region."""
    n = batch["images"].shape[1]
    columns = [batch["pictures"][:, 0], batch["pictures"][:, 1]]
    for k in range(n):
        regions = foresight.regions[:, k]
        own = batch["operators"][:, k, None, None, None].expand(-1, 1, *regions.shape[-2:])
        region = regions[:, 0] if regions.shape[1] == 1 else regions.gather(1, own)[:, 0]
        images = batch["images"][:, k] if foresight.images is None else foresight.images[:, k].sigmoid()
        columns += [batch["images"][:, k], images, batch["regions"][:, k], region.sigmoid()]
    return _sheet(torch.stack(columns, 1))


def draw_warp(net: WarpNet, warps: Sequence[Warp], batch: Batch) -> ByteArray:
    """A row for each sample: current, target, current as first warped, the mesh after all passes, the full refit."""
    warped = warp_pictures(batch["pictures"][:, :1], net.goals(warps[0].theta), net.rest)[:, 0]
    return _sheet(torch.stack([*batch["pictures"].unbind(1), warped, warps[-1].shown, batch["full"]], 1))


def _sheet(pictures: Tensor) -> ByteArray:
    """Pictures (rows, columns, S, S) of shares as one (H, W), dark where the share is 1."""
    padded = torch.nn.functional.pad(pictures.float().cpu().clamp(0.0, 1.0), (0, _GAP, 0, _GAP), value=0.5)
    rows = torch.cat([torch.cat(list(row), -1) for row in padded], 0)
    pixels = (255.0 * (1.0 - rows)).round().to(torch.uint8).numpy()
    return np.kron(pixels, np.ones((_SCALE, _SCALE), np.uint8))
