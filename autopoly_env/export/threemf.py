"""3MF: what printers' programs read, with units and one vertex for each place (core specification 1.3)."""

import io
import os
import zipfile
from html import escape
from pathlib import Path

from autopoly_env.export.formats import Export, Format, register_format
from autopoly_env.export.printable import Body, body_of
from autopoly_env.export.replay import sequence_name
from autopoly_env.files import write_atomically

MODEL = "3D/3dmodel.model"
_HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
_TYPES = f"""{_HEAD}<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
 <Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
 <Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
"""
_RELATIONS = f"""{_HEAD}<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
 <Relationship Target="/{MODEL}" Id="model" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
"""
_LONG_AGO = (1980, 1, 1, 0, 0, 0)  # the time of every part: the same body gives the same bytes


def to_3mf(body: Body, name: str = "AutoPoly") -> bytes:
    """The body as a 3MF package: one object of that name, in millimetres, "surface" if it is flat."""
    kind = "model" if body.is_closed else "surface"
    lines = [
        f'{_HEAD}<model unit="millimeter" xml:lang="en-US"',
        ' xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">',
        ' <metadata name="Application">AutoPoly</metadata>',
        f' <resources>\n  <object id="1" type="{kind}" name="{escape(name)}">\n   <mesh>\n    <vertices>',
        *(f'     <vertex x="{x:.9g}" y="{y:.9g}" z="{z:.9g}"/>' for x, y, z in body.vertices.tolist()),
        "    </vertices>\n    <triangles>",
        *(f'     <triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in body.triangles.tolist()),
        "    </triangles>\n   </mesh>\n  </object>\n </resources>",
        ' <build>\n  <item objectid="1"/>\n </build>\n</model>\n',
    ]
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as package:
        for part, text in (("[Content_Types].xml", _TYPES), ("_rels/.rels", _RELATIONS), (MODEL, "\n".join(lines))):
            package.writestr(zipfile.ZipInfo(part, _LONG_AGO), text, zipfile.ZIP_DEFLATED)
    return stream.getvalue()


def save_3mf(body: Body, path: str | os.PathLike[str], name: str = "AutoPoly") -> Path:
    """Write a body as 3MF, whole or not at all. Raises OutputError if it cannot be written."""
    return write_atomically(path, to_3mf(body, name))


def _write(export: Export, path: Path) -> Path:
    return save_3mf(body_of(export), path, sequence_name(export.sequence))


register_format(
    Format(
        "3mf",
        (".3mf",),
        "the same with units in it, for printers' programs",
        _write,
        shows_depth=True,
        options=("size",),
    )
)
