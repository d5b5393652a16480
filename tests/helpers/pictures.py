"""Pictures drawn for the tests of silhouettes: shapes in colours, with what pictures have around them."""

import io
from typing import Any

import numpy as np
from hypothesis import strategies as st
from PIL import Image, ImageDraw

from autopoly_env.silhouette.colours import oklab

SIZE = 96  # pixels a side


def chair(size: int = SIZE) -> np.ndarray:
    """A chair seen from the side, away from the border: no symmetry."""
    mask = Image.new("1", (size, size))
    pen, unit = ImageDraw.Draw(mask), size / 96
    for box in ((30, 10, 38, 84), (30, 46, 68, 56), (60, 46, 68, 84)):
        pen.rectangle([round(unit * value) for value in box], fill=1)
    return np.array(mask)


def disc(size: int, radius: float, centre: tuple[float, float] = (0.5, 0.5)) -> np.ndarray:
    """A disc; radius and centre in units of the picture's side."""
    x, y = np.meshgrid(*2 * [(np.arange(size) + 0.5) / size])
    return (x - centre[0]) ** 2 + (y - centre[1]) ** 2 < radius**2


def painted(mask: np.ndarray, colour: Any = (0, 0, 0), ground: Any = (255, 255, 255)) -> np.ndarray:
    """The object in one colour, the rest in another: (H, W, 3) uint8."""
    return np.where(mask[..., None], np.array(colour, np.uint8), np.array(ground, np.uint8))


def antialiased(size: int, parts: Any, ground: Any = (255, 255, 255)) -> tuple[np.ndarray, np.ndarray]:
    """Parts (a mask of 8 times the size, and its colour) one over the other on a ground, reduced."""
    large = np.zeros((8 * size, 8 * size, 4))
    for mask, colour in parts:
        large[mask] = (*colour, 1)
    large[..., :3] = np.where(large[..., 3:] > 0, large[..., :3], ground)
    small = large.reshape(size, 8, size, 8, 4).mean(axis=(1, 3))
    return np.rint(small[..., :3]).astype(np.uint8), small[..., 3] >= 0.5


def faded(picture: np.ndarray, amount: float) -> np.ndarray:
    """The picture under light that falls off towards the corners, as far as to 1 - amount."""
    height, width = picture.shape[:2]
    x, y = np.meshgrid(np.linspace(-1, 1, width), np.linspace(-1, 1, height))
    return np.rint(picture * (1 - 0.5 * amount * (x**2 + y**2))[..., None]).astype(np.uint8)


def encoded(picture: np.ndarray | Image.Image, format: str, **options: Any) -> io.BytesIO:
    """The picture as a file of that format."""
    stream = io.BytesIO()
    (picture if isinstance(picture, Image.Image) else Image.fromarray(picture)).save(stream, format, **options)
    stream.seek(0)
    return stream


def iou(one: np.ndarray, other: np.ndarray) -> float:
    """The shared area of two masks over that of both together."""
    return float((one & other).sum() / (one | other).sum())


@st.composite
def pictures(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray, str]:
    """A picture (H, W, 3 or 4) uint8 of a shape on a ground, its mask, and what else is in it."""
    mask = draw(shapes())
    levels = st.tuples(*3 * [st.integers(0, 255)])
    ground = draw(levels)
    colour = draw(levels.filter(lambda colour: _distance(colour, ground) > 0.2))
    picture = painted(mask, colour, ground)
    extra = draw(st.sampled_from(["nothing", "frame", "specks", "alpha", "soft corners", "gradient"]))
    if extra == "frame":
        light, dark = (255, 250, 240), (40, 45, 50)
        picture = painted(mask, draw(st.sampled_from([dark, (180, 40, 40)])), light)
        width = draw(st.integers(1, 3))
        for _ in range(4):
            picture[:width] = dark
            picture = np.rot90(picture)
    elif extra == "specks":
        free = np.argwhere(~_grown(mask, 2))
        for row, column in free[:: max(1, len(free) // draw(st.integers(1, 6)))]:
            picture[row, column] = colour
    elif extra == "alpha":
        alpha = np.where(mask, draw(st.integers(60, 255)), 0).astype(np.uint8)
        picture = np.dstack([np.broadcast_to(np.array(colour, np.uint8), picture.shape), alpha])
    elif extra == "soft corners":
        alpha = np.full(mask.shape, 255, np.uint8)
        alpha[[0, 0, -1, -1], [0, -1, 0, -1]] = draw(st.integers(0, 200))
        picture = np.dstack([picture, alpha])
    elif extra == "gradient":
        dark, light = sorted((colour, ground), key=sum)
        if sum(light) - sum(dark) < 380:
            dark, light = (20, 30, 40), (230, 220, 200)
        picture = faded(painted(mask, dark, light), draw(st.floats(0.1, 0.35)))
    return picture, mask, extra


@st.composite
def shapes(draw: st.DrawFn) -> np.ndarray:
    """A few overlapping discs and boxes, away from the border, and no thinner than a few pixels."""
    mask = np.zeros((SIZE, SIZE), dtype=bool)
    x, y = 48, 48
    for _ in range(draw(st.integers(1, 4))):
        half = draw(st.integers(5, 14)), draw(st.integers(5, 14))
        mask[y - half[1] : y + half[1], x - half[0] : x + half[0]] = True
        mask |= disc(SIZE, draw(st.floats(0.06, 0.14)), (x / SIZE, y / SIZE))
        x = int(np.clip(x + draw(st.integers(-half[0], half[0])), 24, 72))
        y = int(np.clip(y + draw(st.integers(-half[1], half[1])), 24, 72))
    return mask


def _distance(one: Any, other: Any) -> float:
    return float(np.linalg.norm(oklab(np.array(one, np.uint8)) - oklab(np.array(other, np.uint8))))


def _grown(mask: np.ndarray, by: int) -> np.ndarray:
    grown = mask.copy()
    for axis in (0, 1):
        for step in range(-by, by + 1):
            grown |= np.roll(mask, step, axis)
    return grown
