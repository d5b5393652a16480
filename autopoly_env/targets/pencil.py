"""What the drawings of things are put together from: boxes, discs, strokes, curves, turned profiles.

A drawing has an origin and a unit of its own; x points right, y down. The things here are about 100 units across, and
nothing in them is meant to be thinner than 2.5.
"""

from collections.abc import Sequence
from math import cos, hypot, radians, sin

import shapely
from shapely import affinity
from shapely.geometry.base import BaseGeometry as Shape

__all__ = [
    "Point", "Shape", "arc", "bar", "blob", "box", "curve", "disc", "flip", "mirrored", "move", "polygon", "ring",
    "round_off", "stroke", "turn", "turned", "union",
]  # fmt: skip

Point = tuple[float, float]
QUARTER = 8  # pieces of a quarter of a circle, where Shapely draws it


def polygon(*corners: Point) -> Shape:
    """The inside of a ring of corners that does not cross itself."""
    return shapely.Polygon(corners)


def box(x0: float, y0: float, x1: float, y1: float, radius: float = 0.0) -> Shape:
    """An upright rectangle, its corners rounded (by at most half a side) where a radius is given."""
    r = min(radius, 0.5 * (x1 - x0), 0.5 * (y1 - y0))
    if r <= 0.0:
        return shapely.box(x0, y0, x1, y1)
    centres = ((x1 - r, y1 - r), (x0 + r, y1 - r), (x0 + r, y0 + r), (x1 - r, y0 + r))
    return polygon(*(p for i, (x, y) in enumerate(centres) for p in arc(x, y, r, r, 90 * i, 90 * i + 90, 6)))


def arc(x: float, y: float, rx: float, ry: float, start: float, end: float, n_steps: int = 16) -> list[Point]:
    """Points on an ellipse about (x, y); angles in degrees, from three o'clock by way of six."""
    angles = [radians(start + (end - start) * i / n_steps) for i in range(n_steps + 1)]
    return [(x + rx * cos(a), y + ry * sin(a)) for a in angles]


def disc(x: float, y: float, rx: float, ry: float | None = None) -> Shape:
    """An ellipse; a circle where only one radius is given."""
    return polygon(*arc(x, y, rx, rx if ry is None else ry, 0, 360, 40)[:-1])


def ring(x: float, y: float, radius: float, width: float) -> Shape:
    """A circular band; `radius` is the outer one."""
    return disc(x, y, radius) - disc(x, y, radius - width)


def stroke(points: Sequence[Point], width: float, ends: str = "round") -> Shape:
    """A line along the points, with round joints; its ends are "round", "flat" or "square"."""
    return shapely.LineString(points).buffer(0.5 * width, QUARTER, cap_style=ends)


def bar(a: Point, b: Point, width: float, width_b: float | None = None) -> Shape:
    """A straight piece from a to b with square ends, `width` wide at a and `width_b` (the same) at b."""
    length = hypot(b[0] - a[0], b[1] - a[1])
    nx, ny = (a[1] - b[1]) / length, (b[0] - a[0]) / length
    u, v = 0.5 * width, 0.5 * (width if width_b is None else width_b)
    corners = (a[0] + u * nx, a[1] + u * ny), (b[0] + v * nx, b[1] + v * ny)
    return polygon(*corners, (b[0] - v * nx, b[1] - v * ny), (a[0] - u * nx, a[1] - u * ny))


def curve(points: Sequence[Point], closed: bool = False, n_steps: int = 6) -> list[Point]:
    """A smooth line (Catmull-Rom) through the points."""
    ends = (points[-1], points[0], points[1]) if closed else (points[0], points[-1])
    knots = [ends[0], *points, *ends[1:]]
    line = [
        (_between(a[0], b[0], c[0], d[0], i / n_steps), _between(a[1], b[1], c[1], d[1], i / n_steps))
        for a, b, c, d in zip(knots, knots[1:], knots[2:], knots[3:], strict=False)
        for i in range(n_steps)
    ]
    return line if closed else [*line, points[-1]]


def _between(a: float, b: float, c: float, d: float, t: float) -> float:
    """The Catmull-Rom polynomial from b (t = 0) to c (t = 1)."""
    return 0.5 * (2 * b + t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * b - a - 3 * c + d))))


def blob(*points: Point) -> Shape:
    """The inside of a smooth closed line through the points."""
    return polygon(*curve(points, closed=True))


def turned(*profile: Point, smooth: bool = False) -> Shape:
    """What a lathe makes: a profile of (radius, y) from top to bottom, and its mirror image about x = 0."""
    side = curve(profile) if smooth else list(profile)
    return polygon(*side, *((-x, y) for x, y in reversed(side))).buffer(0)


def union(*shapes: Shape) -> Shape:
    """Everything that is in one of the shapes."""
    return shapely.union_all(shapes)


def flip(shape: Shape) -> Shape:
    """The mirror image about x = 0."""
    return affinity.scale(shape, -1.0, 1.0, origin=(0.0, 0.0))


def mirrored(shape: Shape) -> Shape:
    """The shape and its mirror image about x = 0."""
    return union(shape, flip(shape))


def turn(shape: Shape, degrees: float) -> Shape:
    """The shape turned about the origin, from three o'clock towards six."""
    return affinity.rotate(shape, degrees, origin=(0.0, 0.0))


def move(shape: Shape, x: float, y: float) -> Shape:
    """The shape shifted."""
    return affinity.translate(shape, x, y)


def round_off(shape: Shape, radius: float) -> Shape:
    """The shape with its outer corners rounded; what is thinner than twice the radius goes."""
    return shape.buffer(-radius, QUARTER).buffer(radius, QUARTER)
