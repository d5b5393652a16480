"""SVG: a mesh, or a construction step by step, as a drawing that stays editable: every element has its own id."""

from html import escape
from pathlib import Path

from autopoly_env.export.formats import Export, Format, register_format
from autopoly_env.export.pictures import picture_url
from autopoly_env.files import write_atomically
from autopoly_env.mesh import PolyMesh
from autopoly_env.mesh.drawing import drawing, groups
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import Silhouette
from autopoly_env.viewer import BARE

_INKSCAPE = "http://www.inkscape.org/namespaces/inkscape"  # for its layers; other programs pass over it


def to_svg(mesh: PolyMesh, *, size: int = 512, target: Silhouette | None = None) -> str:
    """The mesh as SVG text: the unit square is `size` user units wide, x right and y down as in the mesh.

    The groups `faces`, `edges` and `vertices` hold paths `face-<id>` and `edge-<id>-<id>` (the ids of the two ends)
    and circles `vertex-<id>`. A target comes first, as a grey picture that is part of the file.
    """
    return drawing(size, [*_background(target, size), *groups(mesh.figure, size)])


def sequence_to_svg(sequence: ConstructionSequence, *, size: int = 512, target: Silhouette | None = None) -> str:
    """All meshes of a sequence as SVG text, each a group `step-<k>` from 0, the start; only the last one is visible.

    Within it everything is as `to_svg` has it, with `step-<k>-` before its id, because an id may stand only once in a
    file: `step-3-face-7`, `step-3-vertex-12`. Inkscape shows the steps as layers, labelled with their operators.
    Programs that pass over `display:none`, Blender's import and many cutters' among them, show all steps at once.
    Raises SequenceError if the replay fails.
    """
    lines = []
    meshes, operators = sequence.meshes(), ["start", *(step.operator for step in sequence.steps)]
    for k, (mesh, operator) in enumerate(zip(meshes, operators, strict=True)):
        look = "" if k == len(sequence.steps) else ' style="display:none"'
        label = escape(f"step {k}: {operator}")
        lines.append(f'  <g id="step-{k}" inkscape:groupmode="layer" inkscape:label="{label}"{look}>')
        lines += [*groups(mesh.figure, size, f"step-{k}-", "    "), "  </g>"]
    return drawing(size, [*_background(target, size), *lines], f' xmlns:inkscape="{_INKSCAPE}"')


def _background(target: Silhouette | None, size: int) -> list[str]:
    """The line of the silhouette as an `<image>`, if there is one."""
    if target is None:
        return []
    return [f'  <image id="target" width="{size}" height="{size}" href="{picture_url(target, BARE)}"/>']


def _write(export: Export, path: Path) -> Path:
    if export.layers:
        return write_atomically(path, sequence_to_svg(export.sequence, target=export.target))
    return write_atomically(path, to_svg(export.sequence.final(), target=export.target))


register_format(
    Format(
        "svg",
        (".svg",),
        "a drawing of the last mesh to edit; all steps with --layers",
        _write,
        shows_target=True,
        options=("layers",),
    )
)
