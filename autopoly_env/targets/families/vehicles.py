"""Drawings of what moves: car, truck, aeroplane, boat, rocket, bicycle. Those with wheels stand on y = 0."""

from autopoly_env.targets.dice import Dice
from autopoly_env.targets.pencil import (
    Point,
    Shape,
    bar,
    blob,
    box,
    curve,
    disc,
    mirrored,
    move,
    polygon,
    ring,
    round_off,
    stroke,
    turned,
    union,
)


def _with_wheels(dice: Dice, body: Shape, xs: list[float], radius: float) -> Shape:
    """The body on wheels: set off by a gap or not, with a hole at the hub or not."""
    centres = [(x, -radius) for x in xs]
    gap = dice.pick((0.0, dice.between(2.6, 3.5)))
    hub = radius * dice.between(0.35, 0.5) if dice.chance(0.4) else 0.0
    if gap:
        body -= union(*(disc(x, y, radius + gap) for x, y in centres))
    shape = union(body, *(disc(x, y, radius) for x, y in centres))
    return shape - union(*(disc(x, y, hub) for x, y in centres)) if hub else shape


# Roof lines from the tail to the nose: (share of the car's length, share of the cabin's height)
_CABINS: tuple[tuple[Point, ...], ...] = (
    ((0.13, 0.0), (0.28, 1.0), (0.58, 1.0), (0.74, 0.0)),  # saloon
    ((0.02, 0.0), (0.08, 0.95), (0.5, 1.0), (0.7, 0.0)),  # hatchback
    ((0.0, 0.0), (0.02, 1.3), (0.66, 1.3), (0.84, 0.0)),  # van
    ((0.42, 0.0), (0.45, 1.0), (0.66, 1.0), (0.78, 0.0)),  # pickup
    ((0.08, 0.0), (0.25, 0.8), (0.42, 1.0), (0.6, 0.75), (0.74, 0.0)),  # beetle
)


def car(dice: Dice) -> Shape:
    """A car from the side, its nose at the right."""
    long, belt, height = dice.between(92, 110), dice.between(22, 27), dice.between(14, 20)
    radius, nudge = dice.between(8.5, 11.5), dice.between(-0.03, 0.03)
    floor = -radius * dice.between(0.6, 0.9)
    cabin = [((x + nudge) * long, -belt - share * height) for x, share in dice.pick(_CABINS)]
    hood, tail = dice.between(0, 4), dice.between(0, 3)
    front = [(0.85 * long, -belt + 1), (long, -belt + hood + 2), (long, floor)]
    body = round_off(polygon((0, floor), (0, -belt + tail), *cabin, *front), dice.between(1.2, 3.5))
    if dice.chance(0.75):
        body -= _windows(dice, cabin, belt)
    return _with_wheels(dice, body, [long * dice.between(0.18, 0.23), long * dice.between(0.77, 0.82)], radius)


def _windows(dice: Dice, cabin: list[Point], belt: float) -> Shape:
    """One to three windows in a cabin, with posts between them."""
    glass = polygon(*cabin).buffer(-dice.between(2.8, 4), join_style="mitre") & box(-99, -99, 199, -belt - 1)
    x0, _, x1, _ = glass.bounds
    n = dice.whole(1, 3)
    post, lean = dice.between(2.8, 4), dice.between(0, 2)
    xs = [x0 + (x1 - x0) * i / n for i in range(1, n)]
    return round_off(glass - union(*(bar((x - lean, -99), (x + lean, 0), post) for x in xs)), 1.0)


def truck(dice: Dice) -> Shape:
    """A lorry or a bus from the side, its nose at the right."""
    radius = dice.between(7, 9)
    floor, long, tall = -1.2 * radius, dice.between(60, 85), dice.between(32, 46)
    if dice.chance(0.3):
        return _bus(dice, long + 25, tall, floor, radius)
    cab, gap = dice.between(20, 28), dice.between(3, 7)
    roof = -dice.between(0.75, 1.0) * tall
    nose = dice.pick((0.0, dice.between(6, 10)))
    front = long + gap
    outline = [(front, floor), (front, roof), (front + 0.7 * cab, roof), (front + cab, 0.5 * roof)]
    cabin = round_off(polygon(*outline, (front + cab + nose, 0.48 * roof), (front + cab + nose, floor)), 2)
    pane = [(front + 0.45 * cab, roof + 4), (front + 0.66 * cab, roof + 4), (front + 0.9 * cab, 0.54 * roof)]
    cabin -= polygon(*pane, (front + 0.45 * cab, 0.54 * roof))
    load = _load(dice, long, tall, floor)
    frame = box(1, floor - 4, front + cab, floor + 1)
    xs = [12.0, 12 + 2.3 * radius, front + cab - 8][dice.whole(0, 1) :]
    return _with_wheels(dice, union(load, frame, cabin), xs, radius)


def _load(dice: Dice, long: float, tall: float, floor: float) -> Shape:
    """What a lorry has behind its cab: a box, a tank, or an open trough with a heap in it."""
    match dice.pick(("box", "tank", "trough")):
        case "box":
            return box(0, -tall - 4, long, floor - 1, 1)
        case "tank":
            return box(2, -tall, long - 1, floor - 2, dice.between(8, 14))
    rim = floor - dice.between(14, 24)
    trough = polygon((-3, rim), (long - 1, rim), (long - 1, floor - 1), (5, floor - 1))
    if dice.chance(0.6):
        return union(trough, blob((4, rim + 1), (0.4 * long, rim - 11), (long - 8, rim + 1), (0.5 * long, rim + 5)))
    return trough


def _bus(dice: Dice, long: float, tall: float, floor: float, radius: float) -> Shape:
    n, post = dice.whole(3, 6), dice.between(3, 4.5)
    body = box(0, -tall - 6, long, floor + 3, dice.between(2, 7))
    wide = (long - 8 - post * (n - 1)) / n
    top = -tall - 1
    panes = [box(4 + i * (wide + post), top, 4 + i * (wide + post) + wide, top + 14, 1.5) for i in range(n)]
    return _with_wheels(dice, body - union(*panes), [0.2 * long, 0.78 * long], radius)


def aeroplane(dice: Dice) -> Shape:
    """An aeroplane from above, its nose up: airliner, fighter, or propeller plane."""
    long, thick, span = dice.between(90, 105), dice.between(4, 6.5), dice.between(38, 54)
    wing, sweep = dice.between(0.32, 0.5) * long, dice.between(-2, 34)
    chord, tip = dice.between(16, 26), dice.between(4, 10)
    match dice.pick(("airliner", "airliner", "fighter", "propeller")):
        case "fighter":
            thick, span, sweep, chord = thick * 0.9, span * 0.75, dice.between(22, 34), dice.between(26, 36)
        case "propeller":
            sweep, chord, tip, wing = dice.between(-1, 4), dice.between(14, 18), dice.between(10, 14), 0.25 * long
    nose = [(0.0, 0.0), (0.6 * thick, 0.05 * long), (thick, 0.16 * long), (thick, 0.7 * long), (1.6, long)]
    hull = mirrored(polygon(*curve(nose), (0, long)))
    parts = [hull, polygon((0, wing), (span, wing + sweep), (span, wing + sweep + tip), (0, wing + chord))]
    reach, root = span * dice.between(0.32, 0.45), long - dice.between(12, 18)
    parts.append(polygon((0, root), (reach, root + 0.45 * sweep), (reach, root + 0.45 * sweep + 5), (0, root + 13)))
    for share in dice.pick(((), (), (0.35,), (0.3, 0.6))):
        x, y = share * span, wing + share * sweep
        parts.append(box(x - 2.3, y - 5, x + 2.3, y + 8, 2))
    shape = mirrored(union(*parts))
    if sweep < 5 and dice.chance(0.6):
        shape = union(shape, box(-dice.between(9, 13), -2.5, dice.between(9, 13), 1, 1))
    return round_off(shape, 0.8)


def boat(dice: Dice) -> Shape:
    """A sailing boat or a steamer, its bow at the right."""
    half, deep = dice.between(36, 48), dice.between(12, 19)
    deck = -deep
    bottom = [(half, deck - dice.between(0, 5)), (half * 0.6, 0), (-half * 0.75, 0), (-half, deck)]
    if dice.chance(0.5):
        bottom[1:2] = [*curve([bottom[0], (0.62 * half, -2), (0, 0)])[1:]]
    hull = polygon(*bottom)
    return _steamer(dice, hull, half, deck) if dice.chance(0.3) else _sailing_boat(dice, hull, half, deck)


def _sailing_boat(dice: Dice, hull: Shape, half: float, deck: float) -> Shape:
    """A hull with a mast, one sail or two, and now and then a boom and a flag."""
    mast, x, width = dice.between(58, 78), dice.between(-6, 8), dice.between(3, 4)
    gap, boom = dice.between(2.5, 4), deck - dice.between(5, 9)
    left, right = x - 0.5 * width - gap, x + 0.5 * width + gap
    luff = [(left, deck - mast), (left, boom), (left - dice.between(22, 32), boom)]
    bulge = (0.5 * (luff[0][0] + luff[2][0]) - dice.between(0, 5), 0.5 * (luff[0][1] + boom) + 2)
    sails = [polygon(*luff, *curve([luff[2], bulge, luff[0]])[1:-1])]
    if dice.chance(0.75):
        sails.append(polygon((right, deck - mast * dice.between(0.75, 0.95)), (half * 0.85, boom), (right, boom)))
    parts = [hull, box(x - 0.5 * width, deck - mast - 3, x + 0.5 * width, deck + 2), *sails]
    if dice.chance(0.5):
        parts.append(bar((x, boom), (luff[2][0], boom), 3))
    if dice.chance(0.3):
        top = deck - mast - 3
        parts.append(polygon((x - 1, top), (x + 13, top + 4), (x - 1, top + 8)))
    return union(*parts)


def _steamer(dice: Dice, hull: Shape, half: float, deck: float) -> Shape:
    """A hull with a deckhouse, portholes, and one to three funnels."""
    house = box(-0.6 * half, deck - dice.between(11, 15), 0.4 * half, deck + 1, 1)
    n = dice.whole(2, 4)
    house -= union(*(disc(-0.5 * half + 0.8 * half * i / (n - 1), deck - 6, 2.4) for i in range(n)))
    top = house.bounds[1]
    xs = [-0.4 * half, -0.1 * half, 0.2 * half][: dice.whole(1, 3)]
    lean, tall = dice.between(0, 4), dice.between(14, 24)
    funnels = [bar((x, top + 1), (x - lean, top - tall), 7) for x in xs]
    return union(hull, house, *funnels)


def rocket(dice: Dice) -> Shape:
    """A rocket, its tip up, with fins; the flame may be a part of its own."""
    long, half = dice.between(62, 85), dice.between(10, 17)
    side = [(0.0, -long), (0.55 * half, -0.82 * long), (half, -0.55 * long), (half, -0.25 * long), (0.65 * half, 0)]
    hull = mirrored(polygon(*curve(side), (0, 0)))
    reach, high, drop = dice.between(9, 17), long * dice.between(0.3, 0.45), dice.between(1, 10)
    tip = half + reach
    fin = polygon((0.6 * half, -high), (tip, drop - dice.between(8, 14)), (tip, drop), (0.6 * half, -3))
    parts = [hull, mirrored(fin), box(-0.5 * half, -2, 0.5 * half, 4)]
    if dice.chance(0.6):
        flame = dice.between(12, 22)
        y = dice.pick((3.0, 7.0))
        parts.append(turned((0.4 * half, y), (0.45 * half, y + 0.4 * flame), (0, y + flame), smooth=True))
    shape = union(*parts)
    if dice.chance(0.85):
        r, y = half * dice.between(0.35, 0.55), -long * dice.between(0.5, 0.62)
        shape -= disc(0, y, r) if dice.chance(0.6) else ring(0, y, r + 1.5, 2.8)
    return shape


def bicycle(dice: Dice) -> Shape:
    """A bicycle from the side, its front at the right."""
    radius, base, width = dice.between(18, 23), dice.between(50, 60), dice.between(3, 4.2)
    rear, front = (0.0, -radius), (base, -radius)
    crank = (base * dice.between(0.38, 0.45), -radius + dice.between(-1, 3))
    saddle = (crank[0] - dice.between(5, 9), -radius - dice.between(22, 30))
    head = (base - dice.between(9, 13), saddle[1] - dice.between(0, 4))
    grip = dice.pick(((-8, -7), (6, -6), (-3, -9)))
    lines = [[rear, crank, saddle, rear], [crank, head, front], [saddle, (saddle[0] - 1.5, saddle[1] - 6)]]
    if dice.chance(0.75):
        lines.append([saddle, head])
    lines.append([head, (head[0] - 2, head[1] - 6), (head[0] - 2 + grip[0], head[1] - 6 + grip[1])])
    wheels = [move(ring(0, 0, radius, width * 1.1), *hub) for hub in (rear, front)]
    if dice.chance(0.3):
        wheels += [disc(*hub, radius * 0.25) for hub in (rear, front)]
    seat = box(saddle[0] - 8, saddle[1] - 8, saddle[0] + 5, saddle[1] - 4.5, 1.7)
    return union(*wheels, seat, disc(*crank, dice.between(3.5, 5.5)), *(stroke(line, width) for line in lines))
