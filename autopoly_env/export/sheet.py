"""The contact sheet: every step of a construction sequence on one page."""

import io
import math
import os
from pathlib import Path

from PIL import Image, ImageDraw

from autopoly_env import viewer
from autopoly_env.errors import ConfigError
from autopoly_env.export.formats import Export, Format, register_format
from autopoly_env.files import write_atomically
from autopoly_env.mesh import PolyMesh
from autopoly_env.sequence import ConstructionSequence, Lesson, parts_of
from autopoly_env.shown import told
from autopoly_env.silhouette import Silhouette

BORDER = 24  # pixels around the page
HEADER = 128  # pixels
LIMIT = 3820  # pixels for all cells together, each way
LONG = 40  # steps; a sequence with more gets smaller cells
LONG_CELL = 0.75

ACCENT: viewer.Colour = (194, 92, 8)
LEGEND = (
    (viewer.MATCH, "mesh on target"),
    (viewer.BARE, "target left bare"),
    (viewer.EXCESS, "mesh outside"),
    (viewer.CHANGED, "new in this step"),
)


def contact_sheet(
    sequence: ConstructionSequence,
    silhouette: Silhouette | None = None,
    *,
    columns: int | None = None,
    cell: int = 220,
) -> Image.Image:
    """Every mesh of the sequence over the target, the start first, as one RGB picture.

    Below each stand its step, the operator, the part that it works on where there are several, r_all and the IoU. What
    is new is green; the best mesh is framed, and so is the last one, more softly. The header has the best mesh's (V, E,
    F), IoU (r_sm), complexity (r_sc), self-intersections (r_si) and total (r_all), and how the steps to it read.
    `cell` is a mesh's width in pixels: a quarter less beyond 40 steps, and never more than fits a page of about 4000 x
    4000 pixels.

    Raises ConfigError for less than one column and for more cells than fit, SequenceError if the replay fails.
    """
    meshes = sequence.meshes()
    if columns is not None and columns < 1:
        raise ConfigError(f"a sheet of {columns} columns was asked for; give at least 1")
    n_columns = min(len(meshes), columns or _default_columns(len(meshes)))
    n_rows = math.ceil(len(meshes) / n_columns)
    captions = _captions(sequence)
    size = _cell_size(cell, n_columns, n_rows, len(meshes), captions[0].count("\n") + 1)
    cells = _draw_cells(sequence, meshes, silhouette, size, captions)
    header = _draw_header(sequence, silhouette)
    width, height = cells[0].size
    page_size = max(header.width, n_columns * width) + 2 * BORDER, header.height + n_rows * height + 2 * BORDER
    page = Image.new("RGB", page_size, viewer.PAPER)
    page.paste(header, (BORDER, BORDER))
    for i, picture in enumerate(cells):
        page.paste(picture, (BORDER + i % n_columns * width, BORDER + header.height + i // n_columns * height))
    return page


def save_png(image: Image.Image, path: str | os.PathLike[str]) -> Path:
    """Write a picture as PNG, whole or not at all. Raises OutputError if it cannot be written."""
    stream = io.BytesIO()
    image.save(stream, "PNG")  # to be a twentieth smaller would take four times as long
    return write_atomically(path, stream.getvalue())


def _default_columns(n_cells: int) -> int:
    """One row for a few cells, else about three columns for two rows."""
    return n_cells if n_cells <= 5 else math.ceil((1.5 * n_cells) ** 0.5)


def _cell_size(cell: int, n_columns: int, n_rows: int, n_cells: int, n_lines: int) -> int:
    most = cell if n_cells <= LONG + 1 else int(LONG_CELL * cell)
    for size in range(min(most, LIMIT // n_columns), viewer.MIN_SIZE - 1, -1):
        if n_rows * (size + viewer.caption_height(size, n_lines)) <= LIMIT:
            return size
    raise ConfigError(
        f"{n_cells} cells in {n_columns} columns, at most {cell} pixels wide, do not fit a sheet; "
        f"give cells of at least {viewer.MIN_SIZE} pixels, another number of columns, or fewer steps"
    )


def _captions(sequence: ConstructionSequence) -> list[str]:
    """What stands below each mesh: two lines, or three where there are several parts."""
    parts = parts_of(sequence)
    operators = ["start", *(step.operator for step in sequence.steps)]
    scores = [sequence.start_score, *(step.score for step in sequence.steps)]
    captions = []
    for i, (operator, score) in enumerate(zip(operators, scores, strict=True)):
        lines = [f"{i}  {told(operator, 40)}", f"r_all {score['total']:.2f}   IoU {score['iou']:.3f}"]
        if len(parts.names) > 1:
            lines.insert(1, parts.name(i) if i else parts.names[0])
        captions.append("\n".join(lines))
    return captions


def _draw_cells(
    sequence: ConstructionSequence,
    meshes: list[PolyMesh],
    silhouette: Silhouette | None,
    size: int,
    captions: list[str],
) -> list[Image.Image]:
    cells = []
    for i, (mesh, caption) in enumerate(zip(meshes, captions, strict=True)):
        new = viewer.changed(meshes[max(i - 1, 0)], mesh)
        frame = viewer.draw_mesh(mesh, silhouette, size=size, highlight=new, caption=caption)
        cells.append(Image.fromarray(frame))
    best = len(sequence.best_prefix().steps)
    if best < len(cells) - 1:
        _mark(cells[-1], size, "last", viewer.SOFT_INK)
    _mark(cells[best], size, "best", ACCENT)
    return cells


def _mark(cell: Image.Image, size: int, word: str, colour: viewer.Colour) -> None:
    """A frame around a cell, with a word in its upper left corner."""
    scale, line, height = viewer.OVERSAMPLING, max(1, size // 110), viewer.text_height(size)
    mask = Image.new("L", (scale * cell.width, scale * cell.height))
    pen = ImageDraw.Draw(mask)
    inset = 2 * scale * line
    frame = (inset, inset, mask.width - 1 - inset, mask.height - 1 - inset)
    pen.rounded_rectangle(frame, scale * size // 24, outline=255, width=scale * line)
    pen.text((inset + 3 * height, inset + 2 * height), word, 255, viewer.font(height))
    cell.paste(colour, mask=mask.reduce(scale))


def _draw_header(sequence: ConstructionSequence, silhouette: Silhouette | None) -> Image.Image:
    """The name of the target, the scores of the best mesh, and what the colours mean; HEADER pixels high."""
    title = viewer.printable(told(silhouette.name, 80) if silhouette else "construction sequence")
    best = sequence.best_prefix()
    facts, lesson = _facts(best, len(sequence.steps)), _lesson_words(Lesson.of(best))
    legend = LEGEND if silhouette else LEGEND[-1:]
    large, medium, small = viewer.font(26), viewer.font(16), viewer.font(13)
    steps = [150 + small.getlength(word) for _, word in legend]
    width = max(large.getlength(title), medium.getlength(facts), medium.getlength(lesson), sum(steps))
    page = Image.new("RGB", (4 * math.ceil(width / 4), 4 * HEADER), viewer.PAPER)
    pen = ImageDraw.Draw(page)
    pen.text((0, 0), title, viewer.INK, large)
    pen.text((0, 160), facts, viewer.INK, medium)
    pen.text((0, 256), lesson, viewer.INK, medium)
    left = 0.0
    for (colour, word), step in zip(legend, steps, strict=True):
        pen.rounded_rectangle((left, 376, left + 64, 424), 12, fill=colour)
        pen.text((left + 90, 400), word, viewer.SOFT_INK, small, anchor="lm")
        left += step
    return page.reduce(4)


def _facts(best: ConstructionSequence, n_steps: int) -> str:
    n_vertices, n_edges, n_faces = best.final().counts
    score = best.steps[-1].score if best.steps else best.start_score
    return (
        f"best: step {len(best.steps)} of {n_steps}      V {n_vertices}   E {n_edges}   F {n_faces}      "
        f"r_sm {score['iou']:.4f}   r_sc {score['complexity']}   r_si {score['self_intersections']}   "
        f"r_all {score['total']:.2f}"
    )


def _lesson_words(lesson: Lesson) -> str:
    return (
        f"{lesson.effort:.0f} s by hand      quads {lesson.quads:.2f}   n-gons {lesson.ngons}   "
        f"concave {lesson.concave}      returns {lesson.returns}"
    )


def _write(export: Export, path: Path) -> Path:
    return save_png(contact_sheet(export.sequence, export.target), path)


register_format(Format("png", (".png",), "every step on one sheet", _write, shows_target=True))
