"""The formats that a construction sequence can be written in, by name."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from autopoly_env import viewer
from autopoly_env.arrays import ByteArray
from autopoly_env.export.blender import save_blender_script
from autopoly_env.export.gif import save_gif
from autopoly_env.export.gltf import save_gltf
from autopoly_env.export.obj import to_obj
from autopoly_env.export.player import save_html
from autopoly_env.export.sheet import contact_sheet, save_png
from autopoly_env.export.svg import sequence_to_svg
from autopoly_env.files import write_atomically
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import Silhouette

FRAME_SIZE = 400  # pixels a side of an animation's frame


@dataclass(frozen=True)
class Export:
    """What is to be written: a sequence that replays, and what goes with it."""

    sequence: ConstructionSequence
    target: Silhouette | None = None
    depth: float = 0.0  # thickness of the mesh, in units of the unit square


@dataclass(frozen=True)
class Format:
    """A format: the ending of its files, how one is written, and which parts of an `Export` it shows."""

    suffix: str
    write: Callable[[Export, Path], Path]
    shows_target: bool = False
    shows_depth: bool = False


def _write_svg(export: Export, path: Path) -> Path:
    return write_atomically(path, sequence_to_svg(export.sequence, target=export.target))


def _write_gif(export: Export, path: Path) -> Path:
    return save_gif(_frames(export.sequence, export.target), path, fps=1.0)


def _frames(sequence: ConstructionSequence, target: Silhouette | None) -> list[ByteArray]:
    """Every mesh as the viewer shows it, what is new in green, with its step and its score below."""
    meshes = sequence.meshes()
    operators = ["start", *(step.operator for step in sequence.steps)]
    scores = [sequence.start_score, *(step.score for step in sequence.steps)]
    return [
        viewer.draw_mesh(
            mesh,
            target,
            size=FRAME_SIZE,
            highlight=viewer.changed(meshes[max(k - 1, 0)], mesh),
            caption=f"{k}  {operators[k]}\nr_all {scores[k]['total']:.2f}   IoU {scores[k]['iou']:.3f}",
        )
        for k, mesh in enumerate(meshes)
    ]


FORMATS: dict[str, Format] = {
    "html": Format(".html", lambda e, path: save_html(e.sequence, path, e.target), shows_target=True),
    "svg": Format(".svg", _write_svg, shows_target=True),
    "obj": Format(".obj", lambda e, path: write_atomically(path, to_obj(e.sequence.final()))),
    "gltf": Format(".gltf", lambda e, path: save_gltf(e.sequence, path, e.depth), shows_depth=True),
    "gif": Format(".gif", _write_gif, shows_target=True),
    "png": Format(".png", lambda e, path: save_png(contact_sheet(e.sequence, e.target), path), shows_target=True),
    "blender": Format(".py", lambda e, path: save_blender_script(e.sequence, path, e.depth), shows_depth=True),
}
