"""What a training run leaves behind: a line of JSON for every measurement, pictures, and TensorBoard's files."""

import json
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

from PIL import Image

from autopoly_env.arrays import ByteArray
from autopoly_env.errors import RunError
from autopoly_env.files import write_atomically


def known(metrics: Mapping[str, float]) -> dict[str, float]:
    """The metrics but those that are NaN, for which the samples have nothing to measure by; JSON has no NaN."""
    return {name: value for name, value in metrics.items() if value == value}


class RunLog:
    """log.jsonl, pictures/*.png and, where the package tensorboard is installed, tensorboard/ in a run's folder.

    A run that goes on at a step forgets what was logged after it.
    """

    def __init__(self, folder: Path, step: int) -> None:
        self._folder = folder
        self._path = folder / "log.jsonl"
        try:
            known = self._path.read_text(encoding="utf-8").splitlines() if self._path.exists() else []
        except (OSError, UnicodeDecodeError):
            raise RunError(f"cannot read {self._path}; delete it to go on without it") from None
        kept = [line for line in known if _step_of(line) <= step]
        write_atomically(self._path, "".join(f"{line}\n" for line in kept))
        self._board = _tensorboard(folder / "tensorboard", step)
        if self._board is None and step == 0:
            print("no TensorBoard files (pip install tensorboard to have them); log.jsonl has everything", flush=True)

    def write(self, step: int, group: str, values: dict[str, float]) -> None:
        """Log some numbers of a step, as group/name; none that are NaN."""
        named = {f"{group}/{name}": value for name, value in known(values).items()}
        with self._path.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"step": step, **named}) + "\n")
        if self._board is not None:
            for name, value in named.items():
                self._board.add_scalar(name, value, step)
            self._board.flush()

    def picture(self, step: int, pixels: ByteArray) -> None:
        """Keep a picture (H, W) or (H, W, 3)."""
        buffer = BytesIO()
        Image.fromarray(pixels).save(buffer, "PNG")
        write_atomically(self._folder / "pictures" / f"step_{step:06d}.png", buffer.getvalue())
        if self._board is not None:
            self._board.add_image("predictions", pixels, step, dataformats="HW" if pixels.ndim == 2 else "HWC")


def _step_of(line: str) -> float:
    """The step of a logged line; infinity for half a line, as a killed run may leave."""
    try:
        return float(json.loads(line)["step"])
    except (ValueError, KeyError, TypeError):
        return float("inf")


def _tensorboard(folder: Path, step: int) -> Any:
    """TensorBoard's writer, or None where the package is not installed."""
    try:
        from torch.utils.tensorboard import SummaryWriter
    except ImportError:
        return None
    return SummaryWriter(str(folder), purge_step=step + 1)
