"""Targets from a folder of ShapeNetCore models, version 1 or 2, or of any models that are laid out like it.

    ROOT/<synset>/<model>/models/model_normalized.obj    version 2
    ROOT/<synset>/<model>/model.obj                      version 1
    ROOT/all.csv                                         the official split, if it is there

A synset is eight digits. Nothing of ShapeNet comes with this project: its licence forbids that.
"""

import csv
import hashlib
import os
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from autopoly_env.arguments import one_of
from autopoly_env.errors import ConfigError
from autopoly_env.silhouette import Silhouette
from autopoly_env.targets.dice import Dice
from autopoly_env.targets.obj_file import read_obj
from autopoly_env.targets.projection import check_view, silhouette_of

SALT = 4
SYNSETS = {
    "airplane": "02691156",
    "bed": "02818832",
    "bench": "02828884",
    "bottle": "02876657",
    "car": "02958343",
    "chair": "03001627",
    "guitar": "03467517",
    "lamp": "03636649",
    "mug": "03797390",
    "sofa": "04256520",
    "table": "04379243",
}
FILES = ("models/model_normalized.obj", "model.obj")  # version 2, version 1
SPLITS = ("train", "validation", "test")
SHARES = (70, 80)  # per cent: below the first is train, below the second validation, as in the official split
SPLIT_FILE = "all.csv"
SPLIT_WORDS = {"train": "train", "val": "validation", "test": "test"}  # of the split file
N_KEPT = 64  # silhouettes that stay in memory


@dataclass(frozen=True)
class ShapeNetModel:
    """One model of a folder."""

    synset: str
    model: str  # its id
    path: Path

    @property
    def name(self) -> str:
        """category_id, or synset_id for a category without an English name here."""
        names = {synset: name for name, synset in SYNSETS.items()}
        return f"{names.get(self.synset, self.synset)}_{self.model}"


class ShapeNetTargets:
    """Silhouettes of the models of some categories and one split, rendered when they are asked for.

    `categories`: English names (SYNSETS) or synset ids, in a list or with commas between; by default all that are
    there. `split`: "train", "validation" or "test", of the split file if there is one, otherwise by a hash of synset
    and model id (70, 10, 20 per cent); None takes all. `view`: "side", "front" or "top". `resolution` R: pixels a side.

    Seeds 0..n-1 go through all n models in one random order, the next n seeds in another.

    Raises ConfigError for an unknown category, split or view, and for a folder without such models.
    """

    def __init__(
        self,
        root: str | os.PathLike[str],
        categories: str | Sequence[str] | None = None,
        split: str | None = None,
        view: str = "side",
        resolution: int = 256,
    ) -> None:
        self.root, self.categories, self.split = Path(root), categories, split
        self.view, self.resolution = view, resolution
        check_view(view, resolution)
        one_of("split", split, (*SPLITS, None))
        models = find_models(self.root, categories)
        self.models = models if split is None else tuple(_of_split(self.root, models, split))
        if not self.models:
            raise ConfigError(f"{self.root}: none of {len(models)} models is in the split {split!r}; give another")
        self._kept = OrderedDict[ShapeNetModel, Silhouette]()

    @property
    def name(self) -> str:
        """What the source is called in records of results."""
        return "shapenet"

    def sample(self, seed: int) -> Silhouette:
        """The model that comes at this seed. Raises ConfigError for a seed outside 0..2**32 - 1, SilhouetteError,
        naming the file, for one that cannot be used."""
        Dice(SALT, seed)
        turn, position = divmod(seed, len(self.models))
        return self.load(self.models[Dice(SALT, turn).order(len(self.models))[position]])

    def load(self, model: ShapeNetModel) -> Silhouette:
        """The silhouette of one of `models`, named after it. Raises SilhouetteError for one that cannot be used."""
        if model not in self._kept:
            self._kept[model] = silhouette_of(read_obj(model.path), self.view, self.resolution, model.name)
            if len(self._kept) > N_KEPT:
                self._kept.popitem(last=False)
        self._kept.move_to_end(model)
        return self._kept[model]

    def __reduce__(self) -> tuple[Any, ...]:
        return ShapeNetTargets, (self.root, self.categories, self.split, self.view, self.resolution)


def find_models(root: Path, categories: str | Sequence[str] | None = None) -> tuple[ShapeNetModel, ...]:
    """The models of some categories (by default all) under a ShapeNet folder, sorted by synset and id.

    Raises ConfigError for a folder that has none, a category that is unknown or not there.
    """
    try:
        present = sorted(entry.name for entry in os.scandir(root) if _is_synset(entry.name) and entry.is_dir())
    except OSError as error:
        raise ConfigError(f"cannot read {root} ({error.strerror}); give the folder of a ShapeNetCore") from None
    if not present:
        raise ConfigError(f"{root} has no categories (folders of eight digits); give the folder of a ShapeNetCore")
    wanted = present if categories is None else [_synset(category, present) for category in _listed(categories)]
    models = [model for synset in dict.fromkeys(wanted) for model in _models_of(root, synset)]
    if not models:
        what = ", ".join(f"{root / synset}/<model>/{FILES[0]}" for synset in wanted[:1])
        raise ConfigError(f"{root} has no models in {', '.join(wanted)}; expected {what} or .../{FILES[1]}")
    return tuple(models)


def _is_synset(name: str) -> bool:
    return len(name) == 8 and name.isascii() and name.isdigit()


def _listed(categories: str | Sequence[str]) -> list[str]:
    names = categories.split(",") if isinstance(categories, str) else list(categories)
    if not names:
        raise ConfigError(f"no category was given; give some of {', '.join(SYNSETS)}, or synset ids")
    return [name.strip() for name in names]


def _synset(category: str, present: Sequence[str]) -> str:
    synset = SYNSETS.get(category.lower(), category)
    if not _is_synset(synset):
        raise ConfigError(f"category {category!r} is unknown; give one of {', '.join(SYNSETS)}, or a synset id")
    if synset not in present:
        raise ConfigError(f"category {category!r} ({synset}) is not there; there are {', '.join(present)}")
    return synset


def _models_of(root: Path, synset: str) -> list[ShapeNetModel]:
    folder = root / synset
    candidates = [(name, folder / name / file) for name in sorted(os.listdir(folder)) for file in FILES]
    found = {name: path for name, path in reversed(candidates) if path.is_file()}
    return [ShapeNetModel(synset, name, found[name]) for name in sorted(found)]


def _of_split(root: Path, models: Sequence[ShapeNetModel], split: str) -> list[ShapeNetModel]:
    """The models of a split: by the split file if there is one (what it does not list is in none), else by hash."""
    path = root / SPLIT_FILE
    if not path.exists():
        return [model for model in models if _hashed_split(model) == split]
    listed = _read_splits(path)
    return [model for model in models if listed.get((model.synset, model.model)) == split]


def _hashed_split(model: ShapeNetModel) -> str:
    digest = hashlib.sha256(f"{model.synset}/{model.model}".encode()).digest()
    per_cent = int.from_bytes(digest[:8], "big") % 100
    return SPLITS[sum(per_cent >= share for share in SHARES)]


def _read_splits(path: Path) -> dict[tuple[str, str], str]:
    """(synset, model id) → split, from the official file: columns synsetId, modelId and split among others."""
    try:
        with path.open(newline="", encoding="utf-8") as stream:
            rows = csv.DictReader(stream)
            return {(row["synsetId"].zfill(8), row["modelId"]): SPLIT_WORDS[row["split"]] for row in rows}
    except OSError as error:
        raise ConfigError(f"cannot read {path} ({error.strerror}); make it readable, or remove it") from None
    except (KeyError, AttributeError, UnicodeDecodeError, csv.Error) as error:
        raise ConfigError(
            f"{path}: expected columns synsetId, modelId and split (train, val or test), found {error}; "
            "repair it, or remove it to split by a hash"
        ) from None
