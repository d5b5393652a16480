"""The frame that the whole project shows: a mesh over its target, with what has changed in green.

Grey is target that the mesh leaves bare, blue is mesh on target (or any mesh, where there is no target), red is mesh
outside the target. Edges and vertices are black, changed ones green, as in the paper's figure of its actions.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from autopoly_env.arrays import ByteArray, FloatArray
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh
from autopoly_env.silhouette import Silhouette

Colour = tuple[int, int, int]
PAPER: Colour = (255, 255, 255)
BARE: Colour = (205, 208, 213)
MATCH: Colour = (153, 183, 226)
EXCESS: Colour = (246, 190, 184)
INK: Colour = (30, 36, 48)
SOFT_INK: Colour = (107, 114, 128)
CHANGED: Colour = (14, 150, 72)
CHANGED_MATCH: Colour = (151, 207, 180)
CHANGED_EXCESS: Colour = (188, 209, 160)
# By what lies at a pixel: 1 for the target, 2 for the mesh, 4 for a changed face of it, added up.
AREA_COLOURS = (PAPER, BARE, EXCESS, MATCH, PAPER, BARE, CHANGED_EXCESS, CHANGED_MATCH)

MARGIN = 0.06  # of the frame's size, on each side of the unit square
OVERSAMPLING = 4
MIN_SIZE = 16  # pixels
LINE_SPACING = 1.3  # font heights
_LATIN = str.maketrans({"–": "-", "—": "-", "−": "-", "×": "x", "→": ">"})  # what Pillow's own font lacks


@dataclass(frozen=True)
class Highlight:
    """Elements to draw in green, by their ids; an edge is the two ids of its ends, the lower one first."""

    vertices: tuple[int, ...] = ()
    edges: tuple[tuple[int, int], ...] = ()
    faces: tuple[int, ...] = ()


def changed(before: PolyMesh, after: PolyMesh) -> Highlight:
    """The elements of `after` that `before` does not have."""
    return Highlight(
        tuple(sorted(set(after.vertex_ids).difference(before.vertex_ids))),
        tuple(sorted(set(_edge_names(after)).difference(_edge_names(before)))),
        tuple(sorted(set(after.face_ids).difference(before.face_ids))),
    )


def draw_mesh(
    mesh: PolyMesh,
    target: Silhouette | None = None,
    *,
    size: int = 256,
    highlight: Highlight | None = None,
    caption: str | None = None,
) -> ByteArray:
    """The mesh over the target as an RGB picture: (H, W, 3) uint8, W = `size` pixels.

    The unit square lies in the middle of the upper W x W pixels, a margin around it; what leaves the margin is cut
    off. H = W without a caption; each of its lines adds the same few pixels below, whatever it says.

    Raises ConfigError for a size below 16, MeshError if `highlight` names what the mesh does not have.
    """
    if size < MIN_SIZE:
        raise ConfigError(f"a frame of {size} pixels was asked for; give a size of at least {MIN_SIZE}")
    n = OVERSAMPLING * size
    points = n * (MARGIN + (1.0 - 2.0 * MARGIN) * mesh.vertices)
    highlight = highlight or Highlight()
    page = _areas(mesh, points, target, highlight.faces, n)
    _draw_lines(page, mesh, points, highlight)
    frame = np.array(page.reduce(OVERSAMPLING))
    return frame if caption is None else np.vstack((frame, _caption(caption, size)))


def text_height(size: int) -> int:
    """The font height, in pixels, that goes with a frame of `size` pixels."""
    return max(9, round(0.058 * size))


def caption_height(size: int, n_lines: int) -> int:
    """What a caption of so many lines adds below a frame of `size` pixels, in pixels."""
    return round((LINE_SPACING * n_lines + 0.8) * text_height(size))


@lru_cache(maxsize=64)
def font(height: float) -> ImageFont.FreeTypeFont:
    """Pillow's own font for letters `height` pixels high, to be drawn `OVERSAMPLING` times larger and reduced."""
    loaded = ImageFont.load_default(OVERSAMPLING * height)
    assert isinstance(loaded, ImageFont.FreeTypeFont)  # whenever it is asked for a size
    return loaded


def printable(text: str) -> str:
    """The text with the signs that Pillow's own font lacks replaced by plainer ones."""
    return text.translate(_LATIN)


def _edge_names(mesh: PolyMesh) -> list[tuple[int, int]]:
    ids = mesh.vertex_ids
    return [(min(ids[a], ids[b]), max(ids[a], ids[b])) for a, b in mesh.edges.tolist()]


def _areas(mesh: PolyMesh, points: FloatArray, target: Silhouette | None, new: tuple[int, ...], n: int) -> Image.Image:
    """The picture without lines, n x n pixels: every pixel takes its colour from `AREA_COLOURS`."""
    covered = _faces_mask(points, mesh.faces, n)
    wanted = covered if target is None else _target_mask(target, n)
    fresh = _faces_mask(points, tuple(mesh.faces[mesh.face_index(name)] for name in new), n)
    picture = Image.fromarray(wanted + 2 * covered + 4 * fresh)
    picture.putpalette([value for colour in AREA_COLOURS for value in colour])
    return picture.convert("RGB")


def _faces_mask(points: FloatArray, faces: tuple[tuple[int, ...], ...], n: int) -> ByteArray:
    """(n, n) 1 inside the faces, 0 outside."""
    mask = Image.new("L", (n, n))
    pen = ImageDraw.Draw(mask)
    for face in faces:
        pen.polygon([(x, y) for x, y in points[list(face)].tolist()], fill=1)
    return np.asarray(mask)


@lru_cache(maxsize=4)
def _target_mask(target: Silhouette, n: int) -> ByteArray:
    """(n, n) 1 on the target, 0 outside; smooth, unless its pixels are what the mesh is to have."""
    mask = np.zeros((n, n), np.uint8)
    start, end = round(MARGIN * n), round((1.0 - MARGIN) * n)
    way = Image.Resampling.NEAREST if target.is_scored_by_area else Image.Resampling.BILINEAR
    scaled = Image.fromarray(target.mask).convert("L").resize((end - start, end - start), way)
    mask[start:end, start:end] = np.asarray(scaled) >= 128
    mask.setflags(write=False)
    return mask


def _draw_lines(page: Image.Image, mesh: PolyMesh, points: FloatArray, highlight: Highlight) -> None:
    """Edges and vertices, the green ones last and stronger; at 256 pixels lines are 1.5 pixels wide."""
    pen = ImageDraw.Draw(page)
    unit = OVERSAMPLING * (page.width / OVERSAMPLING / 256.0) ** 0.5
    place = [(x, y) for x, y in points.tolist()]
    new_edges = [mesh.edge_index(mesh.vertex_index(a), mesh.vertex_index(b)) for a, b in highlight.edges]
    new_vertices = [mesh.vertex_index(name) for name in highlight.vertices]
    layers = (
        (mesh.edges.tolist(), range(len(place)), INK, 1.5 * unit, 2.4 * unit),
        (mesh.edges[new_edges].tolist(), new_vertices, CHANGED, 2.5 * unit, 3.6 * unit),
    )
    for lines, dots, colour, width, radius in layers:
        for a, b in lines:
            pen.line([place[a], place[b]], fill=colour, width=round(width))
        for v in dots:
            pen.circle(place[v], radius, fill=colour)


def _caption(caption: str, size: int) -> ByteArray:
    """The caption, centred, the first line dark and the others softer; to go below a frame of `size` pixels."""
    lines, width = printable(caption).split("\n"), OVERSAMPLING * size
    page = Image.new("RGB", (width, OVERSAMPLING * caption_height(size, len(lines))), PAPER)
    pen = ImageDraw.Draw(page)
    for i, line in enumerate(lines):
        full = font(text_height(size))
        shrink = min(1.0, 0.94 * width / max(1.0, full.getlength(line)))
        fitting = font(max(2.0, shrink * text_height(size)))
        middle = OVERSAMPLING * LINE_SPACING * text_height(size) * (i + 0.5)
        pen.text((width / 2, middle), line, SOFT_INK if i else INK, fitting, anchor="mm")
    return np.asarray(page.reduce(OVERSAMPLING))
