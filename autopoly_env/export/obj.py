"""Wavefront OBJ: the mesh as other modelling programs read and write it, n-gons and all."""

import os
from pathlib import Path

from autopoly_env.errors import MeshError
from autopoly_env.export.formats import Export, Format, register_format
from autopoly_env.export.half import check_flat, halved
from autopoly_env.export.solid import face_lines, solid_lines, to_solid_obj
from autopoly_env.export.texture import Texture
from autopoly_env.export.triangles import is_concave, triangulate
from autopoly_env.files import read_text, write_atomically
from autopoly_env.mesh import Face, PolyMesh

MOST_BYTES = 16_000_000  # of a file
WAY_OUT = "agents.export --to obj --triangles cuts them"


def to_obj(mesh: PolyMesh, *, triangles: bool = False, half: bool = False) -> str:
    """The mesh as OBJ text: in the unit square at z = 0 with y up, floats with all their digits.

    Faces keep their n corners and their first one, or are cut into triangles. They run the other way round than in
    `mesh`, because turning y up mirrors the picture: a face of positive area has positive area there too, and looks
    towards +z. Where n-gons are concave a line at the top says so: many readers take them for larger than they are.
    Of a `half` the axis is x = 0, where programs mirror. Raises OutputError for the half of a mesh that has none.

    >>> print(to_obj(PolyMesh.rectangle(0.0, 0.0, 1.0, 0.5)), end="")
    # AutoPoly: 4 vertices, 4 edges, 1 face; unit square, y up
    v 0.0 1.0 0
    v 1.0 1.0 0
    v 1.0 0.5 0
    v 0.0 0.5 0
    f 1 4 3 2
    """
    head, vertices, faces = _flat_lines(*_part(mesh, half), triangles)
    return "\n".join([*head, *vertices, *face_lines(faces)]) + "\n"


def _part(mesh: PolyMesh, half: bool) -> tuple[PolyMesh, float | None]:
    """The mesh, or the half of it and the axis."""
    return halved(mesh) if half else (mesh, None)


def _flat_lines(mesh: PolyMesh, axis: float | None, triangles: bool) -> tuple[list[str], list[str], list[Face]]:
    """Comments, `v` lines and faces of a flat mesh, y up; of a half with its axis at x = 0."""
    n_vertices, n_edges, n_faces = mesh.counts
    told = f"{n_faces} face" + ("s" if n_faces != 1 else "")
    head = [f"# AutoPoly: {n_vertices} vertices, {n_edges} edges, {told}; unit square, y up"]
    points, faces = mesh.vertices.tolist(), list(mesh.faces)
    rings = [[points[v] for v in face] for face in faces]
    if triangles:
        pairs = zip(mesh.faces, rings, strict=True)
        faces = [tuple(face[k] for k in cut) for face, ring in pairs for cut in triangulate(ring)]
        head.append(f"# cut into {len(faces)} triangles")
    elif n_concave := sum(map(is_concave, rings)):
        head.append(f"# {n_concave} of them concave, which some readers fan from a corner: {WAY_OUT}")
    if axis is not None:
        head.append(f"# half of a mesh, cut at x = {axis!r}, which is x = 0 here: a mirror makes it whole")
    vertices = [f"v {x - (axis or 0.0)!r} {(1.0 - y)!r} 0" for x, y in points]
    return head, vertices, [(first, *reversed(others)) for first, *others in faces]


def save_textured_obj(
    mesh: PolyMesh,
    path: str | os.PathLike[str],
    texture: Texture,
    depth: float = 0.0,
    *,
    triangles: bool = False,
    half: bool = False,
) -> Path:
    """Write the mesh, or its solid, as OBJ with the picture on it: beside it NAME.mtl and NAME.texture.png.

    Each vertex has its place in the picture (`vt`, v up). Raises OutputError if a file cannot be written.
    """
    path = Path(path)
    stem = "".join(sign if sign.isprintable() and not sign.isspace() else "_" for sign in path.stem) or "mesh"
    picture, material = path.with_name(f"{stem}.texture.png"), path.with_name(f"{stem}.mtl")
    if depth:
        head, vertices, faces, sources = solid_lines(mesh, depth, triangles)
        places = texture.places(mesh.vertices)[list(sources)]
    else:
        mesh, axis = _part(mesh, half)
        head, vertices, faces = _flat_lines(mesh, axis, triangles)
        places = texture.places(mesh.vertices)
    uses = [f"mtllib {material.name}", "usemtl picture"]
    mapped = [f"vt {u!r} {(1.0 - v)!r}" for u, v in places.tolist()]
    lines = [*head, *uses, *vertices, *mapped, *face_lines(faces, is_mapped=True)]
    write_atomically(picture, texture.png)
    write_atomically(material, f"newmtl picture\nKd 1 1 1\nillum 1\nmap_Kd {picture.name}\n")
    return write_atomically(path, "\n".join(lines) + "\n")


def from_obj(text: str) -> PolyMesh:
    """The mesh in OBJ text, as `to_obj` writes it: seen from +z, y up, z left out; vertex ids are 0, 1, ... in order.

    Read are `v` and `f` lines, of a corner such as `3/1/2` the vertex only; all others are passed over. Faces may be
    wound either way, as long as all are wound alike. Raises MeshError naming the line that is wrong, or for what
    is no valid mesh.

    >>> from_obj("v 0 0 0\\nv 1 0 0\\nv 1 1 0\\nf 1 2 3").faces
    ((0, 2, 1),)
    """
    points: list[tuple[float, float]] = []
    faces: list[tuple[int, ...]] = []
    for number, line in enumerate(text.replace("\\\n", " ").splitlines(), 1):
        word, *values = line.split("#", 1)[0].split() or [""]
        try:
            if word == "v":
                if len(values) < 3:
                    raise ValueError("expected v x y z")
                points.append((float(values[0]), 1.0 - float(values[1])))
            elif word == "f":
                if len(values) < 3:
                    raise ValueError("expected a face of at least 3 corners")
                faces.append(tuple(_vertex(value, len(points)) for value in values))
        except ValueError as error:
            raise MeshError(f"line {number} of the OBJ text, {line.strip()[:40]!r}: {error}") from None
    if not points or not faces:
        raise MeshError(f"the OBJ text has {len(points)} vertices and {len(faces)} faces; expected v and f lines")
    backwards = [(first, *reversed(others)) for first, *others in faces]
    mesh = PolyMesh.from_faces(points, backwards)
    return mesh if (mesh.face_areas() > 0.0).any() else PolyMesh.from_faces(points, faces)


def load_obj(path: str | os.PathLike[str]) -> PolyMesh:
    """The mesh in an OBJ file. Raises MeshError as `from_obj`, or if the file cannot be read."""
    try:
        text = read_text(path, MOST_BYTES)
    except OSError as error:
        raise MeshError(f"cannot read {path} ({error.strerror}); give an OBJ file") from None
    try:
        return from_obj(text)
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from None


def _vertex(corner: str, n_vertices: int) -> int:
    """The index, from 0, of a corner's vertex; a negative number counts from the last vertex so far."""
    number = int(corner.split("/", 1)[0])
    if not 1 <= abs(number) <= n_vertices:
        raise ValueError(f"vertex {number} is not among the {n_vertices} so far")
    return number - 1 if number > 0 else n_vertices + number


def _write(export: Export, path: Path) -> Path:
    mesh, depth, triangles, half = export.sequence.final(), export.depth, export.triangles, export.half
    if half:
        check_flat(depth)
    if export.texture:
        return save_textured_obj(mesh, path, export.texture, depth, triangles=triangles, half=half)
    text = to_solid_obj(mesh, depth, triangles=triangles) if depth else to_obj(mesh, triangles=triangles, half=half)
    return write_atomically(path, text)


register_format(
    Format(
        "obj",
        (".obj",),
        "the last mesh, with its n-gons; a solid with --depth",
        _write,
        shows_depth=True,
        options=("triangles", "texture", "half"),
    )
)
