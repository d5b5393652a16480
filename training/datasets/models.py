"""Silhouettes of 3-D models as pictures: OBJ files, whatever else trimesh reads, and folders of ShapeNet."""

import io
import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from autopoly_env.errors import ConfigError, SilhouetteError
from autopoly_env.files import write_atomically
from autopoly_env.targets.obj_file import read_obj
from autopoly_env.targets.projection import Surface, check_view, silhouette_of
from autopoly_env.targets.shapenet import ShapeNetTargets

INDEX = "silhouettes.jsonl"


@dataclass(frozen=True)
class ModelTask:
    """One model to be drawn."""

    model: Path
    name: str  # unlike that of the others
    view: str
    resolution: int


def tasks_of(
    given: Sequence[Path], view: str, resolution: int, categories: str | None = None, split: str | None = None
) -> list[ModelTask]:
    """A task for every file, and for every model of a category and split in every folder, which is a ShapeNet's.

    Raises ConfigError for a folder that is none, and for settings out of range.
    """
    check_view(view, resolution)
    models: dict[Path, str] = {}
    for path in given:
        if os.path.isdir(path):
            found = ShapeNetTargets(path, categories, split, view, resolution).models
            models |= {model.path: model.name for model in found}
        else:
            models[path] = path.stem or "model"
    taken: set[str] = set()
    tasks = []
    for path, stem in models.items():
        name, count = stem, 1
        while name.casefold() in taken:
            count += 1
            name = f"{stem}-{count}"
        taken.add(name.casefold())
        tasks.append(ModelTask(path, name, view, resolution))
    return tasks


def draw_model(task: ModelTask) -> bytes:
    """The silhouette as the bytes of a PNG, white on black. Raises SilhouetteError for a model that has none."""
    surface = read_obj(task.model) if task.model.suffix.lower() == ".obj" else _read_with_trimesh(task.model)
    silhouette = silhouette_of(surface, task.view, task.resolution, task.name)
    stream = io.BytesIO()
    Image.fromarray(silhouette.mask).save(stream, "PNG", optimize=True)
    return stream.getvalue()


def needs_trimesh(tasks: Sequence[ModelTask]) -> None:
    """Raise ConfigError if one of the models needs trimesh and it is not installed."""
    others = [task.model for task in tasks if task.model.suffix.lower() != ".obj"]
    if others:
        try:
            import trimesh  # noqa: F401
        except ImportError:
            raise ConfigError(f"{others[0]} needs trimesh; pip install -e '.[bench]', or give .obj files") from None


def write_index(folder: Path, records: Sequence[dict[str, str | None]]) -> None:
    """Write what became of every model: its path, its picture, what was wrong with it. Raises OutputError."""
    write_atomically(folder / INDEX, "".join(json.dumps(record) + "\n" for record in records))


def _read_with_trimesh(path: Path) -> Surface:
    """The triangles of all that is in a file. Raises SilhouetteError for one that trimesh cannot read."""
    import trimesh

    if not os.path.isfile(path):
        raise SilhouetteError(f"cannot read {path} (no such file); give the file of a model")
    try:
        mesh = trimesh.load_scene(path).to_mesh()
        vertices, triangles = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
    except Exception as error:  # its readers raise almost anything
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise SilhouetteError(f"trimesh cannot read {path} ({reason[:120]})") from None
    if not len(triangles) or not np.isfinite(vertices).all():
        raise SilhouetteError(f"{path} has no triangles, or a vertex that is not finite; repair it")
    return Surface(vertices, triangles.ravel(), np.arange(0, triangles.size + 1, 3))
