"""From the index arrays of observations to how the half-edges of all meshes of a batch hang together.

A half-edge is a side of a face, directed as the face is wound; it has the number of the corner that it leaves. The
elements of all meshes of a batch stand one after the other, so that nothing is computed for padding. What is found does
not depend on how vertices and faces are numbered.

Letters: B meshes of the batch; V vertices, E edges, F faces, H half-edges (= corners) of all of them together.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor

_VERTEX, _EDGE, _FACE, _CORNER = range(4)  # columns of `counts`


@dataclass(frozen=True)
class Links:
    """Rows of what belongs to each half-edge (H,), and where each element comes from."""

    batch: Tensor  # (H,) mesh
    tails: Tensor  # (H,) vertex that it leaves
    heads: Tensor  # (H,) vertex that it arrives at
    faces: Tensor  # (H,)
    edges: Tensor  # (H,)
    following: Tensor  # (H,) next half-edge around the face
    preceding: Tensor  # (H,)
    twins: Tensor  # (H,) half-edge that runs the other way; itself on the boundary
    on_boundary: Tensor  # (H,) bool
    homes: dict[str, tuple[Tensor, Tensor]]  # by kind of element: mesh, and number in the mesh, of each


def links_of(observation: Mapping[str, Tensor]) -> Links:
    """The links of a batch of observations; see `autopoly_env.observation` for its arrays and their order."""
    counts = observation["counts"].long()
    homes = {kind: _homes(counts[:, k]) for k, kind in enumerate(("vertex", "edge", "face", "corner"))}
    first = counts.cumsum(0) - counts  # (B, 4) row of each mesh's first element
    batch, corners = homes["corner"]
    own = torch.arange(len(batch), device=batch.device)
    pairs = observation["faces"].long().unflatten(1, (-1, 2))[batch, corners]
    faces, tails = pairs[:, 0] + first[batch, _FACE], pairs[:, 1] + first[batch, _VERTEX]
    sizes = torch.bincount(faces, minlength=len(homes["face"][0]))
    last = (sizes.cumsum(0) - 1)[faces]
    begin = last - sizes[faces] + 1
    following = torch.where(own == last, begin, own + 1)
    preceding = torch.where(own == begin, last, own - 1)
    heads = tails[following]
    edges = _edges(observation, homes["edge"], first[:, _VERTEX], tails, heads)
    n_sides = torch.bincount(edges, minlength=len(homes["edge"][0]))
    both = torch.zeros_like(n_sides).scatter_add_(0, edges, own)
    on_boundary = n_sides[edges] < 2
    twins = torch.where(on_boundary, own, both[edges] - own)
    return Links(batch, tails, heads, faces, edges, following, preceding, twins, on_boundary, homes)


def _homes(counts: Tensor) -> tuple[Tensor, Tensor]:
    """For meshes of so many elements (B,): the mesh of each element, and its number there."""
    batch = torch.repeat_interleave(counts)
    return batch, torch.arange(len(batch), device=counts.device) - (counts.cumsum(0) - counts)[batch]


def _edges(
    observation: Mapping[str, Tensor], home: tuple[Tensor, Tensor], first: Tensor, tails: Tensor, heads: Tensor
) -> Tensor:
    """(H,) the edge under each half-edge: edges stand in ascending order of their lower, then their higher vertex."""
    batch, number = home
    ends = observation["edges"].long().unflatten(1, (-1, 2))[batch, number] + first[batch][:, None]
    n = int(ends.amax()) + 1 if len(ends) else 1
    names = torch.minimum(tails, heads) * n + torch.maximum(tails, heads)
    return torch.searchsorted(ends.amin(1) * n + ends.amax(1), names)


def taken(rows: Tensor, index: Tensor) -> Tensor:
    """rows (K, D) at index (H,): (H, D)."""
    return rows.index_select(0, index)


def summed(rows: Tensor, index: Tensor, n: int) -> Tensor:
    """(n, D) the sum of the rows (H, D) that have each index (H,)."""
    return rows.new_zeros((n, rows.shape[1])).scatter_add(0, index[:, None].expand(-1, rows.shape[1]), rows)


def averaged(rows: Tensor, index: Tensor, n: int) -> Tensor:
    """(n, D) the mean of the rows (H, D) that have each index (H,); 0 where there are none."""
    return summed(rows, index, n) / torch.bincount(index, minlength=n).clamp(min=1)[:, None]
