"""How often the object of a picture is found: `python -m benchmarks.pictures [--cases DIR] [--sprites DIR]`.

`--cases`: a folder of pictures as people have them, each with a known right mask (see RIGHT). `--sprites`: any folder
of sprites with an alpha channel; they are put on white, on grey and on a colour, and masks are compared with alpha;
with `--jpeg QUALITY` each is saved as JPEG before.
"""

import argparse
import io
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image
from rich.console import Console
from rich.table import Table

from autopoly_env.arrays import BoolArray
from autopoly_env.errors import AutoPolyError
from autopoly_env.silhouette import IMAGE_SUFFIXES, Silhouette, load_silhouette

BASE = "chair-base.png"  # the picture that most others show, too
GOOD = 0.95  # IoU from which a mask is right
BAD = 0.9  # and below which a user has to be told
GROUNDS = {"white": (255, 255, 255), "grey 200": (200, 200, 200), "colour": (96, 160, 120)}
SMALLEST, LARGEST = 16, 600  # pixels a side of a sprite
CLEAR_BORDER = 0.5  # share of a sprite's border that has to be clear: it is no tile of a larger picture
UNSEEN = 8, 0.05  # a sprite is not to be seen on a ground from which more of it differs by no more levels

Rule = Callable[[Path], BoolArray]


def dark(path: Path) -> BoolArray:
    """Every pixel darker than the middle grey."""
    return np.asarray(Image.open(path).convert("L")) < 128


def like_base(path: Path) -> BoolArray:
    """The same as the base."""
    return dark(path.with_name(BASE))


def turned_base(path: Path) -> BoolArray:
    """The base, once its quarter turn is undone: these files hold it lying down and say so."""
    return np.rot90(dark(path), -1)


def opaque(path: Path) -> BoolArray:
    """Every pixel that is opaque, by half."""
    return np.asarray(Image.open(path).convert("RGBA").getchannel("A")) >= 128


def coloured_or_dark(path: Path) -> BoolArray:
    """Every pixel that is not nearly white."""
    return np.asarray(Image.open(path).convert("RGB")).min(axis=2) < 200


def red(path: Path) -> BoolArray:
    """Every solid red pixel."""
    red, green, blue, alpha = np.moveaxis(np.asarray(Image.open(path).convert("RGBA")).astype(int), 2, 0)
    return (red > 120) & (red > 2 * np.maximum(green, blue)) & (alpha > 250)


def second_frame(path: Path) -> BoolArray:
    """The dark pixels of the second frame."""
    image = Image.open(path)
    image.seek(1)
    return np.asarray(image.convert("L")) < 128


def pale(path: Path) -> BoolArray:
    """Every pixel that is not white."""
    return np.asarray(Image.open(path).convert("L")) < 247


def filled(path: Path) -> BoolArray:
    """The dark pixels and the single light ones between them: a dither is a grey square."""
    rows, columns = np.nonzero(dark(path))
    mask = np.zeros(dark(path).shape, dtype=bool)
    mask[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1] = True
    return mask


def none(path: Path) -> BoolArray:
    """Nothing: an error is right."""
    return np.zeros((0, 0), dtype=bool)


_LIKE_BASE = (
    "black-on-transparent.png cmyk.jpg grey-alpha-LA.png grey.tga indexed-magenta-keyed-not-transparent.png "
    "indexed-magenta-transparent.png lossy.avif one-bit.pbm one-bit.png opaque-page-four-soft-corners.png "
    "page-with-black-frame.png pale-grey-on-white.png photo-cast-shadow.jpg photo-uneven-light.jpg "
    "photo-vignette.jpg red-on-equal-luma-grey.png red-on-green.png semi-transparent-object-alpha-110.png "
    "semi-transparent-page-alpha-200.png sixteen-bit-grey-hot-pixels.png sixteen-bit-grey.png "
    "sixteen-bit-low-range.png sixteen-bit.tif white-on-transparent-white.png salt-and-pepper-2-percent.png "
    "salt-and-pepper-10-percent.png animated.png animated.webp dust-30-specks-3px.png"
)


def _square(size: int, start: int, end: int) -> BoolArray:
    mask = np.zeros((size, size), dtype=bool)
    mask[start:end, start:end] = True
    return mask


# What is right, where that is not `dark`.
RIGHT: dict[str, Rule] = {
    **dict.fromkeys(_LIKE_BASE.split(), like_base),
    **dict.fromkeys(("exif-orientation-6.jpg", "exif-orientation-6.png"), turned_base),
    **dict.fromkeys(("sprite-with-light-drop-shadow.png", "sprite-with-soft-drop-shadow.png"), red),
    "rounded-white-tile-transparent-corners.png": opaque,
    "flat-grey-160-body-black-eyes-on-white.png": coloured_or_dark,
    "yellow-face-dark-eyes-on-white.png": coloured_or_dark,
    "animated-first-frame-blank.gif": second_frame,
    "checkerboard-dither-1px.png": filled,
    "drawing.svg": lambda path: _square(1024, 128, 896),
    "page.pdf": none,
    "wide-2000x40-dumbbell.png": pale,
    "all-black.png": none,
    "all-black-one-white-corner.png": lambda path: ~dark(path),
}


@dataclass(frozen=True)
class Found:
    """What came out for a picture: the IoU with what is right, and the notes (or the error)."""

    name: str
    iou: float
    notes: tuple[str, ...]

    @property
    def is_said(self) -> bool:
        """Whether a note names an option that may help."""
        return any("--" in note for note in self.notes)


def cases(folder: Path) -> Iterator[Found]:
    """Every picture of the folder, with the default options."""
    for path in sorted(folder.iterdir()):
        if path.suffix.lower() not in IMAGE_SUFFIXES:
            continue
        right = RIGHT.get(path.name, dark)(path)
        try:
            found = load_silhouette(path)
        except AutoPolyError as error:
            yield Found(path.name, float(right.size == 0), (str(error),))
        else:
            yield Found(path.name, iou(_picture_of(found), _as_large(right, found)), found.notes)


def sprites(folder: Path, most: int | None = None, quality: int | None = None) -> Iterator[tuple[str, Found | None]]:
    """Every sprite on every ground, by the ground's name, None where it is not to be seen on that.

    `most` of them, evenly taken, if there are more; of a `quality` of JPEG where one is given.
    """
    paths = [path for path in sorted(folder.rglob("*.png")) if _is_sprite(path)]
    step = 1 if most is None else max(1, len(paths) // most)
    for path in paths[::step]:
        sprite = Image.open(path).convert("RGBA")
        right = np.asarray(sprite.getchannel("A")) >= 128
        for ground, colour in GROUNDS.items():
            page = Image.new("RGBA", sprite.size, (*colour, 255))
            page.alpha_composite(sprite)
            shown = page.convert("RGB")
            given = shown if quality is None else _as_jpeg(shown, quality)
            yield ground, _found_on(given, right, path) if _is_seen(shown, colour, right) else None


def _as_jpeg(page: Image.Image, quality: int) -> Image.Image:
    stream = io.BytesIO()
    page.save(stream, "JPEG", quality=quality)
    return Image.open(stream)


def _found_on(page: Image.Image, right: BoolArray, path: Path) -> Found:
    try:
        found = load_silhouette(page)
    except AutoPolyError as error:
        return Found(str(path), 0.0, (f"{error} --",))  # whoever sees an error is told
    return Found(str(path), iou(_picture_of(found), right), found.notes)


def _is_seen(page: Image.Image, ground: tuple[int, int, int], right: BoolArray) -> bool:
    alike = (np.abs(np.asarray(page).astype(int) - ground).max(axis=2) <= UNSEEN[0]) & right
    return bool(alike.sum() <= UNSEEN[1] * right.sum())


def iou(one: BoolArray, other: BoolArray) -> float:
    """The shared area of two masks (H, W) over that of both together."""
    return float((one & other).sum() / max(1, (one | other).sum()))


def _is_sprite(path: Path) -> bool:
    with Image.open(path) as image:
        if min(image.size) < SMALLEST or max(image.size) > LARGEST or not image.has_transparency_data:
            return False
        clear = np.asarray(image.convert("RGBA").getchannel("A")) < 128
    around = np.concatenate([clear[0], clear[-1], clear[:, 0], clear[:, -1]])
    return bool(around.mean() >= CLEAR_BORDER and not clear.all())


def _picture_of(silhouette: Silhouette) -> BoolArray:
    """The mask without its padding."""
    height, width = silhouette.picture_shape or silhouette.mask.shape
    top, left = (silhouette.resolution - height) // 2, (silhouette.resolution - width) // 2
    return silhouette.mask[top : top + height, left : left + width]


def _as_large(right: BoolArray, found: Silhouette) -> BoolArray:
    """What is right, at the size of what was found: large pictures are reduced when they are read."""
    height, width = found.picture_shape or found.mask.shape
    if right.shape == (height, width):
        return right
    return np.asarray(Image.fromarray(right).convert("L").resize((width, height), Image.Resampling.BOX)) >= 128


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a table for each folder that was given; 1 if a case is wrong without a word."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.pictures", description=__doc__)
    parser.add_argument("--cases", type=Path, metavar="DIR", help="pictures whose right masks are known")
    parser.add_argument("--sprites", type=Path, metavar="DIR", help="sprites with an alpha channel")
    parser.add_argument("--most", type=int, metavar="N", help="of the sprites, evenly taken")
    parser.add_argument("--jpeg", type=int, metavar="QUALITY", help="of the JPEG that sprites are saved as before")
    parser.add_argument("--list", action="store_true", help="name the sprites that came out badly, too")
    options = parser.parse_args(arguments)
    console = Console() if sys.stdout.isatty() else Console(width=140)
    n_wrong = 0
    if options.cases:
        n_wrong = _show_cases(list(cases(options.cases)), console)
    if options.sprites:
        _show_sprites(list(sprites(options.sprites, options.most, options.jpeg)), console, options.list)
    return int(n_wrong > 0)


def _show_cases(found: list[Found], console: Console) -> int:
    table = Table("picture", "IoU", "notes", title=f"masks against the right ones: {len(found)} pictures")
    for one in found:
        table.add_row(one.name, f"{one.iou:.3f}", "; ".join(one.notes))
    console.print(table)
    wrong = [one for one in found if one.iou < GOOD]
    silent = [one for one in wrong if not one.is_said]
    console.print(f"{len(found) - len(wrong)} of {len(found)} right by default; wrong and not said: {len(silent)}")
    return len(silent)


def _show_sprites(found: list[tuple[str, Found | None]], console: Console, names: bool) -> None:
    heads = ("on", "sprites", "not to be seen", "mean IoU", f"below {BAD}", "of them silent")
    table = Table(*heads, title="sprites against their alpha")
    seen = [(ground, one) for ground, one in found if one is not None]
    for ground in GROUNDS:
        here = [one for name, one in seen if name == ground]
        n_unseen = sum(name == ground and one is None for name, one in found)
        bad = [one for one in here if one.iou < BAD]
        silent = sum(not one.is_said for one in bad)
        mean = np.mean([one.iou for one in here]) if here else float("nan")
        table.add_row(ground, str(len(here)), str(n_unseen), f"{mean:.3f}", str(len(bad)), str(silent))
    console.print(table)
    for ground, one in sorted(seen, key=lambda pair: pair[1].iou):
        if names and one.iou < BAD:
            console.print(f"{one.iou:.3f} {ground} {one.name}: {'; '.join(one.notes)}", markup=False, soft_wrap=True)


if __name__ == "__main__":
    sys.exit(main())
