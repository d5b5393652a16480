"""Draws docs/pictures/pictures-in.png: pictures as people have them, and the object that is found in each."""

import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFilter, ImageFont

from autopoly_env.export.sheet import save_png
from autopoly_env.silhouette import ObjectOptions, load_silhouette, thumbnail
from autopoly_env.viewer import INK, MATCH, PAPER, SOFT_INK

SIZE, GAP, TEXT = 180, 12, 24  # pixels: a picture, between two, the line beneath
PICTURES = Path(__file__).parent / "pictures"


def cup(colour: str = "#303038", ground: str = "white") -> Image.Image:
    """A cup with a handle."""
    page = Image.new("RGB", (4 * SIZE, 4 * SIZE), ground)
    pen = ImageDraw.Draw(page)
    pen.ellipse((400, 230, 600, 460), outline=colour, width=48)
    pen.polygon([(140, 180), (500, 180), (470, 540), (170, 540)], fill=colour)
    return page.resize((SIZE, SIZE), Image.Resampling.BOX)


def face() -> Image.Image:
    """A yellow face on white."""
    page = Image.new("RGB", (4 * SIZE, 4 * SIZE), "white")
    pen = ImageDraw.Draw(page)
    pen.ellipse((90, 90, 630, 630), fill="#ffd23c")
    for x in (250, 410):
        pen.ellipse((x, 260, x + 60, 350), fill="#332211")
    pen.arc((220, 300, 500, 520), 20, 160, fill="#332211", width=28)
    return page.resize((SIZE, SIZE), Image.Resampling.BOX)


def dim() -> Image.Image:
    """The cup in a photo, darker towards the corners, and with grain."""
    x, y = np.meshgrid(*2 * [np.linspace(-1, 1, SIZE)])
    light = (1.0 - 0.33 * (x**2 + y**2))[..., None]
    grain = np.random.default_rng(0).normal(0, 3, (SIZE, SIZE, 1))
    levels = np.asarray(cup("#4a4a52", "#dcd8d0")) * light + grain
    return Image.fromarray(np.clip(levels, 0, 255).astype(np.uint8))


def framed() -> Image.Image:
    """The cup on a scanned page with its dark edge."""
    page = cup()
    ImageDraw.Draw(page).rectangle((0, 0, SIZE - 1, SIZE - 1), outline="#181818", width=4)
    return page


def tile() -> Image.Image:
    """A white tile with clear, round corners and the cup on it."""
    page, alpha = cup(), Image.new("L", (SIZE, SIZE))
    ImageDraw.Draw(alpha).rounded_rectangle((0, 0, SIZE - 1, SIZE - 1), 36, fill=255)
    page.putalpha(alpha)
    return page


def sprite() -> Image.Image:
    """A red cup with a soft shadow, on nothing."""
    shape = Image.fromarray(np.asarray(cup().convert("L")) < 128).convert("L")
    shadow = Image.new("L", (SIZE, SIZE))
    shadow.paste(shape.point(lambda level: level * 160 // 255), (9, 9))
    page = Image.new("RGBA", (SIZE, SIZE))
    page.putalpha(shadow.filter(ImageFilter.GaussianBlur(3)))
    page.paste(Image.new("RGBA", (SIZE, SIZE), "#c8382c"), mask=shape)
    return page


CELLS = (
    ("dark on light", cup(), {}),
    ("by colour", face(), {}),
    ("--object dark", face(), {"object": "dark"}),
    ("uneven light", dim(), {}),
    ("a scan's edge", framed(), {}),
    ("an opaque tile", tile(), {}),
    ("--object dark", tile(), {"object": "dark"}),
    ("without its shadow", sprite(), {}),
)


def cell(title: str, picture: Image.Image, options: dict[str, str]) -> Image.Image:
    """A picture, the object found in it, and what helped."""
    page = Image.new("RGB", (2 * SIZE + GAP, SIZE + TEXT), PAPER)
    page.paste(thumbnail(picture, SIZE), (0, 0))
    mask = load_silhouette(picture, options=ObjectOptions(**options)).mask  # type: ignore[arg-type]
    page.paste(Image.fromarray(np.where(mask[..., None], MATCH, PAPER).astype(np.uint8)), (SIZE, 0))
    pen = ImageDraw.Draw(page)
    pen.rectangle((0, 0, 2 * SIZE - 1, SIZE - 1), outline=SOFT_INK)
    pen.text((2, SIZE + 4), title, INK, ImageFont.load_default(14))
    return page


def main(folder: Path = PICTURES) -> None:
    """Write the picture: two cells a row."""
    cells = [cell(*given) for given in CELLS]
    rows = [np.hstack([np.asarray(one) for one in cells[i : i + 2]]) for i in range(0, len(cells), 2)]
    save_png(Image.fromarray(np.vstack(rows)), folder / "pictures-in.png")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
