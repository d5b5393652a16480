"""What keeps the corners of faces convex in a refit: a hinge in its equations, and vertices put where corners turn.

Under a rule of faces every vertex is an unknown: those off the boundary have corners, too. Letters: see
`shape_kernels`; H corners of all faces.
"""

from typing import NamedTuple

import numpy as np

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.compute import kernel, uncounted_kernel

_WEIGHT = 30.0  # of a squared pixel by which a corner is short of its turn, beside squared errors of pixels
_FOLLOWING = 0.1  # the same, of a vertex off the boundary that moves otherwise than its neighbours do
_SWEEPS = 12  # over the corners, at most
FREE, LOCKED = -1, -2
_BEYOND = 1.02  # times what is asked: where a corner that is short is put, so that rounding leaves it there


class Rule(NamedTuple):
    """The corners that have to stay convex, in numbers of unknowns."""

    triples: IntArray  # (H, 3) the unknown before each corner, at it and after it
    inner: IntArray  # (K,) unknowns that are not on the boundary
    neighbours: IntArray  # unknowns joined to each of these, one after the other
    neighbour_offsets: IntArray  # (K+1,)
    images: IntArray  # (N,) the mirror image of each unknown, itself on the axis; FREE or LOCKED where there is none
    asked: float  # the sine by which every corner should turn


@uncounted_kernel
def hinge(
    rule: Rule, origin: FloatArray, unknowns: FloatArray, size: int, gradient: FloatArray, normal: FloatArray
) -> float:
    """What the corners that turn too little cost, and inner vertices that do not follow their neighbours.

    Adds half the gradient J'r to `gradient` (N, 2) and J'J to the lower triangle of `normal` (2N, 2N), both per pixel;
    an empty `normal` is left alone.
    """
    if rule.triples.shape[0] == 0:
        return 0.0
    return _hinge(rule, origin, unknowns, size, gradient, normal)


@kernel
def _hinge(
    rule: Rule, origin: FloatArray, unknowns: FloatArray, size: int, gradient: FloatArray, normal: FloatArray
) -> float:
    loss = 0.0
    slope = np.empty(6)
    for c in range(rule.triples.shape[0]):
        p, q, r = rule.triples[c, 0], rule.triples[c, 1], rule.triples[c, 2]
        ax, ay = unknowns[q, 0] - unknowns[p, 0], unknowns[q, 1] - unknowns[p, 1]
        bx, by = unknowns[r, 0] - unknowns[q, 0], unknowns[r, 1] - unknowns[q, 1]
        a, b = np.sqrt(ax * ax + ay * ay), np.sqrt(bx * bx + by * by)
        short = rule.asked * a * b - (ax * by - ay * bx)
        if not short > 0.0:
            continue
        residual = short * size / (a + b)
        slope[0], slope[1] = by, -bx
        slope[2], slope[3] = -by - ay, bx + ax
        slope[4], slope[5] = ay, -ax
        for i in range(6):
            slope[i] /= a + b
        loss += _WEIGHT * residual * residual
        for i in range(6):
            u, k = rule.triples[c, i >> 1], i & 1
            gradient[u, k] += _WEIGHT * residual * slope[i]
            for j in range(6 if normal.shape[0] > 0 else 0):
                v = rule.triples[c, j >> 1]
                if 2 * v + (j & 1) <= 2 * u + k:
                    normal[2 * u + k, 2 * v + (j & 1)] += _WEIGHT * slope[i] * slope[j]
    return loss + _following(rule, origin, unknowns, size, gradient, normal)


@uncounted_kernel
def _following(
    rule: Rule, origin: FloatArray, unknowns: FloatArray, size: int, gradient: FloatArray, normal: FloatArray
) -> float:
    """What inner vertices cost that move otherwise than their neighbours on average: nothing, as soon as they can."""
    loss = 0.0
    for k in range(rule.inner.shape[0]):
        v = rule.inner[k]
        first, last = rule.neighbour_offsets[k], rule.neighbour_offsets[k + 1]
        share = -1.0 / (last - first)
        for axis in range(2):
            residual = unknowns[v, axis] - origin[v, axis]
            for m in range(first, last):
                u = rule.neighbours[m]
                residual += share * (unknowns[u, axis] - origin[u, axis])
            residual *= size
            loss += _FOLLOWING * residual * residual
            for m in range(first - 1, last):
                u, slope = (v, 1.0) if m < first else (rule.neighbours[m], share)
                gradient[u, axis] += _FOLLOWING * residual * slope
                for n in range(first - 1, last if normal.shape[0] > 0 else first - 1):
                    w, other = (v, 1.0) if n < first else (rule.neighbours[n], share)
                    if w <= u:
                        normal[2 * u + axis, 2 * w + axis] += _FOLLOWING * slope * other
    return loss


@uncounted_kernel
def hold(rule: Rule, unknowns: FloatArray, low: float, high: float) -> None:
    """Move each corner that turns too little, and those beside it, by the least that makes it turn, inside the box.

    One corner after the other, in sweeps, as position-based dynamics do (Müller et al. 2007).
    """
    if rule.triples.shape[0] > 0:
        _hold(rule, unknowns, low, high)


@kernel
def _hold(rule: Rule, unknowns: FloatArray, low: float, high: float) -> None:
    slope = np.empty((3, 2))
    for _sweep in range(_SWEEPS):
        n_short = 0
        for c in range(rule.triples.shape[0]):
            p, q, r = rule.triples[c, 0], rule.triples[c, 1], rule.triples[c, 2]
            ax, ay = unknowns[q, 0] - unknowns[p, 0], unknowns[q, 1] - unknowns[p, 1]
            bx, by = unknowns[r, 0] - unknowns[q, 0], unknowns[r, 1] - unknowns[q, 1]
            lengths = np.sqrt((ax * ax + ay * ay) * (bx * bx + by * by))
            cross = ax * by - ay * bx
            if cross >= rule.asked * lengths:
                continue
            n_short += 1
            slope[0, 0], slope[0, 1] = -by, bx
            slope[1, 0], slope[1, 1] = by + ay, -bx - ax
            slope[2, 0], slope[2, 1] = -ay, ax
            steepness = 0.0
            for i in range(3):
                image = rule.images[rule.triples[c, i]]
                if image == rule.triples[c, i]:
                    slope[i, 0] = 0.0
                elif image == LOCKED:
                    slope[i, 0] = slope[i, 1] = 0.0
                steepness += slope[i, 0] ** 2 + slope[i, 1] ** 2
            if not steepness > 0.0:
                continue
            step = (_BEYOND * rule.asked * lengths - cross) / steepness
            for i in range(3):
                u = rule.triples[c, i]
                x, y = unknowns[u, 0], unknowns[u, 1]
                if slope[i, 0] != 0.0:
                    unknowns[u, 0] = min(max(x + step * slope[i, 0], low), high)
                if slope[i, 1] != 0.0:
                    unknowns[u, 1] = min(max(y + step * slope[i, 1], low), high)
                image = rule.images[u]
                if image >= 0 and image != u:
                    unknowns[image, 0] -= unknowns[u, 0] - x
                    unknowns[image, 1] += unknowns[u, 1] - y
        if n_short == 0:
            return
