"""Convex pieces of a mesh, for physics engines; and as the map of Tiled that many engines read (`--to convex-json`)."""

import json
import math
from pathlib import Path

from autopoly_env.export.formats import Export, Format, check_size, register_format
from autopoly_env.export.replay import finite_meshes, sequence_name
from autopoly_env.export.triangles import TINY, triangulate
from autopoly_env.files import write_atomically
from autopoly_env.mesh import PolyMesh

MOST_CORNERS = 8  # of a piece: what Box2D takes
PIXELS = 512.0  # the side of the unit square, where nobody says

Ring = list[int]
Place = tuple[float, float]


def convex_pieces(mesh: PolyMesh, most_corners: int = MOST_CORNERS) -> list[list[Place]]:
    """Convex polygons that cover what the faces cover, of 3 to `most_corners` corners: unit square, x right, y down.

    All faces are cut into triangles, which are joined, over the longest edges first, as long as a piece stays convex
    (Hertel and Mehlhorn 1983: at most four times as many pieces as are needed, of each face). Pieces are wound as the
    faces are; corners on a straight line and triangles without area are left out.
    """
    points = [(x, y) for x, y in mesh.vertices.tolist()]
    pieces: dict[int, Ring] = {}
    for face in mesh.faces:
        for cut in triangulate([points[v] for v in face]):
            ring = [face[k] for k in cut]
            turn = _turn(*(points[v] for v in ring))
            if abs(turn) > TINY:
                pieces[len(pieces)] = ring if turn > 0.0 else ring[::-1]
    owners = {(ring[k - 1], v): name for name, ring in pieces.items() for k, v in enumerate(ring)}
    inner = [(a, b) for a, b in owners if a < b and (b, a) in owners]
    for a, b in sorted(inner, key=lambda edge: (-math.dist(points[edge[0]], points[edge[1]]), edge)):
        left, right = owners[(a, b)], owners[(b, a)]
        joined = _joined(pieces[left], pieces[right], a, b)
        if len(joined) <= most_corners and _is_convex(joined, points):
            owners |= {(pieces[right][k - 1], v): left for k, v in enumerate(pieces[right])}
            pieces[left] = joined
            del pieces[right]
    return [_corners(ring, points) for ring in pieces.values()]


def to_convex_json(mesh: PolyMesh, name: str = "AutoPoly", size: float = PIXELS) -> str:
    """The pieces as polygons of one object layer of a Tiled map, the unit square `size` pixels wide.

    Raises ConfigError for a size that is none.
    """
    side = check_size(size)
    pieces = [[(side * x, side * y) for x, y in piece] for piece in convex_pieces(mesh)]
    objects = [
        {"id": k, "name": f"piece {k}", "type": "", "x": 0, "y": 0, "width": 0, "height": 0, "rotation": 0}
        | {"visible": True, "polygon": [{"x": x, "y": y} for x, y in piece]}
        for k, piece in enumerate(pieces, 1)
    ]
    layer = {"id": 1, "name": name, "type": "objectgroup", "draworder": "topdown", "x": 0, "y": 0}
    tile = math.ceil(side)
    document = {"type": "map", "version": "1.10", "tiledversion": "1.10.2", "orientation": "orthogonal"} | {
        "renderorder": "right-down", "infinite": False, "width": 1, "height": 1, "tilewidth": tile, "tileheight": tile,
        "nextlayerid": 2, "nextobjectid": len(objects) + 1, "tilesets": [],
        "layers": [layer | {"opacity": 1, "visible": True, "objects": objects}],
    }  # fmt: skip
    return json.dumps(document, indent=1) + "\n"


def _turn(a: Place, b: Place, c: Place) -> float:
    """Twice the signed area."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _joined(left: Ring, right: Ring, a: int, b: int) -> Ring:
    """Two pieces as one, without the edge between them, which the left one runs along from a to b."""
    i, j = left.index(b), right.index(a)
    return [*left[i:], *left[:i], *(right[j:] + right[:j])[1:-1]]


def _is_convex(ring: Ring, points: list[Place]) -> bool:
    """Whether no corner turns back and the ring goes round but once."""
    if len(set(ring)) < len(ring):
        return False
    places = [points[v] for v in ring]
    turned = 0.0
    for k, here in enumerate(places):
        before, after = places[k - 1], places[(k + 1) % len(places)]
        turn = _turn(before, here, after)
        if turn < 0.0:
            return False
        a, b = (here[0] - before[0], here[1] - before[1]), (after[0] - here[0], after[1] - here[1])
        turned += math.atan2(turn, a[0] * b[0] + a[1] * b[1])
    return turned < 2.0 * math.pi + 0.1


def _corners(ring: Ring, points: list[Place]) -> list[Place]:
    """The places of a piece's corners, without those on a straight line."""
    places = [points[v] for v in ring]
    n = len(places)
    return [p for k, p in enumerate(places) if _turn(places[k - 1], p, places[(k + 1) % n]) > TINY]


def _write(export: Export, path: Path) -> Path:
    size = PIXELS if export.size is None else export.size
    mesh = finite_meshes(export.sequence)[-1]
    return write_atomically(path, to_convex_json(mesh, sequence_name(export.sequence), size))


register_format(
    Format(
        "convex-json",
        (".convex.json",),
        "convex pieces for physics engines, as a map of Tiled",
        _write,
        options=("size",),
    )
)
