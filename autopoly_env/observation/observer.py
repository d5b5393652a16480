"""What a player sees: a mesh, its target and the steps left as arrays whose sizes never change.

Letters: N `max_vertices`, R `resolution` in pixels a side. The arrays are flat, which RL libraries expect of anything
that is no picture; rows of two come back with `reshape(-1, 2)`.
"""

from dataclasses import dataclass

import numpy as np

from autopoly_env.arrays import AnyArray, ByteArray, FloatArray
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh
from autopoly_env.observation import observation_kernels
from autopoly_env.operators import CAPACITY_PER_VERTEX
from autopoly_env.raster import workspace
from autopoly_env.silhouette import Silhouette

PADDING = -1  # of rows without an element
POSITION_RANGE = (-1.0, 2.0)  # positions are clipped to it; the unit square lies in its middle

Observation = dict[str, AnyArray]
_WRITTEN = ("rendering", "vertices", "edges", "faces", "counts")


@dataclass(frozen=True)
class Field:
    """The type of one array of an observation, and the least and the greatest value in it."""

    shape: tuple[int, ...]
    dtype: type[np.generic]
    low: float
    high: float


class Observer:
    """Makes the observations; `fields` says what is in them (docs/environment.md has them as a table)."""

    def __init__(self, max_vertices: int, resolution: int, max_steps: int) -> None:
        """Raises ConfigError for a resolution below 1."""
        if resolution < 1:
            raise ConfigError(f"a picture of {resolution} pixels was asked for; give at least 1")
        self._resolution = resolution
        self._max_vertices = max_vertices
        n_edges, n_corners = (CAPACITY_PER_VERTEX[kind] * max_vertices for kind in ("edge", "corner"))
        picture = Field((1, resolution, resolution), np.uint8, 0, 255)
        self.fields = {
            "rendering": picture,
            "target": picture,
            "vertices": Field((2 * max_vertices,), np.float32, *POSITION_RANGE),
            "edges": Field((2 * n_edges,), np.int32, PADDING, max_vertices - 1),
            "faces": Field((2 * n_corners,), np.int32, PADDING, max_vertices - 1),
            "counts": Field((4,), np.int32, 0, n_corners),
            "remaining_steps": Field((1,), np.int32, 0, max_steps),
        }
        self._written = [(self.fields[name].shape, np.dtype(self.fields[name].dtype)) for name in _WRITTEN]

    def picture_of(self, silhouette: Silhouette) -> ByteArray:
        """The target as a picture (1, R, R)."""
        return as_bytes(silhouette.target(self._resolution).coverage)[None]

    def observe(self, mesh: PolyMesh, target: ByteArray, remaining_steps: int) -> Observation:
        """New arrays of what there is to see; `target` is what `picture_of` gives."""
        size, packed = self._resolution, mesh.topology.packed
        rendering, vertices, edges, faces, counts = (np.empty(shape, dtype) for shape, dtype in self._written)
        work = workspace(size, len(mesh.topology.boundary_half_edges))
        observation_kernels.observe(
            *(mesh.vertices, packed, *POSITION_RANGE, PADDING, work, np.empty((size, size))),
            *(rendering, vertices, edges, faces, counts),
        )
        return {
            "rendering": rendering,
            "target": target.copy(),
            "vertices": vertices,
            "edges": edges,
            "faces": faces,
            "counts": counts,
            "remaining_steps": np.array((remaining_steps,), np.int32),
        }

    def check_fits(self, mesh: PolyMesh) -> None:
        """Raise ConfigError for a mesh with more vertices, edges, faces or corners than the arrays have room for."""
        sizes = dict(zip(("vertex", "edge", "face"), mesh.counts, strict=True))
        sizes["corner"] = len(mesh.topology.half_edges)
        for kind, n in sizes.items():
            room = CAPACITY_PER_VERTEX[kind] * self._max_vertices
            if n > room:
                raise ConfigError(
                    f"the mesh's {kind} count is {n}; at most {room} fit max_vertices={self._max_vertices}: raise that"
                )


def as_bytes(shares: FloatArray) -> ByteArray:
    """Shares of 0 to 1 as 0 to 255; more than 1, where faces overlap, is 1, less than 0, where they flip, is 0."""
    return (255.0 * np.clip(shares, 0.0, 1.0) + 0.5).astype(np.uint8)
