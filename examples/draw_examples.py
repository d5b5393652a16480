"""Draws the example silhouettes of this folder, white on black: `python examples/draw_examples.py [FOLDER]`.

Every object is a handful of outlines on a 512 x 512 page, painted one over the other: `fill` adds to the
object and `cut` takes away. The page is painted four times larger, averaged down and thresholded, so that an
edge lies where it was drawn to within half a pixel. Nothing is random: the same pixels come out each time.
"""

import itertools
import math
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from PIL import Image, ImageDraw

SIZE = 512  # pixels on a side of a finished picture, and the unit that the drawings are in
OVERSAMPLING = 4

Point = tuple[float, float]
Outline = list[Point]


class Page:
    """One picture in the making."""

    def __init__(self) -> None:
        self._image = Image.new("L", (SIZE * OVERSAMPLING, SIZE * OVERSAMPLING))
        self._pen = ImageDraw.Draw(self._image)

    def fill(self, *outlines: Outline) -> None:
        """Adds the inside of each outline to the object."""
        for outline in outlines:
            self._paint(outline, 255)

    def cut(self, *outlines: Outline) -> None:
        """Takes the inside of each outline away from the object."""
        for outline in outlines:
            self._paint(outline, 0)

    def stroke(self, path: Sequence[Point], width: float) -> None:
        """Adds a line of the given width (pixels) along the path, with round ends and joints."""
        for (ax, ay), (bx, by) in itertools.pairwise(path):
            length = math.hypot(bx - ax, by - ay)
            nx, ny = (ay - by) / length * width / 2, (bx - ax) / length * width / 2
            self.fill([(ax + nx, ay + ny), (bx + nx, by + ny), (bx - nx, by - ny), (ax - nx, ay - ny)])
        for x, y in path:
            self.fill(oval(x, y, width / 2))

    def finished(self) -> Image.Image:
        """The picture at its final size, each pixel 0 or 255."""
        return self._image.reduce(OVERSAMPLING).point(lambda value: 255 if value >= 128 else 0)

    def _paint(self, outline: Outline, value: int) -> None:
        corners = [(round(x * OVERSAMPLING), round(y * OVERSAMPLING)) for x, y in outline]
        self._pen.polygon(corners, fill=value)


def path(text: str) -> Outline:
    """The points of a path written as `"x,y x,y ..."`."""
    pairs = (pair.split(",") for pair in text.split())
    return [(float(x), float(y)) for x, y in pairs]


def box(x0: float, y0: float, x1: float, y1: float, radius: float = 0.0) -> Outline:
    """A rectangle, its corners rounded where a radius is given."""
    if radius == 0:
        return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    left, top, right, bottom = x0 + radius, y0 + radius, x1 - radius, y1 - radius
    centres = ((right, bottom), (left, bottom), (left, top), (right, top))
    return [p for i, (x, y) in enumerate(centres) for p in arc(x, y, radius, radius, 90 * i, 90 * i + 90)]


def arc(x: float, y: float, rx: float, ry: float, start: float, end: float, n_steps: int = 24) -> Outline:
    """Points on an ellipse around (x, y); angles in degrees, clockwise on the page from three o'clock."""
    angles = (math.radians(start + (end - start) * i / n_steps) for i in range(n_steps + 1))
    return [(x + rx * math.cos(a), y + ry * math.sin(a)) for a in angles]


def oval(x: float, y: float, rx: float, ry: float | None = None) -> Outline:
    """A whole ellipse around (x, y); a circle where only one radius is given."""
    return arc(x, y, rx, rx if ry is None else ry, 0, 360, 72)


def smooth(points: Sequence[Point], closed: bool = False, n_steps: int = 10) -> Outline:
    """A Catmull-Rom curve through the points."""
    ends = (points[-1], points[0], points[1]) if closed else (points[0], points[-1])
    knots = [ends[0], *points, *ends[1:]]
    curve = [
        (_catmull_rom(a[0], b[0], c[0], d[0], i / n_steps), _catmull_rom(a[1], b[1], c[1], d[1], i / n_steps))
        for a, b, c, d in zip(knots, knots[1:], knots[2:], knots[3:], strict=False)
        for i in range(n_steps)
    ]
    return curve if closed else [*curve, points[-1]]


def loop(text: str) -> Outline:
    """A closed smooth curve through the points of a path written as text."""
    return smooth(path(text), closed=True)


def _catmull_rom(a: float, b: float, c: float, d: float, t: float) -> float:
    """The curve between b (t = 0) and c (t = 1)."""
    return b + t / 2 * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)))


def mirrored(half: Outline, x: float = SIZE / 2) -> Outline:
    """The half and its mirror image across the upright line at x, as one outline."""
    return half + [(2 * x - px, py) for px, py in reversed(half)]


def flipped(outline: Outline, x: float = SIZE / 2) -> Outline:
    """The mirror image alone."""
    return [(2 * x - px, py) for px, py in outline]


def turned(outline: Outline, degrees: float, x: float = SIZE / 2, y: float = SIZE / 2) -> Outline:
    """The outline turned clockwise on the page around (x, y)."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return [(x + (px - x) * c - (py - y) * s, y + (px - x) * s + (py - y) * c) for px, py in outline]


def aeroplane(page: Page) -> None:
    """An airliner from above: swept wings, two engines, tailplane."""
    wing = path("248,190 300,222 482,338 486,364 474,364 372,318 292,302 248,302")
    tail = path("250,408 274,416 336,456 338,474 268,460 250,462")
    page.fill(wing, flipped(wing), tail, flipped(tail))
    engine = box(336, 214, 360, 272, 10)
    page.fill(engine, flipped(engine))
    page.fill(mirrored(smooth(path("256,24 244,34 233,62 228,104 228,330 238,420 249,474 256,490"))))


def bed(page: Page) -> None:
    """A bed from the side: headboard, pillow, mattress, footboard; the legs leave a low gap."""
    page.fill([(36, 440), *smooth(path("36,300 28,160 32,128 54,128 62,160 64,300")), (64, 440)])
    page.fill(box(452, 262, 480, 440, 4), box(446, 252, 486, 276, 10))
    page.fill(box(50, 340, 470, 384))
    page.fill(box(58, 288, 456, 350, 16))
    page.fill(loop("64,296 68,262 92,246 136,250 160,270 164,296"))
    page.fill(loop("168,300 200,278 290,272 380,276 440,284 458,306 452,340 168,340"))


def bicycle(page: Page) -> None:
    """A bicycle: two wheels and a diamond frame of thin tubes; the overlapping tubes make eight holes."""
    rear, front, crank = (126.0, 336.0), (386.0, 336.0), (228.0, 342.0)
    for x, y in (rear, front):
        page.fill(oval(x, y, 102))
        page.cut(oval(x, y, 88))
        page.fill(oval(x, y, 12))
    saddle, head, steerer = (192.0, 204.0), (334.0, 198.0), (344.0, 226.0)
    page.stroke([rear, crank, saddle, rear], 10)
    page.stroke([saddle, head], 11)
    page.stroke([crank, steerer], 12)
    page.stroke([(322, 162), head, steerer, *smooth([(366, 288), (374, 314), front])], 11)
    page.stroke([saddle, (182, 170)], 9)
    page.fill(loop("142,160 160,156 190,162 226,164 226,172 190,176 156,180 142,172"))
    page.stroke(smooth(path("322,162 346,152 368,158 374,180 356,192")), 10)
    page.fill(oval(*crank, 25))
    page.stroke([(206, 302), crank, (250, 382)], 9)
    page.stroke([(192, 302), (220, 302)], 10)
    page.stroke([(236, 382), (264, 382)], 10)


def bookshelf(page: Page) -> None:
    """A bookcase of ten compartments; books stand in five of them."""
    page.fill(box(104, 26, 408, 478), box(94, 20, 418, 38, 4))
    columns, rows = ((120, 249), (263, 392)), ((52, 120), (132, 206), (218, 292), (304, 378), (390, 456))
    for x0, x1 in columns:
        for y0, y1 in rows:
            page.cut(box(x0, y0, x1, y1))
    page.cut(box(124, 472, 388, 480))
    for x, width, height, bottom in (
        *((120, 20, 50, 120), (140, 14, 42, 120), (154, 24, 56, 120), (178, 16, 46, 120)),
        *((330, 22, 56, 206), (352, 16, 48, 206), (368, 24, 62, 206)),
        *((120, 26, 60, 292), (146, 18, 52, 292), (164, 22, 62, 292), (186, 14, 44, 292), (200, 20, 56, 292)),
        *((263, 18, 54, 378), (281, 26, 62, 378), (307, 16, 46, 378)),
        *((219, 30, 46, 456), (189, 30, 34, 456)),
    ):
        page.fill(box(x, bottom - height, x + width, bottom))


def bottle(page: Page) -> None:
    """A wine bottle."""
    neck = path("256,24 234,24 231,28 231,48 236,52 236,150")
    shoulder = smooth(path("236,150 231,180 212,208 194,232 186,264"))
    page.fill(mirrored([*neck, *shoulder, (186, 470), *arc(200, 474, 14, 14, 180, 90), (256, 488)]))


def chair(page: Page) -> None:
    """An armchair of wood from the side: one hole under the arm, one above the stretcher."""
    back = path("128,44 146,34 158,40 194,270 194,306 156,478 130,478 160,300 160,270")
    page.fill(back)
    page.fill(box(160, 276, 398, 308, 10), loop("176,282 190,262 290,260 380,264 396,282"))
    page.fill([(348, 300), (380, 300), (390, 478), (366, 478)])
    page.stroke([(160, 404), (370, 404)], 14)
    page.stroke([(176, 186), *smooth([(220, 182), (330, 182), (366, 188), (374, 200)])], 18)
    page.stroke(smooth([(348, 186), (342, 230), (354, 284)]), 16)


def floor_lamp(page: Page) -> None:
    """A floor lamp: cone shade, thin pole, a pull cord, a flat foot."""
    page.fill([(220, 22), (292, 22), (332, 124), (180, 124)])
    page.fill(box(252, 120, 260, 476), box(247, 140, 265, 158, 5))
    page.stroke([(296, 120), (296, 178)], 4)
    page.fill(oval(296, 184, 6, 8))
    page.fill(mirrored([*smooth(path("256,456 244,470 214,476 190,480 188,490")), (256, 490)]))


def hammer(page: Page) -> None:
    """A claw hammer."""
    parts = [
        loop("243,130 269,130 270,240 278,330 282,440 272,500 240,500 230,440 234,330 242,240"),
        box(238, 62, 274, 148, 4),
        box(136, 64, 172, 140, 6),
        path("168,74 200,84 238,78 238,126 200,120 168,130"),
        smooth(path("268,70 310,74 356,94 396,136 408,166")) + smooth(path("398,168 368,140 326,122 268,130")),
    ]
    page.fill(*(turned(part, 32, 262, 262) for part in parts))


def key(page: Page) -> None:
    """An old door key: a ring for a bow, collars, two teeth."""
    tilt = -35.0
    ring, hole = oval(104, 256, 84, 76), oval(100, 256, 56, 48)
    page.fill(turned(ring, tilt))
    page.cut(turned(hole, tilt))
    shaft = (box(180, 243, 486, 269, 8), box(184, 230, 200, 282, 5), box(210, 234, 222, 278, 5))
    teeth = box(392, 262, 466, 344, 3)
    page.fill(*(turned(part, tilt) for part in (*shaft, teeth)))
    page.cut(turned(box(422, 292, 436, 350), tilt), turned(box(452, 284, 470, 308), tilt))


def ladder(page: Page) -> None:
    """A ladder that leans a little: six holes between seven rungs."""
    tilt = 9.0
    for x0, x1 in ((204.0, 166.0), (308.0, 346.0)):
        page.fill(turned([(x0 - 9, 24), (x0 + 9, 24), (x1 + 10, 488), (x1 - 10, 488)], tilt))
    for i in range(7):
        y = 62 + 61.0 * i
        half = 52 + 38 * (y - 24) / 464
        page.fill(turned(box(256 - half, y - 7, 256 + half, y + 7), tilt))


def lamp_over_table(page: Page) -> None:
    """A hanging lamp above a round table with a bowl: two separate pieces."""
    page.stroke([(256, 14), (256, 70)], 6)
    page.fill(box(242, 60, 270, 88, 6), [*arc(256, 158, 92, 84, 180, 360), (348, 166), (164, 166)])
    page.fill(box(66, 306, 446, 330, 10))
    page.fill(mirrored(smooth(path("238,328 240,380 244,420 222,452 160,478 158,488"))))
    page.fill([*arc(172, 262, 60, 40, 0, 180), (112, 256), (232, 256)], box(150, 298, 194, 310))


def mug(page: Page) -> None:
    """A mug; its handle is a hole."""
    page.fill(oval(340, 252, 112, 112))
    page.cut(oval(338, 250, 76, 78))
    page.fill([*path("84,104 340,104"), *arc(308, 410, 24, 24, 0, 90), *arc(116, 410, 24, 24, 90, 180)])


def padlock(page: Page) -> None:
    """A padlock: one hole under the shackle, one for the key."""
    page.fill([*arc(256, 150, 104, 112, 180, 360), (360, 250), (152, 250)])
    page.cut([*arc(256, 150, 66, 74, 180, 360), (322, 226), (190, 226)])
    page.fill(box(106, 226, 406, 474, 34))
    page.cut(oval(256, 326, 28), [(245, 340), (267, 340), (276, 408), (236, 408)])


def scissors(page: Page) -> None:
    """Open scissors: two finger holes."""
    blade = [(252, 20), *smooth([(262, 60), (274, 150), (276, 236)]), (274, 270), (238, 270), (238, 232)]
    shank = loop("244,240 272,244 276,300 266,352 240,352 244,300")
    bow, finger = (turned(oval(226, 412, rx, ry), 10, 226, 412) for rx, ry in ((52, 72), (30, 50)))
    for angle, side in ((16.0, list), (-16.0, flipped)):
        page.fill(*(turned(side(part), angle, 256, 250) for part in (blade, shank, bow)))
        page.cut(turned(side(finger), angle, 256, 250))
    page.fill(oval(256, 250, 25))


def table(page: Page) -> None:
    """A dining table from the front."""
    page.fill(box(30, 146, 482, 172, 6), box(62, 170, 450, 214))
    leg = path("62,200 98,200 96,226 84,430 66,430")
    page.fill(leg, flipped(leg))


def teapot(page: Page) -> None:
    """A teapot: spout, lid with a knob, a handle that is a hole."""
    page.fill(loop("352,178 412,152 464,176 476,240 448,312 380,362 340,330"))
    page.cut(loop("356,206 404,182 440,198 446,240 424,292 372,326 340,300"))
    page.fill(loop("180,262 136,236 96,176 66,146 36,140 30,152 54,200 74,268 112,330 190,374"))
    page.fill(oval(252, 278, 132, 118), [(188, 366), (316, 366), (330, 410), (174, 410)])
    page.fill(
        [*arc(252, 172, 82, 46, 180, 360), (338, 186), (166, 186)],
        box(242, 108, 262, 134),
        oval(252, 100, 20, 17),
    )


def umbrella(page: Page) -> None:
    """An open umbrella with a thin stick and a bent handle."""
    tilt = 14.0
    page.fill(turned(arc(256, 262, 222, 206, 180, 360, 60), tilt))
    page.cut(*(turned(oval(x, 266, 56.5, 30), tilt) for x in (89, 200, 312, 423)))
    stick = [(256.0, 240.0), *arc(282, 424, 26, 30, 180, 10)]
    page.stroke(turned(stick, tilt), 11)
    page.stroke(turned(stick[3:], tilt), 17)
    page.fill(turned([(250, 64), (254, 26), (258, 26), (262, 64)], tilt))


def wrench(page: Page) -> None:
    """A combination wrench: an open jaw at one end, a six-sided hole at the other."""
    tilt = -40.0
    handle = path("120,232 170,240 360,242 420,228 420,284 360,270 170,272 120,280")
    page.fill(turned(handle, tilt), turned(oval(84, 256, 66, 62), tilt), turned(oval(436, 256, 48), tilt))
    jaw = turned([*arc(86, 256, 30, 30, -90, 90), (0, 286), (0, 226)], 15, 84, 256)
    page.cut(turned(jaw, tilt), turned(arc(436, 256, 28, 28, 0, 300, 5), tilt))


DRAWINGS: dict[str, Callable[[Page], None]] = {
    drawing.__name__: drawing
    for drawing in (
        aeroplane,
        bed,
        bicycle,
        bookshelf,
        bottle,
        chair,
        floor_lamp,
        hammer,
        key,
        ladder,
        lamp_over_table,
        mug,
        padlock,
        scissors,
        table,
        teapot,
        umbrella,
        wrench,
    )
}


def draw(name: str) -> Image.Image:
    """One example as an image of SIZE x SIZE pixels, each 0 or 255."""
    page = Page()
    DRAWINGS[name](page)
    return page.finished()


def main(folder: Path) -> None:
    """Writes every example into the folder as NAME.png."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in DRAWINGS:
        unfinished = folder / f"{name}.png.tmp"
        draw(name).save(unfinished, format="PNG", optimize=True)
        os.replace(unfinished, folder / f"{name}.png")
    print(f"{len(DRAWINGS)} silhouettes in {folder}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
