"""Drawings of tools: key, wrench, hammer, scissors, padlock, ladder, saw, spade, umbrella, screwdriver, brush."""

from math import radians, sin

from autopoly_env.targets.dice import Dice
from autopoly_env.targets.pencil import (
    Shape,
    arc,
    bar,
    box,
    curve,
    disc,
    mirrored,
    move,
    polygon,
    ring,
    round_off,
    stroke,
    turn,
    turned,
    union,
)


def key(dice: Dice) -> Shape:
    """A key: a bow with a hole, a shaft, a bit at its end."""
    bow, long, thick = dice.between(13, 21), dice.between(45, 75), dice.between(5, 8.5)
    end = bow + long
    parts = [_bow(dice, bow), box(bow - 3, -0.5 * thick, end, 0.5 * thick), _bit(dice, end, thick)]
    if dice.chance(0.5):
        for x in (bow + 2, bow + 8)[: dice.whole(1, 2)]:
            parts.append(box(x, -0.5 * thick - 2.5, x + 3.5, 0.5 * thick + 2.5, 1))
    return union(*parts)


def _bow(dice: Dice, bow: float) -> Shape:
    """What the fingers hold, about the origin."""
    match dice.pick(("ring", "disc", "clover", "square")):
        case "ring":
            head = disc(0, 0, bow, bow * dice.between(0.8, 1.2))
            head -= head.buffer(-dice.between(4, 0.45 * bow))
        case "disc":
            head = disc(0, 0, bow) - disc(-bow * dice.between(0.3, 0.5), 0, dice.between(3, 0.35 * bow))
        case "clover":
            width = dice.between(3.5, 4.5)
            lobes = [ring(0.75 * bow * x, 0.75 * bow * y, 0.55 * bow, width) for x, y in _CLOVER]
            head = union(*lobes, disc(0, 0, 0.3 * bow), box(0, -3, bow, 3))
        case _:
            head = box(-bow, -bow * 0.9, bow, bow * 0.9, dice.between(2, 8))
            head -= box(-bow + 5, -4, -bow + 5 + dice.between(5, 9), 4, dice.between(0, 4))
    return head


_CLOVER = ((-1.0, 0.0), (0.1, -0.95), (0.1, 0.95))


def _bit(dice: Dice, end: float, thick: float) -> Shape:
    """The teeth of a key whose shaft ends at x = `end`: a flag with notches, or a row of teeth."""
    if dice.chance(0.4):
        wide, tall = dice.between(14, 20), dice.between(12, 17)
        flag = box(end - wide - 3, 0, end - 3, tall + 0.5 * thick)
        if dice.chance(0.6):
            x = end - 3 - wide * dice.between(0.35, 0.65)
            return flag - box(x - 1.7, 0.5 * thick + tall - dice.between(5, 9), x + 1.7, 99)
        y = 0.5 * thick + tall * dice.between(0.3, 0.45)
        return flag - box(end - 3 - 0.6 * wide, y, end, y + 3.2)
    x, teeth = end, [box(end - 1, -0.5 * thick, end, 0.5 * thick)]
    for _ in range(dice.whole(2, 4)):
        wide = dice.between(3.5, 6)
        teeth.append(box(x - wide, 0, x, 0.5 * thick + dice.between(4, 12)))
        x -= wide + dice.between(2.8, 4)
    return union(*teeth)


def wrench(dice: Dice) -> Shape:
    """A wrench: an open jaw, and at the other end a second jaw, a ring or a hole."""
    long, shaft = dice.between(50, 80), dice.between(6, 11)
    parts = [bar((0, 0), (long, 0), shaft, shaft * dice.between(0.8, 1.2)), _jaw(dice, shaft)]
    far = dice.pick(("jaw", "ring", "ring", "plain"))
    if far == "jaw":
        parts.append(move(turn(_jaw(dice, shaft), 180), long, 0))
    elif far == "plain":
        parts.append(disc(long, 0, 0.75 * shaft))
    shape = union(*parts)
    if far == "ring":
        outer = dice.between(0.85, 1.3) * shaft + 3
        n = dice.pick((6, 6, 40))
        hole = polygon(*arc(long, 0, outer - 4, outer - 4, 0, 360 - 360 / n, n - 1))
        return union(shape, disc(long, 0, outer)) - hole
    return shape - disc(long, 0, 0.3 * shaft) if far == "plain" else shape


def _jaw(dice: Dice, shaft: float) -> Shape:
    """The open end of a wrench at the origin, its mouth to the left."""
    size = max(12.0, shaft * dice.between(1.4, 1.9))
    mouth = size * dice.between(0.4, 0.5)
    gap = union(box(-2 * size, -mouth, 0, mouth), polygon(*arc(0, 0, mouth, mouth, -90, 90)))
    head = disc(0, 0, size, size * dice.between(0.95, 1.15)) - move(gap, -size * dice.between(0.1, 0.35), 0)
    return turn(head, dice.pick((0, 15, -15)))


def hammer(dice: Dice) -> Shape:
    """A hammer upright, its head above: with a claw, a peen, or two faces."""
    long, width, head = dice.between(65, 95), dice.between(6, 9), dice.between(11, 17)
    grip = width * dice.between(1.0, 1.5)
    handle = turned((0.4 * width, -long), (0.45 * width, -0.5 * long), (0.5 * grip, -0.1 * long), (0.45 * grip, 0))
    top, face, rim = -long - 0.5 * head, dice.between(17, 24), dice.between(0, 1.5)
    parts = [handle, box(-8, top, 8, top + head), box(7, top + 2, face, top + head - 2)]
    parts.append(box(face - 1, top - rim, face + dice.between(6, 9), top + head + rim, 1))
    match dice.pick(("claw", "claw", "peen", "mallet")):
        case "claw":
            reach, drop = dice.between(24, 34), dice.between(8, 22)
            over = curve([(-6, top), (-0.6 * reach, top + 1), (-reach, top + drop)])
            under = curve([(-reach, top + drop), (-0.55 * reach, top + 0.75 * head), (-6, top + head)])
            parts.append(polygon(*over, *under))
        case "peen":
            reach = dice.between(18, 28)
            parts.append(polygon((-7, top), (-reach, top + 0.3 * head), (-reach, top + 0.6 * head), (-7, top + head)))
        case _:
            wide, tall = dice.between(24, 34), dice.between(20, 30)
            parts.append(box(-wide, top - 2, wide, top - 2 + tall, dice.between(1, 5)))
    return union(*parts)


def scissors(dice: Dice) -> Shape:
    """Open scissors, the points above."""
    angle, blade, handle = dice.between(12, 32), dice.between(48, 66), dice.between(18, 28)
    wide, loop = dice.between(7, 10), dice.between(10, 14)
    tall = loop * dice.between(1.0, 1.4)
    side = [(-0.45 * wide, 4), (-0.5 * wide, -0.5 * blade), (0.45 * wide, -blade), (0.5 * wide, 4)]
    bow = turn(disc(0, 0, loop, tall), dice.between(-20, 20))
    bow -= bow.buffer(-dice.between(3.5, 5))
    shift = max(loop + 1.8 - handle * sin(radians(angle)), 0.0)  # the two loops stay apart
    shank = bar((0, 0), (0.6 * shift, handle + 2), 0.8 * wide)
    shape = mirrored(turn(union(polygon(*side), shank, move(bow, shift, handle + tall - 2)), -angle))
    return shape - disc(0, 0, 1.7) if dice.chance(0.3) else shape


def padlock(dice: Dice) -> Shape:
    """A padlock, closed or open, with or without a keyhole."""
    half, tall, thick = dice.between(24, 34), dice.between(38, 54), dice.between(5, 9)
    match dice.pick(("box", "box", "round", "shield")):
        case "box":
            body = box(-half, 0, half, tall, dice.between(1, 12))
        case "round":
            body = union(disc(0, 0.5 * tall, half + 2, 0.55 * tall), box(-0.7 * half, 0, 0.7 * half, 0.4 * tall))
        case _:
            body = union(box(-half, 0, half, 0.5 * tall, 3), polygon(*arc(0, 0.45 * tall, half, 0.6 * tall, 0, 180)))
    x, rise = half * dice.between(0.5, 0.68), dice.between(6, 22)
    bow = arc(0, -rise, x, x * dice.between(0.9, 1.1), 180, 360)
    closed = dice.chance(0.7)
    right = [(x, 8)] if closed else [(x, -rise + dice.between(2, rise - 3))]
    shape = union(body, stroke([(-x, 8), *bow, *right], thick, "flat"))
    if dice.chance(0.7):
        y, r = tall * dice.between(0.4, 0.5), dice.between(4, 6)
        slot = polygon((-0.45 * r, y), (0.45 * r, y), (r * 0.8, y + 2.6 * r), (-r * 0.8, y + 2.6 * r))
        shape -= union(disc(0, y, r), slot)
    return shape


def ladder(dice: Dice) -> Shape:
    """A ladder, or a stepladder from the side."""
    return _stepladder(dice) if dice.chance(0.25) else _straight_ladder(dice)


def _stepladder(dice: Dice) -> Shape:
    height, spread, rail, n = dice.between(60, 80), dice.between(20, 30), dice.between(4, 6), dice.whole(3, 5)
    parts = [bar((0, -height), (-spread, 0), rail), bar((0, -height), (spread, 0), 0.8 * rail)]
    parts.append(box(-8, -height - 2, 5, -height + 3))
    rung = dice.between(3, 4.5)
    for i in range(1, n + 1):
        x, y = -spread * i / (n + 1), -height * (1 - i / (n + 1))
        parts.append(box(x - 8, y, x, y + rung))
    y = -height * dice.between(0.3, 0.5)
    x = spread * (1 + y / height)
    return union(*parts, box(-x, y, x, y + 3))


def _straight_ladder(dice: Dice) -> Shape:
    height, rail, rung = dice.between(80, 110), dice.between(3.5, 6), dice.between(3, 5)
    half, n = dice.between(12, 22), dice.whole(4, 8)
    narrow = half * dice.between(0.6, 1.0)
    shape = mirrored(bar((narrow, -height), (half, 0), rail))
    step = height / (n + dice.between(0.2, 0.8))
    ys = [-height + step * (i + 0.6) for i in range(n)]
    rungs = [(narrow + (half - narrow) * (1 + y / height), y) for y in ys]
    return union(shape, *(box(-x, y - 0.5 * rung, x, y + 0.5 * rung) for x, y in rungs))


def saw(dice: Dice) -> Shape:
    """A handsaw: a tapered blade with teeth below, a handle with a hole at the right."""
    long, tall, tip, n = dice.between(70, 90), dice.between(22, 32), dice.between(8, 15), dice.whole(7, 13)
    deep, step = dice.between(3.5, 5), long / n
    lean = dice.pick((0.5, 0.9))
    teeth = [p for i in range(n) for p in ((i * step, tall), ((i + lean) * step, tall + deep))]
    blade = polygon((0, tall - tip), (long, 0), (long + 5, tall), *reversed(teeth))
    x, end = long, tall
    grip = polygon((x - 2, -2), (x + 24, -6), (x + 30, 10), (x + 24, end + 8), (x - 2, end))
    hole = polygon((x + 7, 5), (x + 17, 2), (x + 20, 10), (x + 16, end - 2), (x + 7, end - 6))
    return union(blade, round_off(grip, 4)) - round_off(hole, 2)


def spade(dice: Dice) -> Shape:
    """A spade, shovel or garden fork, its blade below."""
    long, width, half, tall = dice.between(40, 65), dice.between(5, 7), dice.between(13, 20), dice.between(28, 40)
    parts = [box(-0.5 * width, -long, 0.5 * width, 6), _spade_blade(dice, half, tall)]
    if dice.chance(0.65):
        wide, high = dice.between(9, 12), dice.between(13, 18)
        grip = polygon((-wide, -long - high), (wide, -long - high), (3, -long + 3), (-3, -long + 3))
        parts.append(round_off(grip, 2) - round_off(grip.buffer(-3.4, join_style="mitre"), 1))
    else:
        parts.append(box(-dice.between(9, 12), -long - 3, dice.between(9, 12), -long + 3, 3))
    return union(*parts)


def _spade_blade(dice: Dice, half: float, tall: float) -> Shape:
    """What goes into the earth, from y = 0 down."""
    match dice.pick(("square", "pointed", "round", "fork")):
        case "square":
            return turned((half, 0), (0.85 * half, tall))
        case "pointed":
            return turned(
                (half, 0), *curve([(half, 2), (half, 0.5 * tall), (0.6 * half, 0.8 * tall), (0, 1.05 * tall)])
            )
        case "round":
            return union(box(-half, 0, half, 0.5 * tall, 3), disc(0, 0.5 * tall, half, 0.55 * tall))
    n, tine = dice.whole(3, 4), dice.between(3.4, 4.4)
    xs = [-half + 0.5 * tine + (2 * half - tine) * i / (n - 1) for i in range(n)]
    return union(box(-half, 0, half, 6, 2), *(bar((x, 2), (x, tall), tine, 2.6) for x in xs))


def umbrella(dice: Dice) -> Shape:
    """An open umbrella, upright, its handle bent."""
    half, rise, n = dice.between(42, 52), dice.between(24, 42), dice.whole(3, 6)
    canopy = polygon(*arc(0, 0, half, rise, 180, 360, 32))
    sag = dice.between(2, 7)
    if dice.chance(0.75):
        step = 2 * half / n
        canopy -= union(*(disc(-half + (i + 0.5) * step, 0.5, 0.5 * step - 0.4, sag) for i in range(n)))
    width, long, bend = dice.between(3, 5), dice.between(38, 58), dice.between(6, 11)
    side = dice.pick((-1, 1))
    hook = [(side * (bend + x), long + y) for x, y in arc(0, 0, -bend, bend, 0, dice.between(150, 190), 12)]
    stick = stroke([(0, -rise), *hook], width)
    tip = box(-0.5 * width, -rise - dice.between(4, 10), 0.5 * width, -rise + 2)
    return union(canopy, stick, tip)


def screwdriver(dice: Dice) -> Shape:
    """A screwdriver or a chisel, its handle above."""
    grip, wide, long = dice.between(32, 48), dice.between(7, 11), dice.between(38, 65)
    waist = wide * dice.between(0.6, 0.9)
    profile = [(0.75 * wide, -grip), (wide, -0.85 * grip), (wide, -0.35 * grip), (waist, -0.12 * grip), (0.8 * wide, 0)]
    parts = [round_off(turned(*profile, smooth=dice.chance(0.5)), 2)]
    thin = dice.between(2.2, 3.6)
    match dice.pick(("flat", "flat", "cross", "chisel")):
        case "flat":
            parts += [box(-thin, -2, thin, long), turned((thin, long - 14), (2 * thin, long - 6), (1.6 * thin, long))]
        case "cross":
            parts.append(turned((thin, -2), (thin, long), (1.3, long + 1.4 * thin)))
        case _:
            blade = dice.between(5, 8)
            parts.append(turned((thin, -2), (thin, 0.3 * long), (blade, 0.4 * long), (blade, long)))
    return union(*parts)


def brush(dice: Dice) -> Shape:
    """A paint brush or a broom, its bristles below."""
    return _broom(dice) if dice.chance(0.4) else _paint_brush(dice)


def _broom(dice: Dice) -> Shape:
    long, half, thick = dice.between(60, 78), dice.between(16, 24), dice.between(5, 8)
    top = thick + dice.pick((-0.1, 2.8))  # where the bristles begin: at the head, or a little below
    bristles = turned((half - 1, top), (half + dice.between(0, 6), top + dice.between(14, 24)))
    return union(box(-2, -long, 2, top + 5, 2), box(-half, 0, half, thick, 2), bristles)


def _paint_brush(dice: Dice) -> Shape:
    half, long, grip = dice.between(13, 26), dice.between(40, 60), dice.between(4.5, 7)
    handle = turned((0.6 * grip, -long), (grip, -0.75 * long), (0.7 * grip, -0.3 * long), (0.9 * half, 0), smooth=True)
    if dice.chance(0.5):
        handle -= disc(0, -0.88 * long, 0.4 * grip)
    band, gap, tall = dice.between(9, 14), dice.pick((-0.1, 3.0)), dice.between(22, 36)
    ferrule = box(-half, -1, half, band)
    y, slant = band + gap, dice.pick((0.0, dice.between(3, 9)))
    hair = polygon((-half + 1, y), (half - 1, y), (half, y + tall - slant), (-half, y + tall))
    return union(handle, ferrule, hair)
