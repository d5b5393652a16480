"""Drawings of furniture: chair, stool, table, bed, sofa, shelf, lamp. All that do not hang stand on y = 0."""

from autopoly_env.targets.dice import Dice
from autopoly_env.targets.pencil import (
    Shape,
    arc,
    bar,
    blob,
    box,
    disc,
    mirrored,
    move,
    polygon,
    stroke,
    turn,
    turned,
    union,
)


def chair(dice: Dice) -> Shape:
    """A chair from the side, from the front, or one on castors."""
    return dice.pick((_chair_from_the_side, _chair_from_the_side, _chair_from_the_front, _office_chair))(dice)


def _chair_from_the_side(dice: Dice) -> Shape:
    seat, depth, back = dice.between(40, 55), dice.between(40, 58), dice.between(38, 65)
    leg, thick, lean = dice.between(4, 8), dice.between(5, 11), dice.between(0, 14)
    splay = dice.between(0, 8)
    top = (-lean, -seat - back)
    parts = [
        box(0, -seat, depth, -seat + thick, dice.pick((0, 3))),
        bar((0.5 * leg, -seat + thick), top, leg, dice.between(0.7, 1.3) * leg),
        bar((0.5 * leg, -seat), (0.5 * leg - splay, 0), leg, dice.between(0.6, 1.0) * leg),
        bar((depth - 0.6 * leg, -seat), (depth - 0.6 * leg + dice.between(0, 0.7) * splay, 0), leg),
    ]
    if dice.chance(0.4):
        y = -seat * dice.between(0.25, 0.5)
        parts.append(bar((-splay * 0.5, y), (depth - leg, y), dice.between(3, 4)))
    if dice.chance(0.4):
        arm, reach = dice.between(16, 24), depth * dice.between(0.6, 0.9)
        parts.append(stroke([(-2, -seat - arm), (reach, -seat - arm), (reach, -seat)], dice.between(3.5, 5)))
    if dice.chance(0.3):
        parts.append(box(1, -seat - dice.between(5, 9), depth + 2, -seat + 2, 5))
    return union(*parts)


def _chair_from_the_front(dice: Dice) -> Shape:
    seat, back, half, leg = dice.between(38, 52), dice.between(40, 65), dice.between(20, 28), dice.between(4.5, 7)
    top = -seat - back
    narrow = half * dice.between(0.8, 1.0)
    sides = [bar((half - 0.5 * leg, 0), (half - 0.5 * leg, -seat), leg), bar((half - 3, -seat), (narrow - 3, top), leg)]
    parts = [mirrored(union(*sides)), box(-half - 3, -seat, half + 3, -seat + dice.between(6, 10), 2)]
    match dice.pick(("panel", "rungs", "slats")):
        case "panel":
            parts.append(box(-narrow, top, narrow, -seat - dice.between(10, 0.4 * back), dice.between(2, 12)))
        case "rungs":
            n = dice.whole(2, 4)
            parts += [box(-narrow, y, narrow, y + 5) for y in (top + i * (back - 5) / n for i in range(n))]
        case _:
            n = dice.whole(1, 3)
            parts += [box(x - 2, top, x + 2, -seat) for x in (narrow * (2 * i / (n + 1) - 1) for i in range(1, n + 1))]
            parts.append(box(-narrow - 2, top, narrow + 2, top + dice.between(6, 12), 3))
    if dice.chance(0.6):
        y = -seat * dice.between(0.3, 0.6)
        parts.append(box(-half, y, half, y + 4))
    return union(*parts)


def _office_chair(dice: Dice) -> Shape:
    half, back, seat, foot = dice.between(17, 24), dice.between(34, 48), dice.between(42, 50), dice.between(20, 28)
    seat_half = half + dice.between(2, 6)
    parts = [
        box(-half, -seat - 8 - back, half, -seat - 6, dice.between(4, 14)),
        box(-4, -seat - 10, 4, -8),
        box(-seat_half, -seat, seat_half, -seat + dice.between(8, 11), 4),
        mirrored(union(bar((0, -14), (foot, -7), 7, 4.5), disc(foot, -4.5, 4.5))),
        disc(0, -4.5, 4.5),
    ]
    if dice.chance(0.7):
        arm, reach = dice.between(14, 20), seat_half + dice.between(5, 9)
        joint = [(seat_half - 2, -seat + 4), (reach, -seat + 4), (reach, -seat - arm)]
        parts.append(mirrored(union(stroke(joint, 4), box(reach - 5, -seat - arm - 3, reach + 5, -seat - arm + 3, 3))))
    return union(*parts)


def stool(dice: Dice) -> Shape:
    """A stool with splayed legs, or a bar stool on a column."""
    height, half, thick = dice.between(50, 90), dice.between(16, 26), dice.between(7, 14)
    seat = box(-half, -height, half, -height + thick, dice.pick((2, 0.5 * thick)))
    if dice.chance(0.3):
        foot = dice.between(0.7, 1.1) * half
        parts = [seat, turned((3, -height), (3, -8), (foot, -4), (foot, 0))]
        if dice.chance(0.6):
            parts.append(box(-0.6 * foot, -0.4 * height, 0.6 * foot, -0.4 * height + 4, 2))
        return union(*parts)
    leg, splay, inset = dice.between(4.5, 7), dice.between(0, 12), dice.between(3, 7)
    legs = bar((half - inset, -height + 2), (half - inset + splay, 0), leg, dice.between(0.6, 1.0) * leg)
    parts = [seat, mirrored(legs)]
    if dice.chance(0.4):
        parts.append(box(-0.5 * leg, -height, 0.5 * leg, 0))
    for share in dice.pick(((), (0.4,), (0.6,), (0.3, 0.65))):
        x = half - inset + splay * (1 - share)
        parts.append(box(-x, -share * height - 2, x, -share * height + 2))
    return union(*parts)


def table(dice: Dice) -> Shape:
    """A table or a desk from the front."""
    half, height, thick = dice.between(42, 55), dice.between(35, 70), dice.between(5, 10)
    parts = [box(-half, -height, half, -height + thick, dice.pick((0, 0, 2.5)))]
    x, leg = half - dice.between(3, 14), dice.between(5, 9)
    match dice.pick(("legs", "legs", "pedestal", "trestle", "desk")):
        case "legs":
            foot = x + dice.between(-3, 8)
            parts.append(mirrored(bar((x, -height + 1), (foot, 0), leg, leg * dice.between(0.5, 1.0))))
            if dice.chance(0.5):
                parts.append(box(-x, -height, x, -height + thick + dice.between(4, 10)))
            if dice.chance(0.4):
                share = dice.between(0.25, 0.4)
                reach = foot + share * (x - foot)
                parts.append(box(-reach, -share * height, reach, -share * height + 4))
        case "pedestal":
            column, foot = dice.between(2.5, 6), dice.between(0.35, 0.6) * half
            belly = column * dice.between(1.0, 2.2)
            rest = ((column, -0.4 * height), (column, -9), (foot, -4), (foot, 0))
            parts.append(turned((3 * column, -height + 1), (column, -0.85 * height), (belly, -0.6 * height), *rest))
        case "trestle":
            spread = dice.between(9, 14)
            legs = [bar((x - 8, -height + 2), (x - 8 + side * spread, 0), leg * 0.8) for side in (-1, 1)]
            parts.append(mirrored(union(*legs, bar((0, -0.4 * height), (x - 6, -0.4 * height), 4))))
        case _:
            parts.append(_pedestal_drawers(dice, half, height))
            parts.append(box(-half + 4, -height, -half + 4 + leg, 0))
    return union(*parts)


def _pedestal_drawers(dice: Dice, half: float, height: float) -> Shape:
    """The drawers under the right side of a desk; gaps between them."""
    left, n = half * dice.between(0.1, 0.35), dice.whole(2, 3)
    drawers = box(left, -height + 1, half - 3, -dice.between(0, 6))
    step = (height - 9) / n
    gaps = [box(left + 5, y, half - 8, y + 3) for y in (-height + 9 + (i + 0.5) * step for i in range(n))]
    return drawers - union(*gaps)


def bed(dice: Dice) -> Shape:
    """A bed from the side, or a bunk bed."""
    long, head, foot = dice.between(90, 110), dice.between(34, 52), dice.between(14, 36)
    post, rail = dice.between(4, 7), dice.between(8, 13)
    parts = [box(0, -head, post, 0, 2), box(long - post, -foot, long, 0, 2)]
    if dice.chance(0.3):
        parts.append(_upper_bunk(dice, long, head + dice.between(22, 30), post, rail))
    level = dice.between(14, 18)
    mattress = level + dice.between(6, 9)
    parts += [box(0, -level, long, -level + rail), box(post - 1, -mattress, long - post + 1, -level + 3, 4)]
    pillow = dice.between(18, 26)
    parts.append(box(post - 1, -mattress - dice.between(4, 7), post + pillow, -mattress + 4, 5))
    if dice.chance(0.5):
        hump, start, top = dice.between(3, 7), post + pillow * dice.between(0.7, 1.0), -mattress
        ridge = [(start, top + 2), (start + 12, top - hump), (long - 18, top - 0.6 * hump), (long - post, top + 2)]
        parts.append(blob(*ridge, (0.5 * long, top + 5)))
    return union(*parts)


def _upper_bunk(dice: Dice, long: float, top: float, post: float, rail: float) -> Shape:
    """Long posts, a second bed `top` above the floor, and now and then a ladder."""
    parts = [box(0, -top - 6, post, 0, 2), box(long - post, -top - 6, long, 0, 2), box(0, -top, long, -top + rail)]
    if dice.chance(0.5):
        x, wide = long * dice.between(0.6, 0.7), dice.between(11, 14)
        parts += [box(x, -top, x + 3.5, 0), box(x + wide, -top, x + wide + 3.5, 0)]
        parts += [box(x, -y, x + wide, -y + 3.5) for y in (12, 22, 42, 54) if y < top - 6]
    return union(*parts)


def sofa(dice: Dice) -> Shape:
    """An armchair or a sofa from the front; the gap around the seat cushions may show."""
    n_seats = dice.whole(1, 3)
    half = 10 + 13 * n_seats + dice.between(0, 6)
    arm, arm_top, back, foot = dice.between(9, 15), dice.between(30, 42), dice.between(50, 68), dice.between(3, 9)
    seat = arm_top - dice.between(10, 15)
    roll = dice.between(2, 0.5 * arm)
    shape = union(
        box(-half, -back, half, -foot - 8, dice.between(3, 14)),
        box(-half - 2, -seat, half + 2, -foot),
        mirrored(box(half - 3, -arm_top, half + arm - 3, -foot, roll)),
        mirrored(box(half - 4, -foot - 3, half + 2, 0)),
    )
    gap = dice.between(2.5, 3.5)
    if dice.chance(0.7):
        shape -= box(-half + 4, -seat + 6, half - 4, -seat + 6 + gap)
        if dice.chance(0.6):
            shape -= mirrored(box(half - 6, -arm_top, half - 6 + gap, -seat + 6))
        elif n_seats > 1 and dice.chance(0.7):
            xs = [half * (2 * i / n_seats - 1) for i in range(1, n_seats)]
            shape -= union(*(box(x - 0.5 * gap, -back + dice.between(-2, 8), x + 0.5 * gap, -seat + 2) for x in xs))
    return shape


def shelf(dice: Dice) -> Shape:
    """Shelves: compartments with books, vases and nothing in them."""
    n_rows, n_columns = dice.whole(2, 4), dice.whole(1, 3)
    width, height, board = dice.between(18, 34), dice.between(20, 30), dice.between(3, 5)
    w, h = n_columns * (width + board) + board, n_rows * (height + board) + board
    shape = box(0, 0, w, h)
    for row in range(n_rows):
        y = board + row * (height + board)
        for column in range(n_columns):
            x = board + column * (width + board)
            shape -= box(x, y, x + width, y + height)
            if dice.chance(0.6):
                shape = union(shape, _goods(dice, x, y + height + 0.5, width, height))
    if dice.chance(0.6):
        shape = union(shape, box(1, h - 1, 1 + board, h + 8), box(w - 1 - board, h - 1, w - 1, h + 8))
    if dice.chance(0.4):
        shape = union(shape, box(-4, -2, w + 4, board))
    return shape


def _goods(dice: Dice, x: float, floor: float, width: float, height: float) -> Shape:
    """Books, and now and then a vase, that stand at the left of a compartment."""
    if dice.chance(0.2):
        h = height * dice.between(0.4, 0.7)
        vase = turned((2.5, -h), (2, -0.8 * h), (5, -0.4 * h), (3.5, 0), smooth=True)
        return move(vase, x + width * dice.between(0.4, 0.6), floor)
    right, books = x + width * dice.between(0.3, 0.85), [box(x - 1, floor - 3, x + 3, floor)]
    x -= 0.5
    while x < right - 5:
        thick = dice.between(4, 7)
        books.append(box(x, floor - height * dice.between(0.5, 0.8), x + thick + 0.2, floor))
        x += thick
    return union(*books)


def lamp(dice: Dice) -> Shape:
    """A floor lamp, a table lamp, a lamp that hangs, or one with an arm."""
    return dice.pick((_floor_lamp, _table_lamp, _hanging_lamp, _desk_lamp))(dice)


def _shade(dice: Dice, top: float, height: float, half: float) -> Shape:
    """A lampshade: straight sides, a bell, or half a ball."""
    narrow = half * dice.between(0.35, 0.75)
    match dice.pick(("cone", "cone", "bell", "dome")):
        case "cone":
            return turned((narrow, top), (half, top + height))
        case "bell":
            waist = (0.5 * (narrow + half) - 0.12 * half, top + 0.6 * height)
            return turned((narrow, top), waist, (half, top + height), smooth=True)
    return polygon(*arc(0, top + height, half, height, 180, 360))


def _floor_lamp(dice: Dice) -> Shape:
    height, half, shade = dice.between(90, 110), dice.between(15, 24), dice.between(18, 30)
    pole, foot = dice.between(1.5, 2.5), dice.between(12, 20)
    parts = [_shade(dice, -height, shade, half), box(-pole, -height + 5, pole, -2)]
    if dice.chance(0.3):
        y = -dice.between(20, 45)
        parts.append(mirrored(bar((0, y), (foot, 0), 4, 3)))
    else:
        parts.append(turned((2 * pole, -dice.between(5, 7)), (foot, -3), (foot, 0)))
    return union(*parts)


def _table_lamp(dice: Dice) -> Shape:
    base, shade, half = dice.between(35, 55), dice.between(26, 40), dice.between(24, 36)
    belly, neck, foot = dice.between(7, 17), dice.between(2.5, 4), dice.between(10, 18)
    gap = 0.0 if dice.chance(0.6) else dice.between(3, 5)
    body = [(neck, -base - 4), (neck, -0.85 * base), (belly, -dice.between(0.4, 0.6) * base), (neck + 2, -0.15 * base)]
    stand = turned(*body, (neck + 2, -4), smooth=dice.chance(0.7))
    return union(_shade(dice, -base - gap - shade, shade, half), stand, box(-foot, -5, foot, 0, 1.5))


def _hanging_lamp(dice: Dice) -> Shape:
    cord, shade, half = dice.between(20, 50), dice.between(20, 36), dice.between(26, 42)
    parts = [box(-1.5, -cord - shade, 1.5, -shade + 4), _shade(dice, -shade, shade, half)]
    parts.append(box(-dice.between(6, 12), -cord - shade - 4, dice.between(6, 12), -cord - shade))
    if dice.chance(0.6):
        bulb = dice.between(6, 9)
        parts.append(disc(0, dice.between(0.1, 0.6) * bulb if dice.chance(0.6) else bulb + 4, bulb))
    return union(*parts)


def _desk_lamp(dice: Dice) -> Shape:
    elbow = (-dice.between(10, 26), -dice.between(28, 44))
    head = (dice.between(8, 24), elbow[1] - dice.between(18, 36))
    arm = dice.between(3.5, 5)
    parts = [stroke([(0, -4), elbow, head], arm), disc(*elbow, arm), box(-20, -6, 20, 0, dice.pick((1, 5)))]
    tilt, size = dice.between(20, 60), dice.between(16, 22)
    cone = polygon((-4, -5), (4, -5), (size, size), (-size, size))
    if dice.chance(0.5):
        cone = polygon(*arc(0, size, size, size + 5, 180, 360))
    return union(*parts, move(turn(cone, -tilt), *head))
