"""What `python -m autopoly_env.warm` compiles of the agents: outlines of pictures, and outlines cut into quads."""

import numpy as np

from agents.quads import partition_kernels
from agents.quads.partition import BENT_SINE, LEAST_SINE
from agents.trace.peel_kernels import peel
from agents.trace.simplify import Contour
from autopoly_env.mesh import PolyMesh
from autopoly_env.mesh.corner_kernels import turns


def outlines() -> None:
    """Contours simplified and taken apart, and polygons, also with holes, cut into quads."""
    square = np.array([[0.1, 0.1], [0.9, 0.1], [0.9, 0.9], [0.1, 0.9]])
    round_ = 0.5 + 0.4 * np.column_stack([f(np.linspace(0.0, 6.0, 12)) for f in (np.cos, np.sin)])
    contour = Contour(round_)
    contour.polygon(min(5, contour.n_most))
    peel(round_, np.zeros((0, 4)), np.zeros(len(round_), np.bool_), 4)
    points = np.concatenate((square, 0.5 + 0.25 * (square - 0.5)[::-1]))
    points.setflags(write=False)  # as those of meshes are
    around, hole = np.arange(4), np.arange(4, 8)
    polygon = partition_kernels.bridged(points, around, hole, np.cumsum([0, 4]), 0)
    seen = partition_kernels.visible(points, polygon)
    partition_kernels.cut(points, polygon, seen, LEAST_SINE, 0.0)
    topology = PolyMesh.rectangle(0.1, 0.1, 0.9, 0.9).topology
    partition_kernels.bend(square.copy(), topology.corners, topology.face_offsets, BENT_SINE, 1)
    turns(square.copy(), topology.corners, topology.face_offsets)
