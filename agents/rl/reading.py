"""What half-edges see of the pictures and know of their own shape, in their own frame: along, across, into the face.

Letters: B meshes, H half-edges of all of them, P points, C channels, R pixels a side.
"""

from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional

from agents.rl.links import Links, averaged, summed

N_ALONG = 6  # points along a half-edge, at each of the near offsets
NEAR = (-4.0 / 64, -1.5 / 64, 1.5 / 64, 4.0 / 64)  # unit square, outwards
FAR = (8.0 / 64, 16.0 / 64)
INWARDS = (0.35, 0.75)  # shares of the way to the middle of the face
N_WIDE = 3  # points along a half-edge at each of FAR and INWARDS
N_NEAR = N_ALONG * len(NEAR)
N_FAR = N_WIDE * len(FAR)
N_INNER = N_WIDE * len(INWARDS)
N_SHAPE = 15
_TINY = 1e-6


@dataclass(frozen=True)
class Frame:
    """Where the half-edges lie, unit square."""

    begin: Tensor  # (H, 2)
    step: Tensor  # (H, 2) to the end
    length: Tensor  # (H, 1)
    outwards: Tensor  # (H, 2) unit normal, away from the face
    middle: Tensor  # (H, 2) mean of the face's corners


def frame_of(vertices: Tensor, links: Links) -> Frame:
    """The frame of each half-edge, from vertices (V, 2)."""
    begin = vertices[links.tails]
    step = vertices[links.heads] - begin
    length = step.square().sum(-1, keepdim=True).sqrt()
    outwards = torch.stack((step[:, 1], -step[:, 0]), -1) / (length + _TINY)
    middle = averaged(begin, links.faces, len(links.homes["face"][0]))[links.faces]
    return Frame(begin, step, length, outwards, middle)


def near_points(frame: Frame) -> Tensor:
    """(H, N_NEAR, 2) points beside the half-edge, inside and outside."""
    across = frame.outwards[:, None, None] * frame.outwards.new_tensor(NEAR)[:, None]
    return (_along(frame, N_ALONG)[:, :, None] + across).flatten(1, 2)


def wide_points(frame: Frame) -> Tensor:
    """(H, N_FAR + N_INNER, 2) points far outside, then points in the half-edge's part of the face."""
    along = _along(frame, N_WIDE)[:, :, None]
    far = along + frame.outwards[:, None, None] * frame.outwards.new_tensor(FAR)[:, None]
    inner = along + frame.outwards.new_tensor(INWARDS)[:, None] * (frame.middle[:, None, None] - along)
    return torch.cat((far.flatten(1, 2), inner.flatten(1, 2)), 1)


def _along(frame: Frame, n: int) -> Tensor:
    """(H, n, 2) even places along each half-edge."""
    share = (torch.arange(n, device=frame.begin.device, dtype=frame.begin.dtype) + 0.5) / n
    return frame.begin[:, None] + share[:, None] * frame.step[:, None]


def read_mean(maps: Tensor, points: Tensor, batch: Tensor) -> Tensor:
    """(H, G, C) maps (B, C, R, R), of mesh `batch` (H,), the mean over groups of points (H, G, P, 2), unit square.

    Bilinear, 0 outside: a bag of four pixels for every point, which takes a CPU half the time of gathering them.
    """
    size, n_points = maps.shape[-1], points.shape[2]
    rows = maps.permute(0, 2, 3, 1).reshape(-1, maps.shape[1])
    at = points * size - 0.5
    low = at.floor()
    share = at - low
    x, y = low.long().unbind(-1)
    base = batch[:, None, None] * (size * size)
    pixels, weights = [], []
    for dx, wx in ((0, 1.0 - share[..., 0]), (1, share[..., 0])):
        for dy, wy in ((0, 1.0 - share[..., 1]), (1, share[..., 1])):
            column, row = x + dx, y + dy
            inside = (column >= 0) & (column < size) & (row >= 0) & (row < size)
            pixels.append(base + row.clamp(0, size - 1) * size + column.clamp(0, size - 1))
            weights.append(wx * wy * inside / n_points)
    bags, shares = (torch.cat(some, -1).flatten(0, 1) for some in (pixels, weights))
    found = functional.embedding_bag(bags, rows, per_sample_weights=shares.to(rows.dtype), mode="sum")
    return found.unflatten(0, points.shape[:2])


def read_pictures(pictures: Tensor, points: Tensor, home: tuple[Tensor, Tensor]) -> Tensor:
    """(H, P, C) pictures (B, C, R, R) at points (H, P, 2), unit square; bilinear, 0 outside.

    `home` is the mesh (H,) of each half-edge and its number (H,) there. Those of a mesh are read in a row, padded: the
    quickest where nothing is learnt about what is read.
    """
    batch, number = home
    n = int(number.max()) + 1 if len(number) else 1
    grid = points.new_full((len(pictures), n, *points.shape[1:]), 2.0)  # outside
    grid[batch, number] = 2.0 * points - 1.0
    found = functional.grid_sample(pictures, grid.to(pictures.dtype), align_corners=False)
    return found.permute(0, 2, 3, 1)[batch, number]


def shape_values(frame: Frame, links: Links) -> Tensor:
    """(H, N_SHAPE) length, direction, place, angles at both ends, boundary or not, and what the face is like."""
    unit = frame.step / (frame.length + _TINY)
    end = frame.begin + frame.step
    twice_area = frame.begin[:, :1] * end[:, 1:] - frame.begin[:, 1:] * end[:, :1]
    of_face = summed(
        torch.cat((0.5 * twice_area, torch.full_like(twice_area, 0.1)), -1), links.faces, len(links.homes["face"][0])
    )
    return torch.cat(
        (
            frame.length,
            (frame.length + 1e-3).log(),
            unit,
            frame.begin + 0.5 * frame.step - 0.5,
            frame.middle - 0.5,
            _turn(unit[links.preceding], unit),
            _turn(unit, unit[links.following]),
            links.on_boundary[:, None].to(unit.dtype),
            of_face[links.faces],
        ),
        -1,
    )


def _turn(one: Tensor, other: Tensor) -> Tensor:
    """(H, 2) cosine and sine of the angle between unit vectors."""
    return torch.stack(((one * other).sum(-1), one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]), -1)
