"""SVG: a mesh, or a construction step by step, as a drawing that stays editable: every element has its own id."""

from html import escape

from autopoly_env.export.pictures import picture_url
from autopoly_env.mesh import PolyMesh
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import Silhouette
from autopoly_env.viewer import BARE

# Attributes instead of a style sheet: drawing programs edit them, and several drawings in one page keep apart.
_LOOKS = {
    "faces": 'fill="#4a86d8" fill-opacity="0.5"',
    "edges": 'fill="none" stroke="#1e2430" stroke-width="1.5" stroke-linecap="round"',
    "vertices": 'fill="#1e2430"',
}
_INKSCAPE = "http://www.inkscape.org/namespaces/inkscape"  # for its layers; other programs pass over it


def to_svg(mesh: PolyMesh, *, size: int = 512, target: Silhouette | None = None) -> str:
    """The mesh as SVG text: the unit square is `size` user units wide, x right and y down as in the mesh.

    The groups `faces`, `edges` and `vertices` hold paths `face-<id>` and `edge-<id>-<id>` (the ids of the two ends)
    and circles `vertex-<id>`. A target comes first, as a grey picture that is part of the file.
    """
    return _drawing("", size, target, _groups(mesh, size, "", "  "))


def sequence_to_svg(sequence: ConstructionSequence, *, size: int = 512, target: Silhouette | None = None) -> str:
    """All meshes of a sequence as SVG text, each a group `step-<k>` from 0, the start; only the last one is visible.

    Within it everything is as `to_svg` has it, with `step-<k>-` before its id, because an id may stand only once in a
    file: `step-3-face-7`, `step-3-vertex-12`. Inkscape shows the steps as layers, labelled with their operators.
    Raises SequenceError if the replay fails.
    """
    lines = []
    meshes, operators = sequence.meshes(), ["start", *(step.operator for step in sequence.steps)]
    for k, (mesh, operator) in enumerate(zip(meshes, operators, strict=True)):
        look = "" if k == len(sequence.steps) else ' style="display:none"'
        label = escape(f"step {k}: {operator}")
        lines.append(f'  <g id="step-{k}" inkscape:groupmode="layer" inkscape:label="{label}"{look}>')
        lines += [*_groups(mesh, size, f"step-{k}-", "    "), "  </g>"]
    return _drawing(f' xmlns:inkscape="{_INKSCAPE}"', size, target, lines)


def _drawing(namespaces: str, size: int, target: Silhouette | None, lines: list[str]) -> str:
    box = f'width="{size}" height="{size}" viewBox="0 0 {size} {size}"'
    head = f'<svg xmlns="http://www.w3.org/2000/svg"{namespaces} {box}>'
    picture = [] if target is None else [_picture(target, size)]
    return "\n".join([head, *picture, *lines, "</svg>\n"])


def _groups(mesh: PolyMesh, size: int, prefix: str, indent: str) -> list[str]:
    """The lines of the three groups of a mesh; `prefix` goes before each id."""
    ids = mesh.vertex_ids
    place = [f"{_number(size * x)} {_number(size * y)}" for x, y in mesh.vertices.tolist()]
    faces = [
        f'<path id="{prefix}face-{name}" d="M {" L ".join(place[v] for v in face)} Z"/>'
        for name, face in zip(mesh.face_ids, mesh.faces, strict=True)
    ]
    edges = [
        f'<path id="{prefix}edge-{ids[a]}-{ids[b]}" d="M {place[a]} L {place[b]}"/>' for a, b in mesh.edges.tolist()
    ]
    vertices = [
        f'<circle id="{prefix}vertex-{name}" cx="{_number(size * x)}" cy="{_number(size * y)}" r="3"/>'
        for name, (x, y) in zip(ids, mesh.vertices.tolist(), strict=True)
    ]
    lines = []
    for name, elements in (("faces", faces), ("edges", edges), ("vertices", vertices)):
        lines.append(f'{indent}<g id="{prefix}{name}" {_LOOKS[name]}>')
        lines += [*(f"{indent}  {element}" for element in elements), f"{indent}</g>"]
    return lines


def _number(value: float) -> str:
    """To a thousandth of a unit, without trailing zeros."""
    return f"{round(value, 3) + 0.0:.3f}".rstrip("0").rstrip(".")


def _picture(target: Silhouette, size: int) -> str:
    """The silhouette as an `<image>`."""
    return f'  <image id="target" width="{size}" height="{size}" href="{picture_url(target, BARE)}"/>'
