"""DXF for laser and vinyl cutters, by ezdxf (the extra `dxf`): the outlines of the mesh, holes among them."""

import io
from pathlib import Path
from typing import Any

from autopoly_env.export.extras import need
from autopoly_env.export.formats import Export, Format, check_size, register_format
from autopoly_env.export.printable import MILLIMETRES
from autopoly_env.export.replay import finite_meshes
from autopoly_env.files import write_atomically
from autopoly_env.mesh import PolyMesh

LAYER = "CUT"
FOLDS = "EDGES"  # what lies inside, on a layer that is off, which some programs draw and cut all the same
VERSION = "R2010"
RED, GREY = 1, 8  # of the AutoCAD colour index


def to_dxf(mesh: PolyMesh, size: float = MILLIMETRES, *, layers: bool = False) -> str:
    """The drawing as text, the unit square `size` millimetres wide, y up.

    Each loop of the boundary is a closed LWPOLYLINE on the layer `CUT`, counter-clockwise around material, clockwise
    around holes. With `layers` the edges between faces are LINEs on the layer `EDGES`, which is off. Raises ConfigError
    without ezdxf and for a size that is none.
    """
    side, ezdxf = check_size(size), need("ezdxf", "ezdxf", "dxf")
    places = (side * (mesh.vertices * (1, -1) + (0, 1))).tolist()
    before = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True  # no dates: the same mesh gives the same bytes
    try:
        drawing = ezdxf.new(VERSION, units=ezdxf.units.MM)
        _draw_outlines(drawing, mesh, places)
        if layers:
            _draw_folds(drawing, mesh, places)
        stream = io.StringIO()
        drawing.write(stream)
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before
    return stream.getvalue()


def _draw_outlines(drawing: Any, mesh: PolyMesh, places: list[list[float]]) -> None:
    drawing.layers.add(LAYER, color=RED)
    space = drawing.modelspace()
    for loop in mesh.topology.boundary_loops:
        space.add_lwpolyline([places[v] for v in loop[::-1]], close=True, dxfattribs={"layer": LAYER})


def _draw_folds(drawing: Any, mesh: PolyMesh, places: list[list[float]]) -> None:
    drawing.layers.add(FOLDS, color=GREY).off()
    space = drawing.modelspace()
    for (a, b), is_rim in zip(mesh.edges.tolist(), mesh.topology.is_boundary_edge, strict=True):
        if not is_rim:
            space.add_line(places[a], places[b], dxfattribs={"layer": FOLDS})


def _write(export: Export, path: Path) -> Path:
    mesh = finite_meshes(export.sequence)[-1]
    size = MILLIMETRES if export.size is None else export.size
    return write_atomically(path, to_dxf(mesh, size, layers=export.layers))


register_format(
    Format("dxf", (".dxf",), "the outlines in millimetres, for cutters (extra dxf)", _write, options=("size", "layers"))
)
