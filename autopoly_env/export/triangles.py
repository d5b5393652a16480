"""Cutting n-gons into triangles, for formats that know nothing else."""

from collections.abc import Sequence

Point = Sequence[float]
Triangle = tuple[int, int, int]
TINY = 1e-12  # twice an area, in squares of the unit square: what rounding makes of a straight corner


def triangulate(ring: Sequence[Point]) -> list[Triangle]:
    """A face with the corners `ring` (n >= 3 points x, y, wound either way) as n - 2 triangles wound alike.

    Ears are clipped, so that concave faces come out right; each side of the ring is a side of one triangle, whatever
    the shape is. Where no ear is left, as in a face that crosses itself, the corner of largest area goes: the signed
    areas add up to the face's in any case.

    >>> triangulate([(2, 0), (0.5, 0.5), (0, 2), (0, 0)])  # an arrow head: a fan from its first corner would be wrong
    [(3, 0, 1), (1, 2, 3)]
    """
    left = list(range(len(ring)))
    if sum(_area(ring[0], ring[k], ring[k + 1]) for k in left[1:-1]) < 0.0:
        ring = [(-x, y) for x, y in ring]
    triangles = []
    while len(left) > 3:
        at = _ear(ring, left)
        triangles.append((left[at - 1], left[at], left[(at + 1) % len(left)]))
        del left[at]
    return [*triangles, (left[0], left[1], left[2])]


def is_concave(ring: Sequence[Point]) -> bool:
    """Whether a corner of the face turns the other way than the face runs; straight corners do not."""
    n = len(ring)
    turns = [_area(ring[k - 1], ring[k], ring[(k + 1) % n]) for k in range(n)]
    area = sum(_area(ring[0], ring[k], ring[k + 1]) for k in range(1, n - 1))
    return min(turns) < -TINY if area > 0.0 else max(turns) > TINY


def _ear(ring: Sequence[Point], left: list[int]) -> int:
    """The position of the corner to clip."""
    n = len(left)
    areas = [_area(ring[left[k - 1]], ring[left[k]], ring[left[(k + 1) % n]]) for k in range(n)]
    reflex = [k for k in range(n) if areas[k] <= 0.0]  # no other corner can lie in an ear
    for k in sorted(range(n), key=lambda k: -areas[k]):
        if areas[k] <= 0.0:
            break
        beside = (k, (k - 1) % n, (k + 1) % n)
        a, b, c = (ring[left[i]] for i in (beside[1], k, beside[2]))
        others = (ring[left[i]] for i in reflex if i not in beside)
        if not any(_holds(a, b, c, p) for p in others if p not in (a, b, c)):  # a ring may touch itself in a corner
            return k
    return max(range(n), key=areas.__getitem__)


def _holds(a: Point, b: Point, c: Point, p: Point) -> bool:
    """Whether p lies in the triangle or on its rim."""
    return _area(a, b, p) >= 0.0 and _area(b, c, p) >= 0.0 and _area(c, a, p) >= 0.0


def _area(a: Point, b: Point, c: Point) -> float:
    """Twice the signed area."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
