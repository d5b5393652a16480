"""STL, binary: what every slicer reads. It knows no units; ours are millimetres, as slicers take them."""

import os
from pathlib import Path

import numpy as np

from autopoly_env.export.formats import Export, Format, register_format
from autopoly_env.export.printable import Body, body_of
from autopoly_env.files import write_atomically

HEADER = b"AutoPoly, binary STL, millimetres"  # no "solid" at its head, which stands for the text form
RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def to_stl(body: Body) -> bytes:
    """The body as binary STL: 80 bytes of header, the number of triangles, 50 bytes for each."""
    records = np.zeros(len(body.triangles), RECORD)
    a, b, c = np.moveaxis(body.corners, 1, 0)
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    records["normal"] = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0.0)
    records["corners"] = body.corners
    return HEADER.ljust(80) + np.array(len(records), "<u4").tobytes() + records.tobytes()


def save_stl(body: Body, path: str | os.PathLike[str]) -> Path:
    """Write a body as binary STL, whole or not at all. Raises OutputError if it cannot be written."""
    return write_atomically(path, to_stl(body))


def _write(export: Export, path: Path) -> Path:
    return save_stl(body_of(export), path)


register_format(
    Format(
        "stl",
        (".stl",),
        "triangles in millimetres for slicers; --depth makes it solid",
        _write,
        shows_depth=True,
        options=("size",),
    )
)
