"""The targets that a suite names, as a list of things to load: small enough to be sent to any worker."""

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import ClassVar, Literal

from autopoly_env.errors import ConfigError, SilhouetteError
from autopoly_env.files import file_stem
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import DEFAULT_OPTIONS, ObjectOptions, Silhouette, find_images, load_silhouette
from autopoly_env.targets import ConstructionTargets, ObjectTargets, split_seed
from autopoly_env.targets.obj_file import read_obj
from autopoly_env.targets.projection import silhouette_of
from autopoly_env.targets.shapenet import ShapeNetTargets


@dataclass(frozen=True)
class SuiteTarget(ABC):
    """One target. Its name is unlike that of any other of the suite and can be the name of a file."""

    name: str
    is_known: ClassVar[bool] = False  # how it was made

    @abstractmethod
    def load(self) -> Silhouette:
        """The silhouette. Raises SilhouetteError for an image that cannot be used."""

    def known(self) -> ConstructionSequence | None:
        """How it was made, if `is_known`."""
        return None


@dataclass(frozen=True)
class ConstructionSpec:
    """`n` shapes of the random construction simulator, whose own meshes are known."""

    kind: Literal["construction"]
    n: int = 50
    difficulty: tuple[int, int] = (1, 5)
    operators: str = "paper"
    resolution: int = 128
    split: Literal["train", "test"] = "test"

    def source(self) -> ConstructionTargets:
        """Where the shapes come from. Raises ConfigError for settings out of range."""
        return ConstructionTargets(self.difficulty, self.operators, self.resolution)

    def targets(self) -> Sequence[SuiteTarget]:
        """The shapes number 0 to n - 1 of the split."""
        seeds = [split_seed(self.split, i) for i in range(self.n)]
        return [_ConstructionTarget(f"{self.source().name}_{seed}", self, seed) for seed in seeds]


@dataclass(frozen=True)
class ObjectsSpec:
    """`n` drawings of man-made things."""

    kind: Literal["objects"]
    n: int = 41
    families: tuple[str, ...] | None = None  # those of version 0
    resolution: int = 256
    split: Literal["train", "test"] = "test"

    def source(self) -> ObjectTargets:
        """Where the drawings come from. Raises ConfigError for settings out of range."""
        return ObjectTargets(self.families, self.resolution)

    def targets(self) -> Sequence[SuiteTarget]:
        """The drawings number 0 to n - 1 of the split."""
        source = self.source()
        seeds = [split_seed(self.split, i) for i in range(self.n)]
        return [_ObjectTarget(source.sample(seed).name, self, seed) for seed in seeds]


@dataclass(frozen=True)
class FolderSpec:
    """The images of a folder, in the order of their names."""

    kind: Literal["folder"]
    root: str = ""  # a folder, or a pattern in which ** crosses folders
    picture: ObjectOptions | None = None  # what in the pictures is the object; None leaves that to each
    n: int | None = None  # the first so many

    def targets(self) -> Sequence[SuiteTarget]:
        """The images, each with a name of its own: its file's, with a number where another has that already."""
        if not self.root:
            raise ConfigError("this suite needs a folder of images; give python -m training.evaluate DIR")
        try:
            paths = find_images([self.root])[: self.n]
        except SilhouetteError as error:
            raise ConfigError(str(error)) from None
        stems = [file_stem(path).replace("\\", "_") for path in paths]
        names = _unlike(stems)
        return [_ImageTarget(name, path.resolve(), self.picture) for name, path in zip(names, paths, strict=True)]


@dataclass(frozen=True)
class ShapenetSpec:
    """Silhouettes of the models in a ShapeNet folder, as `ShapeNetTargets` has them."""

    kind: Literal["shapenet"]
    root: str = ""
    categories: tuple[str, ...] | None = None  # all
    split: Literal["train", "validation", "test"] | None = "test"
    view: str = "side"
    resolution: int = 256
    n: int | None = None  # the first so many of each category

    def targets(self) -> Sequence[SuiteTarget]:
        """The models, in the order of their categories and ids."""
        if not self.root:
            raise ConfigError("this suite needs a folder of ShapeNet models; give --set targets.root=DIR")
        models = ShapeNetTargets(self.root, self.categories, self.split, self.view, self.resolution).models
        n_of, chosen = Counter[str](), []
        for model in models:
            n_of[model.synset] += 1
            if self.n is None or n_of[model.synset] <= self.n:
                chosen.append(_ModelTarget(model.name, model.path.resolve(), self.view, self.resolution))
        return chosen


TargetSpec = ConstructionSpec | ObjectsSpec | FolderSpec | ShapenetSpec


@dataclass(frozen=True)
class _ConstructionTarget(SuiteTarget):
    is_known: ClassVar[bool] = True
    spec: ConstructionSpec
    seed: int

    def load(self) -> Silhouette:
        return self.spec.source().sample(self.seed)

    def known(self) -> ConstructionSequence | None:
        return self.spec.source().sample_sequence(self.seed)


@dataclass(frozen=True)
class _ObjectTarget(SuiteTarget):
    spec: ObjectsSpec
    seed: int

    def load(self) -> Silhouette:
        return self.spec.source().sample(self.seed)


@dataclass(frozen=True)
class _ImageTarget(SuiteTarget):
    path: Path
    picture: ObjectOptions | None = None

    def load(self) -> Silhouette:
        return load_silhouette(self.path, name=self.name, options=self.picture or DEFAULT_OPTIONS)


@dataclass(frozen=True)
class _ModelTarget(SuiteTarget):
    path: Path
    view: str
    resolution: int

    def load(self) -> Silhouette:
        return silhouette_of(read_obj(self.path), self.view, self.resolution, self.name)


def _unlike(names: Sequence[str]) -> list[str]:
    """The names, with a number where one has come before; letter case does not tell names apart."""
    taken: set[str] = set()
    unlike = []
    for name in names:
        free, count = name, 1
        while free.casefold() in taken:
            count += 1
            free = f"{name}-{count}"
        taken.add(free.casefold())
        unlike.append(free)
    return unlike


@lru_cache(maxsize=4)
def load_target(target: SuiteTarget) -> Silhouette:
    """The silhouette of a target; the last few stay in memory, for the agents that come next."""
    return target.load()
