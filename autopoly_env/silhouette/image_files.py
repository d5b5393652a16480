"""Finding images: the files, directories and patterns that a user names become a list of image files."""

import glob
import os
from collections.abc import Iterable, Sequence
from pathlib import Path

from autopoly_env.errors import SilhouetteError

# What Pillow reads without a program beside it, and SVG.
_KINDS = (
    "apng avif avifs blp bmp bw cur dcx dds dib fit fits flc fli ftc ftu gbr gif icb icns ico im j2c j2k jfif jp2 jpc "
    "jpe jpeg jpf jpg jpx mpo msp pbm pcd pcx pfm pgm png pnm ppm psd pxr qoi ras rgb rgba sgi svg svgz tga tif tiff "
    "vda vst webp xbm xpm"
)
IMAGE_SUFFIXES = tuple(f".{kind}" for kind in _KINDS.split())


def find_images(paths: Sequence[str | os.PathLike[str]], skipped: list[Path] | None = None) -> list[Path]:
    """Expand files, directories and glob patterns into image files, in the order given and each file once.

    A directory gives its images (by suffix, sorted, not those in its subdirectories, no hidden files); so
    does a pattern, in which `**` crosses directories. A file named outright is taken whatever its suffix. What is left
    out of a directory, hidden files apart, is added to `skipped`.

    Raises SilhouetteError for a directory without images and for a path or pattern that matches none.
    """
    found: dict[Path, None] = {}
    for path in paths:
        found.update(dict.fromkeys(_expanded(os.fspath(path), [] if skipped is None else skipped)))
    return list(found)


def _expanded(path: str, skipped: list[Path]) -> list[Path]:
    if os.path.isfile(path):
        return [Path(path)]
    if os.path.isdir(path):
        entries = [Path(path, entry) for entry in os.listdir(path) if not entry.startswith(".")]
        images = _only_images(entries)
        if not images:
            kinds = "such as .png, .jpg, .webp, .gif, .tif, .svg"
            raise SilhouetteError(f"directory {path!r} holds no images ({kinds}); give one that does")
        skipped += sorted(entry for entry in set(entries).difference(images) if entry.is_file())
        return images
    images = _only_images(glob.iglob(path, recursive=True))
    if not images:
        raise SilhouetteError(f"{path!r} matches no image; expected a file, a directory or a pattern: check the path")
    return images


def _only_images(paths: Iterable[str | Path]) -> list[Path]:
    candidates = sorted(map(Path, paths))
    return [
        path
        for path in candidates
        if path.suffix.lower() in IMAGE_SUFFIXES and not path.name.startswith(".") and path.is_file()
    ]
