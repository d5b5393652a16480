"""Draws what each operator does, before and after, into docs/pictures: `python docs/draw_operators.py [FOLDER]`.

Left, green is the element that the operator works on; right, green is what it made or changed. The operators
themselves are run, and nothing is random: the same pixels come out each time.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from autopoly_env.export.sheet import save_png
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import OPERATORS
from autopoly_env.viewer import INK, OVERSAMPLING, PAPER, Highlight, changed, draw_mesh

SIZE = 240  # pixels on a side of one mesh
GAP = 64  # between the two, where the arrow is
PICTURES = Path(__file__).parent / "pictures"


@dataclass(frozen=True)
class Example:
    """A mesh, the element of it that the operator works on, and what is green; None: what is new."""

    mesh: PolyMesh
    element: int
    green_before: Highlight
    green_after: Highlight | None = None


def edge_subdivide() -> Example:
    """The edge between two quads, both of which become pentagons."""
    mesh = PolyMesh.from_faces(
        [(0.05, 0.2), (0.45, 0.12), (0.95, 0.25), (0.92, 0.8), (0.55, 0.88), (0.08, 0.75)], [(0, 1, 4, 5), (1, 2, 3, 4)]
    )
    return Example(mesh, mesh.edge_index(1, 4), Highlight(edges=((1, 4),)))


def edge_extrude() -> Example:
    """The slanted side of a quad."""
    mesh = PolyMesh.from_faces([(0.06, 0.2), (0.6, 0.14), (0.72, 0.84), (0.1, 0.84)], [(0, 1, 2, 3)])
    return Example(mesh, mesh.edge_index(1, 2), Highlight(edges=((1, 2),)))


def face_split() -> Example:
    """An L cut from its inner corner."""
    outline = [(0.1, 0.1), (0.45, 0.1), (0.45, 0.5), (0.92, 0.5), (0.92, 0.9), (0.1, 0.9)]
    return Example(PolyMesh.from_faces(outline, [range(6)]), 2, Highlight(vertices=(2,)))


def face_delete() -> Example:
    """The middle of a grid, whose neighbours keep all its edges and vertices."""
    return Example(PolyMesh.grid(3, 0.1, 0.1, 0.9, 0.9), 4, Highlight(faces=(4,)))


def face_hole() -> Example:
    """A hole of four corners in a rhombus."""
    mesh = PolyMesh.from_faces([(0.12, 0.18), (0.769, 0.18), (0.88, 0.82), (0.231, 0.82)], [(0, 1, 2, 3)])
    return Example(mesh, 1, Highlight(faces=(0,)))


def vertex_dissolve() -> Example:
    """The roof of a house."""
    mesh = PolyMesh.from_faces([(0.15, 0.45), (0.5, 0.1), (0.85, 0.45), (0.85, 0.9), (0.15, 0.9)], [range(5)])
    return Example(mesh, 1, Highlight(vertices=(1,), edges=((0, 1), (1, 2))))


def edge_dissolve() -> Example:
    """The edge between a quad and a triangle."""
    mesh = PolyMesh.from_faces(
        [(0.08, 0.2), (0.55, 0.12), (0.62, 0.82), (0.1, 0.86), (0.94, 0.42)], [(0, 1, 2, 3), (2, 1, 4)]
    )
    return Example(mesh, mesh.edge_index(1, 2), Highlight(edges=((1, 2),)), Highlight(faces=(0,)))


def edge_cap() -> Example:
    """The top of a wall gets a gable."""
    mesh = PolyMesh.from_faces([(0.15, 0.5), (0.85, 0.5), (0.85, 0.92), (0.15, 0.92)], [(0, 1, 2, 3)])
    return Example(mesh, mesh.edge_index(0, 1), Highlight(edges=((0, 1),)))


def edge_fill() -> Example:
    """The ends of two arms are joined, which closes a ring."""
    corners = [(0.1, 0.9), (0.35, 0.68), (0.65, 0.68), (0.9, 0.9), (0.1, 0.15), (0.35, 0.35), (0.9, 0.15), (0.65, 0.35)]
    mesh = PolyMesh.from_faces(corners, [(1, 2, 3, 0), (1, 0, 4, 5), (3, 2, 7, 6)])
    return Example(mesh, mesh.edge_index(4, 5), Highlight(edges=((4, 5), (6, 7))))


def vertex_merge() -> Example:
    """A roof is closed: the ends of its two sides become one vertex."""
    corners = [(0.1, 0.6), (0.5, 0.6), (0.9, 0.6), (0.9, 0.9), (0.5, 0.9), (0.1, 0.9), (0.3, 0.15), (0.62, 0.15)]
    mesh = PolyMesh.from_faces(corners, [(0, 1, 4, 5), (1, 2, 3, 4), (0, 6, 1), (1, 7, 2)])
    ends = Highlight(vertices=(6, 7), edges=((1, 6), (1, 7)))
    return Example(mesh, 6, ends, Highlight(vertices=(7,), edges=((1, 7),)))


def loop_cut() -> Example:
    """A loop through three quads of an arch."""
    corners = [(0.1, 0.9), (0.16, 0.3), (0.84, 0.3), (0.9, 0.9), (0.34, 0.9), (0.38, 0.56), (0.62, 0.56), (0.66, 0.9)]
    mesh = PolyMesh.from_faces(corners, [(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6)])
    return Example(mesh, mesh.edge_index(1, 5), Highlight(edges=((1, 5),)))


def face_inset() -> Example:
    """The ring inside a quad."""
    mesh = PolyMesh.from_faces([(0.12, 0.18), (0.8, 0.12), (0.9, 0.82), (0.2, 0.88)], [(0, 1, 2, 3)])
    return Example(mesh, 0, Highlight(faces=(0,)))


EXAMPLES: dict[str, Callable[[], Example]] = {
    example.__name__: example
    for example in (
        *(edge_subdivide, edge_extrude, face_split, face_delete, face_hole, vertex_dissolve, edge_dissolve),
        *(edge_cap, edge_fill, vertex_merge, loop_cut, face_inset),
    )
}


def picture(name: str) -> Image.Image:
    """The operator's example before and after, an arrow between."""
    example = EXAMPLES[name]()
    after = OPERATORS[name].apply(example.mesh, example.element)
    green_after = example.green_after or changed(example.mesh, after)
    frames = (
        draw_mesh(example.mesh, size=SIZE, highlight=example.green_before),
        np.asarray(arrow()),
        draw_mesh(after, size=SIZE, highlight=green_after),
    )
    return Image.fromarray(np.hstack(frames))


def arrow() -> Image.Image:
    """An arrow to the right, GAP x SIZE pixels."""
    page = Image.new("RGB", (GAP * OVERSAMPLING, SIZE * OVERSAMPLING), PAPER)
    pen = ImageDraw.Draw(page)
    y, tip, head, width = page.height // 2, 52 * OVERSAMPLING, 10 * OVERSAMPLING, 2 * OVERSAMPLING
    pen.line([(12 * OVERSAMPLING, y), (tip - head // 2, y)], fill=INK, width=width)
    pen.polygon([(tip, y), (tip - head, y - head // 2), (tip - head, y + head // 2)], fill=INK)
    return page.reduce(OVERSAMPLING)


def main(folder: Path = PICTURES) -> None:
    """Write every picture as `operator_<name>.png`."""
    for name in EXAMPLES:
        save_png(picture(name), folder / f"operator_{name}.png")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
