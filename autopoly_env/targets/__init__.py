"""Where targets come from: random constructions, drawings of made-up things, folders of images and of 3-D models.

A source gives a `Silhouette` for every seed, the same one each time:

>>> make_targets("construction", difficulty=3).sample(split_seed("test", 0)).name
'construction_2147483648'
"""

import inspect
import os
from dataclasses import fields
from typing import Any

from autopoly_env.errors import ConfigError
from autopoly_env.silhouette import ObjectOptions
from autopoly_env.targets.construction import ConstructionTargets
from autopoly_env.targets.folder import FolderTargets
from autopoly_env.targets.objects import ObjectTargets
from autopoly_env.targets.shapenet import ShapeNetTargets
from autopoly_env.targets.source import HELD_OUT, LEARNING, SPLITS, TargetSource, split_seed

__all__ = [
    "HELD_OUT",
    "LEARNING",
    "SPLITS",
    "ConstructionTargets",
    "FolderTargets",
    "ObjectTargets",
    "ShapeNetTargets",
    "TargetSource",
    "make_targets",
    "split_seed",
]

_KINDS: dict[str, type[ConstructionTargets] | type[ObjectTargets] | type[ShapeNetTargets]] = {
    "construction": ConstructionTargets,
    "objects": ObjectTargets,
    "shapenet": ShapeNetTargets,
}


def make_targets(name_or_folder: str | os.PathLike[str], **options: Any) -> TargetSource:
    """The source "construction", "objects" or "shapenet" with its options, or else the images of a folder.

    The options of a folder are those of `ObjectOptions`.

    Raises ConfigError for another name, for an option that the source does not have or allow, or needs; SilhouetteError
    for a folder without images.
    """
    name = os.fspath(name_or_folder)
    if name not in _KINDS:
        if not os.path.isdir(name):
            raise ConfigError(f"targets {name!r}: expected {', '.join(_KINDS)} or the path of a folder of images")
        known = [field.name for field in fields(ObjectOptions)]
        strange = [option for option in options if option not in known]
        if strange:
            raise ConfigError(f"targets {name!r}: folders have no option {strange[0]!r}; give {', '.join(known)}")
        return FolderTargets(name, ObjectOptions(**options))
    allowed = inspect.signature(_KINDS[name]).parameters
    unknown = [option for option in options if option not in allowed]
    if unknown:
        raise ConfigError(f"targets {name!r} have no option {unknown[0]!r}; give one of {', '.join(allowed)}")
    needed = [option for option, p in allowed.items() if p.default is p.empty and option not in options]
    if needed:
        raise ConfigError(f"targets {name!r} need the option {needed[0]!r}; give it")
    return _KINDS[name](**options)
