"""Targets from a folder of images."""

import os
import warnings
from collections import OrderedDict
from pathlib import Path
from typing import Any

from autopoly_env.errors import SilhouetteError
from autopoly_env.silhouette import DEFAULT_OPTIONS, ObjectOptions, Silhouette, find_images, load_silhouette
from autopoly_env.targets.dice import Dice

SALT = 3
N_KEPT = 64  # silhouettes that stay in memory
MOST_NAMED = 3  # pictures that a warning names


class FolderTargets:
    """The images of a folder, loaded when they are asked for.

    Every image is read once in the beginning: one in which no object is found is left out, with a warning. Seeds 0..n-1
    go through all n images in one random order, the next n seeds in another. Train and test seeds give the same images:
    split such data by folder. `options` say what in the pictures is the object.

    Raises SilhouetteError for a folder without images, and for one in whose images there is no object.
    """

    def __init__(self, folder: str | os.PathLike[str], options: ObjectOptions = DEFAULT_OPTIONS) -> None:
        self.folder = Path(folder)
        self.options = options
        self._kept = OrderedDict[Path, Silhouette]()
        self.paths = self._usable(find_images([folder]))

    @property
    def name(self) -> str:
        """The folder's name."""
        return self.folder.resolve().name

    @property
    def names(self) -> tuple[str, ...]:
        """The images' names, sorted."""
        return tuple(path.stem for path in self.paths)

    def sample(self, seed: int) -> Silhouette:
        """The image that comes at this seed. Raises ConfigError for a seed outside 0..2**32 - 1, SilhouetteError,
        naming the file, for one that cannot be used any more."""
        Dice(SALT, seed)
        turn, position = divmod(seed, len(self.paths))
        return self._load(self.paths[Dice(SALT, turn).order(len(self.paths))[position]])

    def _usable(self, paths: list[Path]) -> tuple[Path, ...]:
        """The images in which an object is found; a warning names the others."""
        problems: dict[Path, str] = {}
        for path in paths:
            try:
                self._load(path)
            except SilhouetteError as problem:
                problems[path] = str(problem)
        if not problems:
            return tuple(paths)
        told = "; ".join(list(problems.values())[:MOST_NAMED])
        if len(problems) == len(paths):
            raise SilhouetteError(f"directory {str(self.folder)!r} holds no picture with an object: {told}")
        left_out = f"{len(problems)} of {len(paths)} pictures in {str(self.folder)!r} left out: {told}"
        warnings.warn(left_out, stacklevel=4)
        return tuple(path for path in paths if path not in problems)

    def _load(self, path: Path) -> Silhouette:
        if path not in self._kept:
            self._kept[path] = load_silhouette(path, options=self.options)
            if len(self._kept) > N_KEPT:
                self._kept.popitem(last=False)
        self._kept.move_to_end(path)
        return self._kept[path]

    def __reduce__(self) -> tuple[Any, ...]:
        return _of_paths, (self.folder, self.options, self.paths)  # without the images: a worker loads its own


def _of_paths(folder: Path, options: ObjectOptions, paths: tuple[Path, ...]) -> FolderTargets:
    """The source that was pickled; its images are not read again."""
    source = FolderTargets.__new__(FolderTargets)
    source.folder, source.options, source.paths = folder, options, paths
    source._kept = OrderedDict()
    return source
