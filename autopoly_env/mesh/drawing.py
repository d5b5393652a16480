"""A mesh as the groups of an SVG drawing, from plain positions and ids."""

from collections.abc import Sequence
from typing import NamedTuple

# Attributes instead of a style sheet: drawing programs edit them, and several drawings in one page keep apart.
_LOOKS = {
    "faces": 'fill="#4a86d8" fill-opacity="0.5"',
    "edges": 'fill="none" stroke="#1e2430" stroke-width="1.5" stroke-linecap="round"',
    "vertices": 'fill="#1e2430"',
}


class Figure(NamedTuple):
    """What is to be drawn; faces and edges name vertices by their place in the list."""

    points: Sequence[tuple[float, float]]  # unit square, y down
    vertex_ids: Sequence[int]
    edges: Sequence[Sequence[int]]
    faces: Sequence[Sequence[int]]
    face_ids: Sequence[int]


def drawing(size: int, lines: Sequence[str], namespaces: str = "") -> str:
    """An SVG file of `lines`, `size` user units a side."""
    box = f'width="{size}" height="{size}" viewBox="0 0 {size} {size}"'
    return "\n".join([f'<svg xmlns="http://www.w3.org/2000/svg"{namespaces} {box}>', *lines, "</svg>\n"])


def groups(figure: Figure, size: int, prefix: str = "", indent: str = "  ") -> list[str]:
    """The lines of three groups, `faces`, `edges` and `vertices`; `prefix` goes before each id.

    They hold paths `face-<id>` and `edge-<id>-<id>` (the ids of the two ends) and circles `vertex-<id>`.
    """
    ids = figure.vertex_ids
    place = [f"{_number(size * x)} {_number(size * y)}" for x, y in figure.points]
    faces = [
        f'<path id="{prefix}face-{name}" d="M {" L ".join(place[v] for v in face)} Z"/>'
        for name, face in zip(figure.face_ids, figure.faces, strict=True)
    ]
    edges = [f'<path id="{prefix}edge-{ids[a]}-{ids[b]}" d="M {place[a]} L {place[b]}"/>' for a, b in figure.edges]
    vertices = [
        f'<circle id="{prefix}vertex-{name}" cx="{_number(size * x)}" cy="{_number(size * y)}" r="3"/>'
        for name, (x, y) in zip(ids, figure.points, strict=True)
    ]
    lines = []
    for name, elements in (("faces", faces), ("edges", edges), ("vertices", vertices)):
        lines.append(f'{indent}<g id="{prefix}{name}" {_LOOKS[name]}>')
        lines += [*(f"{indent}  {element}" for element in elements), f"{indent}</g>"]
    return lines


def _number(value: float) -> str:
    """To a thousandth of a unit, without trailing zeros."""
    return f"{round(value, 3) + 0.0:.3f}".rstrip("0").rstrip(".")
