"""Targets from a folder of images."""

import os
from collections import OrderedDict
from pathlib import Path
from typing import Any

from autopoly_env.silhouette import Silhouette, find_images, load_silhouette
from autopoly_env.targets.dice import Dice

SALT = 3
N_KEPT = 64  # silhouettes that stay in memory


class FolderTargets:
    """The images of a folder, loaded when they are asked for.

    Seeds 0..n-1 go through all n images in one random order, the next n seeds in another. Train and test seeds give
    the same images: split such data by folder.

    Raises SilhouetteError for a folder without images.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = Path(folder)
        self.paths = tuple(find_images([folder]))
        self._kept = OrderedDict[Path, Silhouette]()

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
        naming the file, for one that cannot be used."""
        Dice(SALT, seed)
        turn, position = divmod(seed, len(self.paths))
        return self._load(self.paths[Dice(SALT, turn).order(len(self.paths))[position]])

    def _load(self, path: Path) -> Silhouette:
        if path not in self._kept:
            self._kept[path] = load_silhouette(path)
            if len(self._kept) > N_KEPT:
                self._kept.popitem(last=False)
        self._kept.move_to_end(path)
        return self._kept[path]

    def __reduce__(self) -> tuple[Any, ...]:
        return FolderTargets, (self.folder,)  # without the images: a worker loads its own
