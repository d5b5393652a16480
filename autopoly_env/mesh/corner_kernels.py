"""Numba kernels of the corners of faces: how far each turns, and whether it has become straighter than it may be."""

import numpy as np

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.compute import kernel, uncounted_kernel

LEAST_TURN = 0.005  # sine, 0.29 degrees, at every corner of a face that keeps a rule of faces


@uncounted_kernel
def turn(points: FloatArray, before: int, at: int, after: int) -> float:
    """The sine of the angle by which a face turns at its corner `at`: above 0 where convex; 0 beside an empty edge."""
    ax, ay = points[at, 0] - points[before, 0], points[at, 1] - points[before, 1]
    bx, by = points[after, 0] - points[at, 0], points[after, 1] - points[at, 1]
    lengths = np.sqrt((ax * ax + ay * ay) * (bx * bx + by * by))
    return (ax * by - ay * bx) / lengths if lengths > 0.0 else 0.0


@kernel
def turns(points: FloatArray, corners: IntArray, offsets: IntArray) -> FloatArray:
    """(H,) `turn` at every corner of all faces; face f has the vertices corners[offsets[f]:offsets[f+1]]."""
    sines = np.empty(corners.shape[0])
    for face in range(offsets.shape[0] - 1):
        first, last = offsets[face], offsets[face + 1]
        for k in range(first, last):
            before, after = corners[k - 1 if k > first else last - 1], corners[k + 1 if k + 1 < last else first]
            sines[k] = turn(points, before, corners[k], after)
    return sines


@uncounted_kernel
def n_flat_faces(points: FloatArray, corners: IntArray, offsets: IntArray, least: float) -> int:
    """How many faces have a corner that does not turn by a sine of at least `least`."""
    n_flat = 0
    for face in range(offsets.shape[0] - 1):
        first, last = offsets[face], offsets[face + 1]
        for k in range(first, last):
            before, after = corners[k - 1 if k > first else last - 1], corners[k + 1 if k + 1 < last else first]
            if not turn(points, before, corners[k], after) >= least:
                n_flat += 1
                break
    return n_flat


@uncounted_kernel
def keeps_turns(
    points: FloatArray, start: FloatArray, corners: IntArray, offsets: IntArray, asked: float
) -> bool:  # fmt: skip
    """Whether every corner turns by a sine of at least `asked`, or by no less than it did at `start`."""
    for face in range(offsets.shape[0] - 1):
        first, last = offsets[face], offsets[face + 1]
        for k in range(first, last):
            before, after = corners[k - 1 if k > first else last - 1], corners[k + 1 if k + 1 < last else first]
            sine = turn(points, before, corners[k], after)
            if not sine >= asked and not sine >= turn(start, before, corners[k], after):
                return False
    return True
