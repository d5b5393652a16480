"""Envelope Cholesky factorisation of a symmetric positive definite matrix, most of whose entries are far off."""

from typing import NamedTuple

import numpy as np

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.compute import uncounted_kernel


class Factor(NamedTuple):
    """A lower triangle L, L L' = A, in the place of that of A."""

    matrix: FloatArray  # (N, N) of which the lower triangle counts
    first: IntArray  # (N,) column of the first entry of each row that is not 0


@uncounted_kernel
def _dot(one: FloatArray, other: FloatArray, first: int, last: int) -> float:
    """Of two rows (N,), columns first..last-1; four sums, which a processor adds side by side."""
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    k = first
    while k + 4 <= last:
        a += one[k] * other[k]
        b += one[k + 1] * other[k + 1]
        c += one[k + 2] * other[k + 2]
        d += one[k + 3] * other[k + 3]
        k += 4
    while k < last:
        a += one[k] * other[k]
        k += 1
    return (a + b) + (c + d)


@uncounted_kernel
def factorise(factor: Factor, relative: float, absolute: float) -> bool:
    """Put L in the place of A + relative * diag(A) + absolute * 1; False if that is not positive definite."""
    matrix, first = factor
    for i in range(matrix.shape[0]):
        matrix[i, i] += relative * matrix[i, i] + absolute
        j = 0
        while j < i and matrix[i, j] == 0.0:
            j += 1
        first[i] = j
        for j in range(first[i], i):
            total = matrix[i, j] - _dot(matrix[i], matrix[j], max(first[i], first[j]), j)
            matrix[i, j] = total / matrix[j, j]
        total = matrix[i, i] - _dot(matrix[i], matrix[i], first[i], i)
        if not total > 0.0:
            return False
        matrix[i, i] = np.sqrt(total)
    return True


@uncounted_kernel
def solve(factor: Factor, vector: FloatArray) -> None:
    """Put the solution x of A x = `vector` (N,) in its place."""
    matrix, first = factor
    for i in range(vector.shape[0]):
        vector[i] = (vector[i] - _dot(matrix[i], vector, first[i], i)) / matrix[i, i]
    for i in range(vector.shape[0] - 1, -1, -1):
        vector[i] /= matrix[i, i]
        for k in range(first[i], i):
            vector[k] -= matrix[i, k] * vector[i]
