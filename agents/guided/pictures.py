"""What the networks see: the rendering, the target, and, if wanted, the mesh itself drawn as lines and points."""

from collections.abc import Callable, Sequence

import numpy as np

from agents.guided.config import Input
from autopoly_env.arrays import Float32Array, FloatArray
from autopoly_env.mesh import PolyMesh
from autopoly_env.raster import coverage

Picture = Float32Array


def rendering(mesh: PolyMesh, size: int) -> Picture:
    """Coverage (S, S) of the mesh, at most 1 where faces overlap and at least 0 where they are flipped."""
    return np.clip(coverage(mesh, size), 0.0, 1.0).astype(np.float32)


def draw_inputs(mesh: PolyMesh, target: FloatArray | Picture, inputs: Sequence[Input]) -> Picture:
    """The channels (C, S, S) that `inputs` names, for a target of coverage (S, S)."""
    size = len(target)
    shown = rendering(mesh, size)
    made: dict[Input, Callable[[], Picture]] = {
        "current": lambda: shown,
        "target": lambda: target.astype(np.float32),
        "difference": lambda: target.astype(np.float32) - shown,
        "edges": lambda: _edge_picture(mesh, size),
        "vertices": lambda: _splat(mesh.vertices, size),
    }
    return np.stack([made[name]() for name in inputs])


def _edge_picture(mesh: PolyMesh, size: int) -> Picture:
    """(S, S) 1 in the pixels that an edge passes through, interior edges included."""
    ends = mesh.vertices[mesh.edges]
    n_steps = 2 * size
    share = (np.arange(n_steps) + 0.5)[:, None, None] / n_steps
    return _splat(((1.0 - share) * ends[:, 0] + share * ends[:, 1]).reshape(-1, 2), size)


def _splat(points: FloatArray, size: int) -> Picture:
    """(S, S) 1 in the pixels that hold a point; those outside the picture are left out."""
    picture = np.zeros((size, size), np.float32)
    columns, rows = np.floor(points * size).astype(np.int64).T
    inside = (0 <= columns) & (columns < size) & (0 <= rows) & (rows < size)
    picture[rows[inside], columns[inside]] = 1.0
    return picture
