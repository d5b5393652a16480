"""Drawings of what fits nowhere else: house, fence, signpost, anchor, guitar, clock, camera, bulb."""

from autopoly_env.targets.dice import Dice
from autopoly_env.targets.pencil import (
    Shape,
    arc,
    bar,
    blob,
    box,
    curve,
    disc,
    mirrored,
    move,
    polygon,
    ring,
    stroke,
    turn,
    turned,
    union,
)


def house(dice: Dice) -> Shape:
    """A house from the front: gable or hipped roof, door, windows, chimney."""
    half, wall, roof, eaves = dice.between(28, 44), dice.between(30, 52), dice.between(20, 38), dice.between(0, 9)
    ridge = dice.pick((0.0, 0.0, dice.between(0.3, 0.6) * half))
    top = -wall - roof
    peak = [(-ridge, top), (ridge, top)] if ridge else [(0, top)]
    parts = [box(-half, -wall - 1, half, 0), polygon((-half - eaves, -wall), *peak, (half + eaves, -wall))]
    if dice.chance(0.55):
        x = half * dice.between(0.4, 0.65)
        parts.append(box(x - 4, top + dice.between(-5, 5), x + 4, -wall))
    shape = union(*parts)
    door, tall = dice.between(6, 9), dice.between(16, 24)
    spot = dice.pick((0.0, -0.5 * half, 0.45 * half))
    if dice.chance(0.8):
        shape -= box(spot - door, -tall, spot + door, 1)
        if dice.chance(0.3):
            shape -= disc(spot, -tall, door, 0.6 * door)
    shape -= _house_windows(dice, half, wall, spot, door)
    if roof > 26 and dice.chance(0.4):
        shape -= disc(0, -wall - 0.35 * roof, dice.between(3.5, 5.5))
    return shape


def _house_windows(dice: Dice, half: float, wall: float, door: float, door_half: float) -> Shape:
    """Windows on one floor or two, none in the way of the door; with or without a cross."""
    wide, tall, crossed = dice.between(4.5, 6.5), dice.between(9, 13), dice.chance(0.35)
    upper, two_floors = -wall + 4, wall > 42 and dice.chance(0.7)
    spots = [(x, upper) for x in (-0.6 * half, 0.0, 0.6 * half) if two_floors or abs(x - door) > wide + door_half + 3]
    if two_floors:
        lower = upper + tall + 6
        spots += [(x, lower) for x in (-0.6 * half, 0.0, 0.6 * half) if abs(x - door) > wide + door_half + 3]
    pane = box(-wide, 0, wide, tall)
    if crossed:
        pane -= union(box(-1.4, 0, 1.4, tall), box(-wide, 0.5 * tall - 1.4, wide, 0.5 * tall + 1.4))
    return union(*(move(pane, *spot) for spot in spots))


def fence(dice: Dice) -> Shape:
    """A fence: pickets or posts on two or three rails."""
    n, width, gap, height = dice.whole(4, 8), dice.between(6, 11), dice.between(4, 9), dice.between(45, 70)
    tip = dice.pick((0.0, dice.between(4, 8), -1.0))
    step = width + gap
    pickets = []
    for i in range(n):
        x = i * step
        pickets.append(box(x, -height, x + width, 0))
        if tip > 0:
            pickets.append(polygon((x, -height + 0.1), (x + 0.5 * width, -height - tip), (x + width, -height + 0.1)))
        elif tip < 0:
            pickets.append(disc(x + 0.5 * width, -height, 0.5 * width))
    out, rail = dice.pick((-0.5 * width, gap * 0.7)), dice.between(4.5, 7)
    levels = dice.pick(((0.22, 0.72), (0.3, 0.78), (0.18, 0.5, 0.82)))
    rails = [box(-out, -y * height - 0.5 * rail, n * step - gap + out, -y * height + 0.5 * rail) for y in levels]
    return union(*pickets, *rails)


def guitar(dice: Dice) -> Shape:
    """A guitar upright, its neck up: acoustic with a sound hole, or electric with horns."""
    tall, neck, long = dice.between(44, 54), dice.between(2.2, 3.2), dice.between(36, 48)
    head, wide, top = dice.between(12, 16), dice.between(4, 6), -tall - long
    body = dice.pick((_acoustic_body, _acoustic_body, _electric_body))(dice, tall)
    sides = [(neck, top + 1), (wide, top - 3), (0.8 * wide, top - head)]
    parts = [body, box(-neck, top, neck, -0.7 * tall), turned(*reversed(sides))]
    if dice.chance(0.7):
        n = dice.whole(2, 3)
        ys = [top - head * (i + 0.7) / n for i in range(n)]
        parts += [box(-wide - 3, y - 1.3, wide + 3, y + 1.3, 1) for y in ys]
    return union(*parts)


def _acoustic_body(dice: Dice, tall: float) -> Shape:
    """A body with a waist, a sound hole and a bridge, `tall` high."""
    lower, upper = dice.between(19, 25), dice.between(14, 19)
    waist = upper * dice.between(0.62, 0.85)
    shoulder = [(0, -tall), (0.6 * upper, -tall), (upper, -0.83 * tall)]
    hip = [(waist, -0.58 * tall), (lower, -0.25 * tall), (0.6 * lower, -1), (0, 0)]
    body = turned(*shoulder, *hip, smooth=True)
    return body - disc(0, -0.6 * tall, dice.between(4.5, 6.5)) - box(-6.5, -0.22 * tall, 6.5, -0.22 * tall + 3)


def _electric_body(dice: Dice, tall: float) -> Shape:
    """A body with two horns beside the neck, one longer than the other."""
    lower, upper = dice.between(17, 21), dice.between(14, 17)
    waist, joint = dice.between(0.6, 0.75) * lower, -0.8 * tall
    sides = []
    for horn in (dice.between(2, 10), dice.between(-6, 0)):
        tip = [(upper - 4, -tall - horn), (upper + 1, 5 - tall - horn)]
        hip = [(waist, -0.5 * tall), (lower, -0.22 * tall), (0.55 * lower, 0)]
        sides.append([(3, joint), (0.5 * upper, joint), *tip, *hip])
    right, left = sides
    return blob(*right, *((-x, y) for x, y in reversed(left))).buffer(0)


def clock(dice: Dice) -> Shape:
    """A wall clock, an alarm clock, or a wrist watch."""
    radius, band = dice.between(26, 36), dice.between(4, 7)
    hands = [(dice.between(0, 360), 0.5), (dice.between(0, 360), 0.75)]
    inner = radius - band
    strokes = [bar((0, 0), arc(0, 0, inner * s, inner * s, a, a, 1)[0], 3.4) for a, s in hands]
    face = union(ring(0, 0, radius, band), disc(0, 0, 3), *strokes)
    if dice.chance(0.3):
        face = disc(0, 0, radius) - union(*strokes, disc(0, 0, 3))
    match dice.pick(("wall", "alarm", "watch")):
        case "alarm":
            return union(face, _feet_and_bells(dice, radius))
        case "watch":
            wide, strap, taper = 0.62 * radius, dice.between(24, 34), dice.between(0.6, 0.8)
            straps = turned((wide * taper, -radius - strap), (wide, -0.7 * radius))
            straps = union(straps, turn(straps, 180)) - disc(0, 0, radius - 1)
            return union(face, straps, box(radius - 2, -3.5, radius + 5, 3.5, 1))
    return face


def _feet_and_bells(dice: Dice, radius: float) -> Shape:
    """What makes an alarm clock of a clock."""
    foot = bar((0.55 * radius, 0.75 * radius), (0.8 * radius, 1.2 * radius), 5)
    bell = move(turn(polygon(*arc(0, 0, 11, 9, 180, 360)), 38), 0.68 * radius, -0.9 * radius)
    parts = [mirrored(foot), mirrored(bell)]
    if dice.chance(0.5):
        parts += [bar((0, -radius - 8), (0, -radius + 2), 4), box(-5, -radius - 10, 5, -radius - 6)]
    return union(*parts)


def camera(dice: Dice) -> Shape:
    """A camera from the front: its lens a ring or a hole."""
    half, tall = dice.between(38, 48), dice.between(42, 56)
    radius = tall * dice.between(0.3, 0.38)
    x = dice.pick((0.0, 0.0, 0.25 * half))
    bump, rise = dice.between(12, 18), dice.between(6, 11)
    parts = [box(-half, 0, half, tall, dice.between(3, 9))]
    parts.append(polygon((x - bump - 4, 1), (x - bump, -rise), (x + bump, -rise), (x + bump + 4, 1)))
    if dice.chance(0.6):
        parts.append(box(-half + 6, -4, -half + 17, 2, 1))
    lens = dice.pick((disc(x, 0.53 * tall, 0.9 * radius), ring(x, 0.53 * tall, radius, dice.between(3, 6))))
    shape = union(*parts) - lens
    if dice.chance(0.4):
        spot = disc(x, 0.53 * tall, 0.35 * radius)
        shape = shape - spot if spot.within(shape) else union(shape, spot)
    if dice.chance(0.5):
        shape -= box(half - 13, 6, half - 5, 11, 1)
    return shape


def bulb(dice: Dice) -> Shape:
    """A light bulb, its screw below; rays around it may be parts of their own."""
    radius, neck, long = dice.between(24, 32), dice.between(9, 13), dice.between(16, 26)
    side = curve([(0.75 * radius, 0.66 * radius), (neck + 2, radius + 0.5 * long), (neck, radius + long)])
    glass = union(disc(0, 0, radius), turned((0.75 * radius, 0), *side))
    y, gap, n = radius + long, dice.pick((0.0, 2.8)), dice.whole(2, 3)
    threads = [box(-neck, y + i * (4 + gap) + gap, neck, y + i * (4 + gap) + gap + 4.2, 2) for i in range(n)]
    end = y + n * (4 + gap)
    parts = [glass, *threads, box(-0.5 * neck, end + gap, 0.5 * neck, end + gap + 4, 2)]
    if gap:
        parts.append(box(-2, y - 1, 2, end + gap + 2))
    if dice.chance(0.4):
        count, reach = dice.pick((5, 7)), dice.between(9, 14)
        for i in range(count):
            angle = 180 + 180 * i / (count - 1)
            a, b = (arc(0, 0, radius + d, radius + d, angle, angle, 1)[0] for d in (6, 6 + reach))
            parts.append(stroke([a, b], 4.5))
    return union(*parts)


def signpost(dice: Dice) -> Shape:
    """A post with signs that point, or with one sign."""
    height, width = dice.between(80, 105), dice.between(4.5, 7)
    parts = [box(-0.5 * width, -height, 0.5 * width, 0)]
    if dice.chance(0.35):
        half = dice.between(18, 26)
        n = dice.pick((3, 4, 8, 40))
        angle = 90 + 180 / n if n != 3 else -90
        board = polygon(*arc(0, 0, half, half, angle, angle + 360 - 360 / n, n - 1))
        if dice.chance(0.5):
            board -= polygon(*arc(0, 0, half * 0.6, half * 0.6, angle, angle + 360 - 360 / n, n - 1))
        return union(*parts, move(board, 0, -height + (0.2 * half if n == 3 else 0)))
    y = -height + 4
    for _ in range(dice.whole(1, 3)):
        tall, reach, back = dice.between(12, 17), dice.between(26, 38), dice.between(8, 26)
        side = dice.pick((-1, 1))
        corners = [(-back, y), (reach, y), (reach + 9, y + 0.5 * tall), (reach, y + tall), (-back, y + tall)]
        parts.append(polygon(*((side * px, py) for px, py in corners)))
        y += tall + dice.between(3, 7)
    if dice.chance(0.4):
        parts.append(polygon((-10, 0), (-4, -6), (4, -6), (10, 0)))
    return union(*parts)


def anchor(dice: Dice) -> Shape:
    """An anchor, its ring above."""
    long, width, reach = dice.between(60, 80), dice.between(5, 8), dice.between(28, 38)
    eye, deep, stock = dice.between(7.5, 10), dice.between(20, 30), dice.between(14, 24)
    curl = arc(0, -deep, reach, deep, 5, 175)
    tip = (reach + dice.between(-1, 3), -deep - dice.between(7, 11))
    fluke = polygon((reach - 9, -deep + 3), tip, (reach + 8, -deep + 5))
    parts = [box(-0.5 * width, -long, 0.5 * width, 0), stroke(curl, width, "flat"), mirrored(fluke)]
    parts.append(ring(0, -long - eye + 2, eye, dice.between(3, 4)))
    if dice.chance(0.8):
        y = -long + dice.between(5, 12)
        parts.append(box(-stock, y, stock, y + dice.between(4.5, 7), dice.pick((0, 3))))
    return union(*parts)
