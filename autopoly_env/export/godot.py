"""Godot 4: a scene with the mesh as a Polygon2D, and a body whose collision shapes are convex pieces of it."""

from collections.abc import Iterable
from pathlib import Path

from autopoly_env.export.convex import PIXELS, Place, convex_pieces
from autopoly_env.export.formats import Export, Format, check_size, register_format
from autopoly_env.export.replay import finite_meshes, sequence_name
from autopoly_env.files import write_atomically
from autopoly_env.mesh import PolyMesh

COLOUR = (0.6, 0.72, 0.89, 1.0)
_NOT_IN_NAMES = '.:@/"%\\'  # of nodes


def to_tscn(mesh: PolyMesh, name: str = "AutoPoly", size: float = PIXELS) -> str:
    """The scene as text (format 3), the unit square `size` pixels wide, x right and y down as in the mesh.

    A StaticBody2D of that name has a `Polygon2D`, whose polygons are the faces, holes left open, and a
    `CollisionPolygon2D` for each convex piece, which the engine need not cut. Raises ConfigError for a size that is
    none.
    """
    side = check_size(size)
    faces = ", ".join(f"PackedInt32Array({', '.join(map(str, face))})" for face in mesh.faces)
    lines = [
        "[gd_scene format=3]",
        "",
        f'[node name="{_node_name(name)}" type="StaticBody2D"]',
        "",
        '[node name="Polygon2D" type="Polygon2D" parent="."]',
        f"color = Color({', '.join(map(str, COLOUR))})",
        f"polygon = {_places(mesh.vertices.tolist(), side)}",
        f"polygons = [{faces}]",
    ]
    for number, piece in enumerate(convex_pieces(mesh), 1):
        lines += ["", f'[node name="CollisionPolygon2D{number}" type="CollisionPolygon2D" parent="."]']
        lines.append(f"polygon = {_places(piece, side)}")
    return "\n".join(lines) + "\n"


def _node_name(name: str) -> str:
    kept = (sign if sign.isprintable() and sign not in _NOT_IN_NAMES else "_" for sign in name)
    return "".join(kept).strip() or "AutoPoly"


def _places(points: Iterable[Place], side: float) -> str:
    return f"PackedVector2Array({', '.join(f'{side * x:.9g}, {side * y:.9g}' for x, y in points)})"


def _write(export: Export, path: Path) -> Path:
    size = PIXELS if export.size is None else export.size
    mesh = finite_meshes(export.sequence)[-1]
    return write_atomically(path, to_tscn(mesh, sequence_name(export.sequence), size))


register_format(
    Format("godot", (".tscn",), "a scene of Godot 4: Polygon2D and convex collision shapes", _write, options=("size",))
)
