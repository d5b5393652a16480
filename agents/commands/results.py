"""What `agents.solve` writes: a folder of results for every image, and an overview of all of them."""

import math
import os
import platform
import shutil
import tempfile
import time
import zlib
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageOps

from agents.commands.pictures import MASK, save_mask
from agents.solution import Solution
from autopoly_env import viewer
from autopoly_env.arguments import is_count
from autopoly_env.arrays import ByteArray
from autopoly_env.details import Losses
from autopoly_env.errors import AutoPolyError, OutputError
from autopoly_env.export import contact_sheet, save_html, save_png, to_obj, to_svg
from autopoly_env.export.coach import save_lesson
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.shown import told
from autopoly_env.silhouette import Silhouette, thumbnail

RESULTS = ("sequence.json", "mesh.obj", "mesh.svg", "steps.png", "player.html", "lesson.json")
OVERVIEW = "overview.png"
_STAGING = ".solve-"  # how folders begin in which results are completed; the machine and the process's number follow
_MACHINE = f"{zlib.crc32(platform.node().encode()):08x}-"
_PATIENCE = 5.0  # seconds that a folder of another machine is left alone
PAGE_SIZE = 3850  # pixels that an overview may have each way
PICTURE_SHARE = 0.25  # of a mesh's width: how wide its picture is beside it
CELL_SIZE = 256  # pixels of a mesh in it, if that fits
_MOST_CAPTION = 60  # letters of a name in it


@dataclass(frozen=True)
class Result:
    """A solved image."""

    image: Path
    name: str
    solution: Solution
    notes: tuple[str, ...]
    files: dict[str, Path]  # by their names, as in RESULTS
    losses: Losses | None = None  # where they were looked at


def claim_folder(folder: Path) -> None:
    """Make the folder for the results, and see that it can be written; what a killed run has left in it goes.

    Raises OutputError.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
        _sweep(folder)
    except OSError as error:
        reason = error.strerror or error
        raise OutputError(f"cannot write to the folder {folder} ({reason}); give another one with --out") from None


def write_results(
    folder: Path,
    sequence: ConstructionSequence,
    silhouette: Silhouette,
    shielded: Callable[[], AbstractContextManager[None]],
    *,
    with_mask: bool = False,
) -> dict[str, Path]:
    """Write all files of an image or none: they are completed beside the folder, and moved there in one go.

    The moves happen within `shielded()`. Raises OutputError if that does not work.
    """
    results = (*RESULTS, MASK) if with_mask else RESULTS
    try:
        in_the_way = next((folder / name for name in results if (folder / name).is_dir()), None)
        if in_the_way is not None:
            raise OutputError(f"cannot write {in_the_way} (a folder is in its place); move that away")
        staging = Path(tempfile.mkdtemp(prefix=f"{_STAGING}{_MACHINE}{os.getpid()}-", suffix=".tmp", dir=folder.parent))
        try:
            sequence.save(staging / "sequence.json")
            (staging / "mesh.obj").write_text(to_obj(sequence.final()), encoding="utf-8")
            (staging / "mesh.svg").write_text(to_svg(sequence.final(), target=silhouette), encoding="utf-8")
            save_png(contact_sheet(sequence, silhouette), staging / "steps.png")
            save_html(sequence, staging / "player.html", silhouette)
            save_lesson(sequence, staging / "lesson.json", silhouette)
            if with_mask:
                save_mask(silhouette, staging / MASK)
            with shielded():
                folder.mkdir(exist_ok=True)
                for name in results:
                    os.replace(staging / name, folder / name)
        finally:
            shutil.rmtree(staging, ignore_errors=True)
    except OSError as error:
        raise OutputError(f"cannot write the results to {folder} ({error.strerror or error}); make room") from None
    return {name: folder / name for name in results}


def _sweep(folder: Path) -> None:
    """Remove the staging folders of runs that are not there any more, those of other machines once they are old."""
    for left in folder.glob(f"{_STAGING}*.tmp"):
        owner = left.name.removeprefix(_STAGING + _MACHINE).partition("-")[0]
        is_over = not _is_running(int(owner)) if is_count(owner) else time.time() - left.stat().st_mtime > _PATIENCE
        if is_over:
            shutil.rmtree(left, ignore_errors=True)


def _is_running(process: int) -> bool:
    if os.name == "nt":  # where signal 0 is no question
        return True
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except OSError:  # it is somebody else's
        return True
    return True


class Overview:
    """All meshes over their targets on one page, each beside its picture, in the order in which they were added."""

    def __init__(self, n_images: int) -> None:
        self._n_columns = max(1, math.ceil((1.25 * n_images) ** 0.5))
        self._size = max(viewer.MIN_SIZE, min(CELL_SIZE, int(PAGE_SIZE / (1 + PICTURE_SHARE)) // self._n_columns))
        self._cells: list[ByteArray] = []

    def __len__(self) -> int:
        return len(self._cells)

    def add(self, result: Result, silhouette: Silhouette) -> None:
        """Draw a mesh, its name and its r_all beneath, its picture small on the left."""
        solution = result.solution
        caption = f"{told(result.name, _MOST_CAPTION)}\nr_all {solution.score.total:.2f}"
        cell = viewer.draw_mesh(solution.mesh, silhouette, size=self._size, caption=caption)
        self._cells.append(np.hstack((self._margin(result.image, len(cell)), cell)))

    def _margin(self, image: Path, height: int) -> ByteArray:
        """The picture, as it was given, in a column of its own; an empty one if it is gone."""
        side = max(1, round(PICTURE_SHARE * self._size))
        column = Image.new("RGB", (side, height), viewer.PAPER)
        try:
            picture = thumbnail(image, side - 2)
        except AutoPolyError:
            return np.asarray(column)
        framed = ImageOps.expand(picture, 1, viewer.SOFT_INK)
        column.paste(framed, (0, round(viewer.MARGIN * self._size)))
        return np.asarray(column)

    def page(self) -> Image.Image:
        """The page, at least one mesh on it."""
        return page_of(self._cells, min(self._n_columns, len(self._cells)))


def page_of(cells: Sequence[ByteArray], n_columns: int) -> Image.Image:
    """Pictures (H, W, 3), all of one size and at least one, on one page, row by row."""
    height, width, _ = cells[0].shape
    n_rows = math.ceil(len(cells) / n_columns)
    page = np.full((n_rows * height, n_columns * width, 3), viewer.PAPER, np.uint8)
    for i, cell in enumerate(cells):
        row, column = divmod(i, n_columns)
        page[row * height : (row + 1) * height, column * width : (column + 1) * width] = cell
    return Image.fromarray(page)
