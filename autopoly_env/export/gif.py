"""Animated GIFs, with Pillow alone: of any frames, and of a sequence."""

import io
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from autopoly_env import viewer
from autopoly_env.arrays import ByteArray
from autopoly_env.errors import ConfigError
from autopoly_env.export.formats import Export, Format, register_format
from autopoly_env.files import write_atomically
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import Silhouette

N_COLOURS = 256  # as many as GIF has
LAST_FRAME_SECONDS = 2.0
FRAME_SIZE = 400  # pixels a side of the frames of a sequence


def save_gif(frames: Sequence[ByteArray], path: str | os.PathLike[str], *, fps: float = 2.0) -> Path:
    """Write RGB frames (H, W, 3) uint8, all of one size, as a GIF that loops; the last frame stays a little longer.

    Raises ConfigError for no frames, frames of several sizes or types, or `fps` out of 0.1 to 50; OutputError if the
    file cannot be written.
    """
    shapes = {np.shape(frame) for frame in frames}
    if len(shapes) != 1 or len(next(iter(shapes))) != 3 or next(iter(shapes))[2] != 3:
        raise ConfigError(f"frames of the shapes {sorted(shapes)}: expected one or more of one shape (H, W, 3)")
    if any(frame.dtype != np.uint8 for frame in frames):
        raise ConfigError(f"frames of dtype {frames[0].dtype}: expected uint8, 0 to 255")
    if not 0.1 <= fps <= 50.0:
        raise ConfigError(f"{fps} frames a second: expected 0.1 to 50, which GIF can time")
    pictures = _pictures(frames)
    each = round(1000.0 / fps)
    durations = [each] * (len(pictures) - 1) + [max(each, round(1000.0 * LAST_FRAME_SECONDS))]
    stream = io.BytesIO()
    pictures[0].save(stream, "GIF", save_all=True, append_images=pictures[1:], duration=durations, loop=0)
    return write_atomically(path, stream.getvalue())


def _pictures(frames: Sequence[ByteArray]) -> list[Image.Image]:
    """The frames in one palette: the colours that most of their pixels have, exactly; others become the nearest."""
    pixels = np.stack(frames).astype(np.int64)
    packed = pixels @ (1 << 16, 1 << 8, 1)
    colours, where, counts = np.unique(packed, return_inverse=True, return_counts=True)
    values = np.column_stack((colours >> 16, colours >> 8 & 255, colours & 255))
    common = values[np.argsort(-counts, kind="stable")[:N_COLOURS]]
    nearest = np.array([((common - value) ** 2).sum(axis=1).argmin() for value in values], np.uint8)
    pictures = []
    for numbers in nearest[where].reshape(packed.shape):
        pictures.append(Image.fromarray(numbers))
        pictures[-1].putpalette(common.astype(np.uint8).tobytes())
    return pictures


def frames_of(sequence: ConstructionSequence, target: Silhouette | None = None) -> list[ByteArray]:
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


def _write(export: Export, path: Path) -> Path:
    return save_gif(frames_of(export.sequence, export.target), path, fps=1.0)


register_format(Format("gif", (".gif",), "an animated picture", _write, shows_target=True))
