"""Drawings of what a kitchen and a table hold: mug, bottle, glass, teapot, jug, trophy, pan, pot, cutlery."""

from autopoly_env.targets.dice import Dice
from autopoly_env.targets.pencil import (
    Point,
    Shape,
    arc,
    bar,
    blob,
    box,
    curve,
    disc,
    flip,
    mirrored,
    move,
    polygon,
    ring,
    round_off,
    stroke,
    turned,
    union,
)

_EARS = ("round", "drooping", "square")


def _ear(kind: str, x: float, top: float, bottom: float, reach: float, width: float) -> Shape:
    """A handle to the right of x: a band from (x, top) to (x, bottom) that goes out as far as `reach`."""
    end = x - width
    match kind:
        case "round":
            line = arc(x - 1, 0.5 * (top + bottom), reach, 0.5 * (bottom - top), -90, 90)
        case "drooping":
            knee = (x + reach, top + 0.3 * (bottom - top))
            line = curve([(x, top), (x + 0.75 * reach, top), knee, (x + 0.5 * reach, bottom - 4), (x, bottom)])
        case _:
            line = [(x, top), (x + reach, top), (x + reach, bottom), (x, bottom)]
    return stroke([(end, top), *line, (end, bottom)], width)


def mug(dice: Dice) -> Shape:
    """A mug or cup with its handle, now and then on a saucer."""
    height, half = dice.between(45, 85), dice.between(24, 40)
    foot = half * dice.pick((1.0, 1.0, dice.between(0.55, 0.95)))
    belly = 0.5 * (half + foot) * (dice.between(0.95, 1.15) if foot < half else 1.0)
    body = turned((half, -height), (belly, -0.45 * height), (foot, 0), smooth=True)
    if dice.chance(0.6):
        body = round_off(body, dice.between(2, 9))
    top, bottom = -height * dice.between(0.75, 0.9), -height * dice.between(0.15, 0.4)
    x = min(half, foot) + 0.5 * (half - min(half, foot))
    parts = [body, _ear(dice.pick(_EARS), x, top, bottom, dice.between(17, 26), dice.between(5, 9))]
    if dice.chance(0.25):
        wide = half * dice.between(1.5, 1.8)
        low = dice.pick((0.0, 4.0))  # the saucer may be a part of its own
        parts.append(polygon((-wide, low), (wide, low), (wide - 8, low + 6), (-wide + 8, low + 6)))
    if dice.chance(0.2):
        xs = (-0.4 * half, 0.1 * half, 0.6 * half)[: dice.whole(2, 3)]
        top = -height - 8
        parts += [stroke(curve([(x, top), (x + 3, top - 7), (x - 3, top - 14), (x, top - 20)]), 4) for x in xs]
    return union(*parts)


def bottle(dice: Dice) -> Shape:
    """A bottle: round or sloping shoulders, a long neck or a short one, with or without a cap."""
    height, half = dice.between(55, 85), dice.between(12, 24)
    neck, long = max(3.5, half * dice.between(0.25, 0.5)), dice.between(8, 35)
    shoulder = -height + dice.between(0.02, 0.35) * height
    foot = half * dice.pick((1.0, 1.0, dice.between(0.75, 0.95)))
    if dice.chance(0.65):
        bulge = 0.5 * (half + neck)
        slope = curve([(neck, -height - long), (neck, -height), (bulge, 0.5 * (shoulder - height)), (half, shoulder)])
        side = [*slope, (half, -2), (foot, 0)]
        body = turned(*side)
    else:
        waist = half * dice.between(0.75, 1.0)
        belly = [(half, shoulder), (waist, -0.45 * height), (half, -0.2 * height), (foot, 0)]
        body = turned((neck, -height - long), (neck, -height), *belly, smooth=True)
    if dice.chance(0.5):
        body = round_off(body, min(3.0, 0.8 * neck))
    lip, rim = neck + dice.between(1, 3), -height - long
    match dice.pick(("lip", "cap", "none")):
        case "lip":
            return union(body, box(-lip, rim, lip, rim + dice.between(3, 5), 1))
        case "cap":
            gap = dice.pick((-1.0, 3.0))
            return union(body, box(-lip, rim - gap - dice.between(6, 10), lip, rim - gap, 1))
    return body


def glass(dice: Dice) -> Shape:
    """A glass with a stem, or a tumbler; the drink in it may show as a hole."""
    half, bowl, stem = dice.between(16, 30), dice.between(26, 50), dice.between(20, 45)
    thin, foot = dice.between(1.6, 3), dice.between(12, 22)
    top = -bowl - stem
    match dice.pick(("wine", "wine", "cone", "flute", "tumbler")):
        case "wine":
            wide = half * dice.between(1.0, 1.25)
            cup = curve([(half, top), (wide, top + 0.45 * bowl), (0.6 * wide, top + 0.85 * bowl), (thin, -stem + 2)])
        case "cone":
            cup = [(half * 1.3, top), (thin, -stem)]
        case "flute":
            cup = curve([(0.5 * half, top - 10), (0.55 * half, top + 0.4 * bowl), (thin, -stem)])
        case _:
            slim = half * dice.between(0.6, 0.95)
            body = turned((half, -bowl - 12), (slim, 0))
            return _drink(dice, body, -bowl - 12, -4) if dice.chance(0.7) else body
    shape = turned(*cup, (thin, -8), (0.4 * foot, -4), (foot, -3), (foot, 0))
    return _drink(dice, shape, cup[0][1], -stem - 6) if dice.chance(0.4) else shape


def _drink(dice: Dice, body: Shape, top: float, bottom: float) -> Shape:
    """The glass with a hole that leaves a wall: above a level, or below it."""
    wall, level = dice.between(2.5, 3.5), top + dice.between(0.25, 0.6) * (bottom - top)
    inside = body.buffer(-wall, join_style="mitre")
    low, high = (level, bottom) if dice.chance(0.5) else (top + wall, level)
    hole = round_off(inside & box(-100, low, 100, high), 1.5)
    return body - hole


def teapot(dice: Dice) -> Shape:
    """A teapot: body, lid, spout at the left, handle at the right or above."""
    half, height = dice.between(28, 38), dice.between(42, 62)
    middle = -height * dice.between(0.4, 0.6)
    opening, foot = half * dice.between(0.4, 0.6), half * dice.between(0.5, 0.75)
    shoulders = [(opening, -height), (0.9 * half, middle - 0.25 * height), (half, middle)]
    body = turned(*shoulders, (0.85 * half, -0.15 * height), (foot, 0), smooth=True)
    lid = polygon(*arc(0, -height + 1, opening * dice.between(0.8, 1.05), dice.between(5, 13), 180, 360))
    knob = disc(0, lid.bounds[1] - 2, dice.between(3.5, 5.5))
    tip = (-half - dice.between(16, 28), -height * dice.between(0.75, 1.05))
    low, bend = (-half * 0.75, -height * dice.between(0.15, 0.3)), dice.between(0.3, 0.6)
    knee = (low[0] + bend * (tip[0] - low[0]), low[1] + 0.25 * (tip[1] - low[1]))
    wide, narrow = dice.between(12, 18), dice.between(4.5, 7)
    spout = _tapered([(0.0, low[1] - 0.5 * wide), (low[0], low[1] - 3), knee, tip], wide, narrow)
    parts = [body, lid, knob, spout]
    width = dice.between(4.5, 8)
    if dice.chance(0.25):
        reach = dice.between(0.75, 0.95) * half
        rise = dice.between(30, 40)
        parts.append(stroke(arc(0, -0.75 * height, reach, rise + 0.25 * height, 180, 360), width))
    else:
        parts.append(_ear(dice.pick(_EARS), 0.8 * half, -0.85 * height, -0.25 * height, dice.between(22, 32), width))
    return union(*parts)


def _tapered(points: list[Point], width: float, width_end: float) -> Shape:
    """A smooth band along the points that changes its width evenly."""
    line = curve(points)
    n = len(line) - 1
    widths = [width + (width_end - width) * i / n for i in range(n + 1)]
    bars = [bar(line[i], line[i + 1], widths[i], widths[i + 1]) for i in range(n)]
    return union(*bars, *(disc(x, y, 0.5 * w) for (x, y), w in zip(line[1:-1], widths[1:-1], strict=True)))


def jug(dice: Dice) -> Shape:
    """A jug with one handle and a lip, or a vase with two handles."""
    height, half = dice.between(70, 100), dice.between(22, 36)
    neck, foot = half * dice.between(0.4, 0.75), half * dice.between(0.45, 0.8)
    rim = neck * dice.between(1.1, 1.5)
    belly = -height * dice.between(0.3, 0.55)
    body = turned((rim, -height), (neck, -0.8 * height), (half, belly), (foot, -2), (foot, 0), smooth=True)
    parts = [body, box(-foot - 1, -4, foot + 1, 0)]
    reach, width = half - neck + dice.between(12, 20), dice.between(4.5, 7)
    ear = _ear(dice.pick(_EARS), neck, -0.88 * height, belly - 2, reach, width)
    parts.append(ear)
    if dice.chance(0.35):
        parts.append(flip(ear))
    elif dice.chance(0.7):
        parts.append(polygon((-0.3 * rim, -height), (-rim - dice.between(6, 13), -height - 4), (-neck, -0.78 * height)))
    return union(*parts)


def pan(dice: Dice) -> Shape:
    """A frying pan from above."""
    radius, long, width = dice.between(25, 34), dice.between(38, 60), dice.between(6, 10)
    end = radius + long
    grip = union(bar((radius - 3, 0), (end, 0), 0.7 * width, 1.2 * width), disc(end, 0, 0.6 * width))
    shape = union(disc(0, 0, radius), grip) - disc(end - 2, 0, 0.3 * width)
    if dice.chance(0.5):
        shape -= ring(0, 0, radius - dice.between(4, 6), 3) & box(-99, -99, 99, dice.pick((-8, 99)))
    return shape


def pot(dice: Dice) -> Shape:
    """A pot with a lid, and two handles or a long one."""
    half, height, wall = dice.between(30, 40), dice.between(28, 50), dice.between(0, 5)
    body = round_off(turned((half, -height), (half - wall, 0)), dice.between(2, 6))
    gap = dice.pick((-1.0, 3.0))
    lid = polygon(*arc(0, -height - gap, half + 2, dice.between(8, 14), 180, 360))
    parts = [body, lid, disc(0, lid.bounds[1] - 2, dice.between(3.5, 5))]
    y = -height * dice.between(0.6, 0.8)
    if dice.chance(0.5):
        lug = stroke([(half - 4, y), (half + 9, y), (half + 9, y + 10), (half - 4, y + 10)], 4.5)
        return union(*parts, lug, flip(lug))
    return union(*parts, bar((half - 3, y), (half + dice.between(30, 45), y - dice.between(0, 8)), 6, 8))


def trophy(dice: Dice) -> Shape:
    """A cup to win: a bowl with two handles on a foot."""
    half, bowl, stem = dice.between(22, 30), dice.between(38, 54), dice.between(12, 24)
    foot, tall, thin = half * dice.between(0.55, 0.95), dice.between(7, 14), dice.between(3, 5)
    waist, low = half * dice.between(0.7, 1.0), -tall - stem
    side = [(half, low - bowl), (waist, low - 0.45 * bowl), (thin, low), (thin, -tall - 4), (0.6 * foot, -tall + 1)]
    cup = turned(*side, smooth=dice.chance(0.7))
    lip = half + dice.between(0, 4)
    parts = [cup, box(-foot, -tall, foot, 0, dice.pick((0, 2))), box(-lip, low - bowl - 3, lip, low - bowl + 3)]
    top, end = low - bowl * dice.between(0.85, 0.95), low - bowl * dice.between(0.25, 0.4)
    ear = _ear(dice.pick(_EARS[:2]), 0.9 * waist, top, end, half - 0.9 * waist + dice.between(12, 19), 5)
    parts.append(mirrored(ear))
    return union(*parts)


def cutlery(dice: Dice) -> Shape:
    """A fork, a spoon or a knife; now and then two of them side by side."""
    pieces = [_fork, _spoon, _knife]
    first = pieces.pop(dice.whole(0, 2))(dice)
    if dice.chance(0.5):
        return first
    return union(first, move(dice.pick(pieces)(dice), dice.between(30, 36), 0))


def _handle(dice: Dice) -> Shape:
    """Upright, from y = -50 down to 0."""
    thin, end = dice.between(2, 3), dice.between(3.5, 6)
    return round_off(turned((thin, -52), (thin, -35), (end, -5), (end, 0)), 1.9)


def _fork(dice: Dice) -> Shape:
    half, tine, n = dice.between(10, 13), dice.between(22, 32), dice.whole(3, 4)
    width = 2 * half / (2 * n - 1.2)
    step = (2 * half - width) / (n - 1)
    tines = [box(-half + i * step, -64 - tine, -half + i * step + width, -58, 0.5 * width) for i in range(n)]
    palm = blob((-half, -64), (half, -64), (half * 0.8, -54), (2, -48), (-2, -48), (-half * 0.8, -54))
    return union(_handle(dice), palm, box(-half, -66, half, -60), *tines)


def _spoon(dice: Dice) -> Shape:
    return union(_handle(dice), disc(0, -50 - dice.between(12, 16), dice.between(10, 14), dice.between(17, 22)))


def _knife(dice: Dice) -> Shape:
    wide, long = dice.between(5, 7), dice.between(38, 52)
    blade = curve([(wide, -50), (wide, -50 - 0.5 * long), (wide - 2, -50 - 0.85 * long), (-wide + 1, -50 - long)])
    return union(_handle(dice), polygon(*blade, (-wide + 1, -50)))
