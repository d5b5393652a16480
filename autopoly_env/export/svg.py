"""SVG: the mesh as a drawing that stays editable, every face, edge and vertex an element with its own id."""

import base64
import io

import numpy as np
from PIL import Image

from autopoly_env.mesh import PolyMesh
from autopoly_env.silhouette import Silhouette
from autopoly_env.viewer import BARE

_STYLE = """\
  <style>
    #faces { fill: #4a86d8; fill-opacity: 0.5; }
    #edges { fill: none; stroke: #1e2430; stroke-width: 1.5; stroke-linecap: round; }
    #vertices { fill: #1e2430; }
  </style>"""


def to_svg(mesh: PolyMesh, *, size: int = 512, target: Silhouette | None = None) -> str:
    """The mesh as SVG text: the unit square is `size` user units wide, x right and y down as in the mesh.

    The groups `faces`, `edges` and `vertices` hold paths `face-<id>` and `edge-<id>-<id>` (the ids of the two ends)
    and circles `vertex-<id>`. A target comes first, as a grey picture that is part of the file.
    """
    ids = mesh.vertex_ids
    place = [f"{_number(size * x)} {_number(size * y)}" for x, y in mesh.vertices.tolist()]
    faces = [
        f'<path id="face-{name}" d="M {" L ".join(place[v] for v in face)} Z"/>'
        for name, face in zip(mesh.face_ids, mesh.faces, strict=True)
    ]
    edges = [f'<path id="edge-{ids[a]}-{ids[b]}" d="M {place[a]} L {place[b]}"/>' for a, b in mesh.edges.tolist()]
    vertices = [
        f'<circle id="vertex-{name}" cx="{_number(size * x)}" cy="{_number(size * y)}" r="3"/>'
        for name, (x, y) in zip(ids, mesh.vertices.tolist(), strict=True)
    ]
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{size}" height="{size}" viewBox="0 0 {size} {size}">',
            _STYLE,
            *([] if target is None else [_picture(target, size)]),
            *_group("faces", faces),
            *_group("edges", edges),
            *_group("vertices", vertices),
            "</svg>\n",
        ]
    )


def _group(name: str, elements: list[str]) -> list[str]:
    return [f'  <g id="{name}">', *(f"    {element}" for element in elements), "  </g>"]


def _number(value: float) -> str:
    """To a thousandth of a unit, without trailing zeros."""
    return f"{round(value, 3) + 0.0:.3f}".rstrip("0").rstrip(".")


def _picture(target: Silhouette, size: int) -> str:
    """The silhouette as an `<image>`: a PNG of two colours, one of them transparent."""
    picture = Image.fromarray(target.mask.astype(np.uint8))
    picture.putpalette([255, 255, 255, *BARE])
    stream = io.BytesIO()
    picture.save(stream, "PNG", bits=1, transparency=0, optimize=True)
    data = base64.b64encode(stream.getvalue()).decode("ascii")
    return f'  <image id="target" width="{size}" height="{size}" href="data:image/png;base64,{data}"/>'
