"""Thickness: a flat mesh as a closed solid, with its faces in front, their mirror images behind, and walls between."""

import itertools
from dataclasses import dataclass

import numpy as np

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.errors import ConfigError
from autopoly_env.export.triangles import triangulate
from autopoly_env.mesh import Face, PolyMesh, Topology


@dataclass(frozen=True, eq=False)
class Solid:
    """A surface in space: x right, y up, z towards the viewer; its faces look outside."""

    vertices: FloatArray  # (S, 3) units of the unit square
    faces: tuple[Face, ...]  # n-gons
    sources: tuple[int, ...]  # (S,) the index of the mesh vertex that each came from


def to_solid(mesh: PolyMesh, depth: float) -> Solid:
    """The mesh as a solid from z = 0, where the faces are, back to z = -depth; the flat mesh itself for depth 0.

    Each face stays one n-gon in front and one behind, and each boundary edge becomes a quad. Every edge has two faces,
    which run along it in opposite directions. Where faces meet in a single vertex (a pinch), each side gets a vertex
    of its own, or else the wall's upright edge there would have four faces.

    The volume is the area of the mesh times the depth. Raises ConfigError for a depth below 0 or not finite.
    """
    check_depth(depth)
    topology = mesh.topology
    fans = fan_of_corner(topology) if depth else topology.links.tails
    n, links = max(fans) + 1, topology.links
    sources = np.empty(n, np.int64)
    sources[fans] = links.tails
    front = np.column_stack((mesh.vertices[sources] * (1, -1) + (0, 1), np.zeros(n)))
    corners = [tuple(fans[a:b]) for a, b in zip(links.offsets, links.offsets[1:], strict=False)]
    faces = tuple((first, *reversed(others)) for first, *others in corners)  # turning y up mirrors them
    if not depth:
        return Solid(front, faces, tuple(sources.tolist()))
    backs = tuple(tuple(v + n for v in face) for face in corners)
    rim = [(fans[h], fans[links.following[h]]) for h, twin in enumerate(links.twins) if twin < 0]
    walls = tuple((a, b, b + n, a + n) for a, b in rim)
    return Solid(np.vstack((front, front - (0, 0, depth))), faces + backs + walls, 2 * tuple(sources.tolist()))


def to_solid_obj(mesh: PolyMesh, depth: float) -> str:
    """The solid as OBJ text, n-gons kept and floats with all their digits. Raises ConfigError as `to_solid` does."""
    solid = to_solid(mesh, depth)
    lines = [f"# AutoPoly: solid of depth {float(depth)!r}, {len(solid.vertices)} vertices, {len(solid.faces)} faces"]
    lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in solid.vertices.tolist()]
    lines += [" ".join(["f", *(str(v + 1) for v in face)]) for face in solid.faces]
    return "\n".join(lines) + "\n"


def to_triangles(solid: Solid) -> IntArray:
    """(T, 3) the faces of a solid cut into triangles, its edges kept."""
    triangles: list[tuple[int, ...]] = []
    for face in solid.faces:
        ring = solid.vertices[list(face)]
        is_wall = np.ptp(ring[:, 2]) > 0.0
        cut = [(0, 1, 2), (0, 2, 3)] if is_wall else triangulate(ring[:, :2].tolist())
        triangles += [tuple(face[k] for k in corners) for corners in cut]
    return np.array(triangles, np.int64)


def check_depth(depth: float) -> None:
    """Raise ConfigError for a thickness below 0 or not finite."""
    if not (np.isfinite(depth) and depth >= 0.0):
        raise ConfigError(f"depth {depth}: expected 0 (flat) or more, in units of the unit square")


def fan_of_corner(topology: Topology) -> list[int]:
    """(H,) for each corner the number of its fan: the faces around a vertex that hang together by edges there.

    A vertex has one fan, a pinch several. The first fan of vertex v is v, further ones come after all vertices.
    """
    links = topology.links
    arriving = {following: h for h, following in enumerate(links.following)}
    fans = [-1] * len(links.tails)
    unused = set(range(topology.n_vertices))
    further = itertools.count(topology.n_vertices)
    for corner, v in enumerate(links.tails):
        if fans[corner] >= 0:
            continue
        fan = v if v in unused else next(further)
        unused.discard(v)
        around = [corner]
        while around:
            h = around.pop()
            if h >= 0 and fans[h] < 0:
                fans[h] = fan
                twin = links.twins[h]
                around += [links.following[twin] if twin >= 0 else -1, links.twins[arriving[h]]]
    return fans
