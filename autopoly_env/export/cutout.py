"""The last mesh alone as a picture: drawn on nothing (`mesh-png`), and as a mask (`mask-png`)."""

from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from autopoly_env import viewer
from autopoly_env.errors import ConfigError
from autopoly_env.export.formats import Export, Format, register_format
from autopoly_env.export.replay import finite_meshes
from autopoly_env.export.sheet import save_png
from autopoly_env.mesh import PolyMesh

PIXELS = 512  # a side of the picture, where nobody says
MOST_PIXELS = 8192


def mesh_picture(mesh: PolyMesh, size: int = PIXELS) -> Image.Image:
    """The mesh as RGBA, faces, edges and vertices, everything else transparent; the unit square fills it.

    Raises ConfigError for less than 16 pixels or more than 8192.
    """
    n, scale = _checked(size), viewer.OVERSAMPLING
    page = Image.new("RGBA", (scale * n, scale * n), (*viewer.INK, 0))  # ink beside lines: no pale fringe
    pen, places = ImageDraw.Draw(page), (scale * n * mesh.vertices).tolist()
    for face in mesh.faces:
        pen.polygon([tuple(places[v]) for v in face], fill=(*viewer.MATCH, 255))
    unit = scale * (n / 256.0) ** 0.5
    for a, b in mesh.edges.tolist():
        pen.line([tuple(places[a]), tuple(places[b])], fill=(*viewer.INK, 255), width=round(1.5 * unit))
    for x, y in places:
        pen.circle((x, y), 2.4 * unit, fill=(*viewer.INK, 255))
    return page.reduce(scale)


def mask_picture(mesh: PolyMesh, size: int = PIXELS) -> Image.Image:
    """What the mesh covers, white on black, in 256 greys: of each pixel the exact share, rounded.

    Raises ConfigError for less than 16 pixels or more than 8192.
    """
    from autopoly_env.raster import coverage

    shares = coverage(mesh, _checked(size))
    return Image.fromarray(np.rint(255.0 * np.clip(shares, 0.0, 1.0)).astype(np.uint8))


def _checked(size: float) -> int:
    if not (viewer.MIN_SIZE <= size <= MOST_PIXELS and size == int(size)):
        raise ConfigError(f"size {size}: expected a whole number of pixels, {viewer.MIN_SIZE} to {MOST_PIXELS}")
    return int(size)


def _size(export: Export) -> float:
    return PIXELS if export.size is None else export.size


def _write_mesh(export: Export, path: Path) -> Path:
    return save_png(mesh_picture(finite_meshes(export.sequence)[-1], _checked(_size(export))), path)


def _write_mask(export: Export, path: Path) -> Path:
    return save_png(mask_picture(finite_meshes(export.sequence)[-1], _checked(_size(export))), path)


register_format(
    Format("mesh-png", (".mesh.png",), "the last mesh on a transparent background", _write_mesh, options=("size",))
)
register_format(
    Format("mask-png", (".mask.png",), "what the last mesh covers, white on black", _write_mask, options=("size",))
)
