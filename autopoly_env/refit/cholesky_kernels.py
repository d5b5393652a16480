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
def _dot(one: FloatArray, i: int, other: FloatArray, j: int, first: int, last: int) -> float:
    """Of row i of one and row j of another, columns first..last-1; four sums, which a processor adds side by side."""
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    k = first
    while k + 4 <= last:
        a += one[i, k] * other[j, k]
        b += one[i, k + 1] * other[j, k + 1]
        c += one[i, k + 2] * other[j, k + 2]
        d += one[i, k + 3] * other[j, k + 3]
        k += 4
    while k < last:
        a += one[i, k] * other[j, k]
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
            total = matrix[i, j] - _dot(matrix, i, matrix, j, max(first[i], first[j]), j)
            matrix[i, j] = total / matrix[j, j]
        total = matrix[i, i] - _dot(matrix, i, matrix, i, first[i], i)
        if not total > 0.0:
            return False
        matrix[i, i] = np.sqrt(total)
    return True


@uncounted_kernel
def solve(factor: Factor, vector: FloatArray) -> None:
    """Put the solution x of A x = `vector` (N,) in its place."""
    matrix, first = factor
    for i in range(vector.shape[0]):
        a, b, c, d = 0.0, 0.0, 0.0, 0.0  # as in `_dot`
        k = first[i]
        while k + 4 <= i:
            a += matrix[i, k] * vector[k]
            b += matrix[i, k + 1] * vector[k + 1]
            c += matrix[i, k + 2] * vector[k + 2]
            d += matrix[i, k + 3] * vector[k + 3]
            k += 4
        while k < i:
            a += matrix[i, k] * vector[k]
            k += 1
        vector[i] = (vector[i] - ((a + b) + (c + d))) / matrix[i, i]
    for i in range(vector.shape[0] - 1, -1, -1):
        vector[i] /= matrix[i, i]
        for k in range(first[i], i):
            vector[k] -= matrix[i, k] * vector[i]
