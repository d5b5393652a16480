"""Finding images: the files, directories and patterns that a user names become a list of image files."""

import glob
import os
from collections.abc import Iterable, Sequence
from pathlib import Path

from autopoly_env.errors import SilhouetteError

IMAGE_SUFFIXES = (".bmp", ".gif", ".jpeg", ".jpg", ".pgm", ".png", ".ppm", ".tif", ".tiff", ".webp")


def find_images(paths: Sequence[str | os.PathLike[str]]) -> list[Path]:
    """Expand files, directories and glob patterns into image files, in the order given and each file once.

    A directory gives its images (by suffix, sorted, not those in its subdirectories, no hidden files); so
    does a pattern, in which `**` crosses directories. A file named outright is taken whatever its suffix.

    Raises SilhouetteError for a directory without images and for a path or pattern that matches none.
    """
    found: dict[Path, None] = {}
    for path in paths:
        found.update(dict.fromkeys(_expanded(os.fspath(path))))
    return list(found)


def _expanded(path: str) -> list[Path]:
    if os.path.isfile(path):
        return [Path(path)]
    if os.path.isdir(path):
        images = _only_images(os.path.join(path, entry) for entry in os.listdir(path))
        if not images:
            kinds = " ".join(IMAGE_SUFFIXES)
            raise SilhouetteError(f"directory {path!r} holds no images ({kinds}); give one that does")
        return images
    images = _only_images(glob.iglob(path, recursive=True))
    if not images:
        raise SilhouetteError(f"{path!r} matches no image; expected a file, a directory or a pattern: check the path")
    return images


def _only_images(paths: Iterable[str]) -> list[Path]:
    candidates = sorted(map(Path, paths))
    return [
        path
        for path in candidates
        if path.suffix.lower() in IMAGE_SUFFIXES and not path.name.startswith(".") and path.is_file()
    ]
