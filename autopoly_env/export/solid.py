"""Thickness: a flat mesh as a closed solid, with its faces in front, their mirror images behind, and walls between."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.errors import ConfigError
from autopoly_env.export.triangles import Triangle, is_concave, triangulate
from autopoly_env.mesh import Face, PolyMesh, Topology
from autopoly_env.mesh.topology import HalfEdges

APART = 1e-6  # units: what programs that merge equal places, in single precision, still tell apart
MOST_DEPTH = 1e6  # units


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
    of its own, or else the wall's upright edge there would have four faces; these, and others that lie on one another,
    are drawn back into their own faces by `APART`, so that they stay apart in programs that merge equal places.

    The volume is the area of the mesh times the depth, but for that. Raises ConfigError as `check_depth` does.
    """
    check_depth(depth)
    topology = mesh.topology
    fans = fan_of_corner(topology) if depth else topology.links.tails
    n, links = max(fans) + 1, topology.links
    sources = np.empty(n, np.int64)
    sources[fans] = links.tails
    places = _parted(mesh.vertices[sources], fans, topology) if depth else mesh.vertices[sources]
    front = np.column_stack((places * (1, -1) + (0, 1), np.zeros(n)))
    corners = [tuple(fans[a:b]) for a, b in zip(links.offsets, links.offsets[1:], strict=False)]
    faces = tuple((first, *reversed(others)) for first, *others in corners)  # turning y up mirrors them
    if not depth:
        return Solid(front, faces, tuple(sources.tolist()))
    backs = tuple(tuple(v + n for v in face) for face in corners)
    rim = [(fans[h], fans[links.following[h]]) for h, twin in enumerate(links.twins) if twin < 0]
    walls = tuple((a, b, b + n, a + n) for a, b in rim)
    return Solid(np.vstack((front, front - (0, 0, depth))), faces + backs + walls, 2 * tuple(sources.tolist()))


def to_solid_obj(mesh: PolyMesh, depth: float, *, triangles: bool = False) -> str:
    """The solid as OBJ text, floats with all their digits, in convex quads and triangles, or in triangles only.

    Slicers know no other faces. Raises ConfigError as `to_solid` does.
    """
    head, vertices, faces, _ = solid_lines(mesh, depth, triangles)
    return "\n".join([*head, *vertices, *face_lines(faces)]) + "\n"


def solid_lines(
    mesh: PolyMesh, depth: float, triangles: bool
) -> tuple[list[str], list[str], list[Face], tuple[int, ...]]:
    """Comments, `v` lines and faces of a solid in OBJ, and the mesh vertex that each vertex came from."""
    solid = to_solid(mesh, depth)
    faces = [tuple(face) for face in to_triangles(solid).tolist()] if triangles else quads_and_triangles(solid)
    told = f"# AutoPoly: solid of depth {float(depth)!r}, {len(solid.vertices)} vertices, {len(faces)} faces"
    return [told], [f"v {x!r} {y!r} {z!r}" for x, y, z in solid.vertices.tolist()], faces, solid.sources


def face_lines(faces: Sequence[Face], *, is_mapped: bool = False) -> list[str]:
    """The `f` lines of OBJ; mapped faces have the `vt` of the same number at each corner."""
    corner = "{0}/{0}" if is_mapped else "{0}"
    return [" ".join(["f", *(corner.format(v + 1) for v in face)]) for face in faces]


def to_triangles(solid: Solid) -> IntArray:
    """(T, 3) the faces of a solid cut into triangles, its edges kept."""
    triangles = [tuple(face[k] for k in corners) for face in solid.faces for corners in _cuts(solid, face)]
    return np.array(triangles, np.int64)


def _cuts(solid: Solid, face: Face) -> list[Triangle]:
    ring = solid.vertices[list(face)]
    is_wall = np.ptp(ring[:, 2]) > 0.0
    return [(0, 1, 2), (0, 2, 3)] if is_wall else triangulate(ring[:, :2].tolist())


def quads_and_triangles(solid: Solid) -> list[Face]:
    """The faces of a solid, cut into triangles where they have more than four corners or are concave."""
    faces: list[Face] = []
    for face in solid.faces:
        ring = solid.vertices[list(face)]
        if len(face) <= 4 and (np.ptp(ring[:, 2]) > 0.0 or not is_concave(ring[:, :2].tolist())):
            faces.append(face)
        else:
            faces += [tuple(face[k] for k in corners) for corners in _cuts(solid, face)]
    return faces


def check_depth(depth: float) -> None:
    """Raise ConfigError for a thickness below 0, beyond a million or not finite."""
    if not 0.0 <= depth <= MOST_DEPTH:
        raise ConfigError(f"depth {depth}: expected 0 (flat) or more, at most a million, in units of the unit square")


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


def _parted(places: FloatArray, fans: list[int], topology: Topology) -> FloatArray:
    """(S, 2) where the fans go: those on the boundary that lie on one another, by `APART` into their own faces."""
    links = topology.links
    rim = [h for h, twin in enumerate(links.twins) if twin < 0]
    joined = {frozenset((fans[h], fans[links.following[h]])) for h in rim}
    close = [pair for pair in _close_pairs(places, [fans[h] for h in rim]) if frozenset(pair) not in joined]
    crowded = {fan for pair in close for fan in pair}
    arriving = {following: h for h, following in enumerate(links.following)}
    moved = places.copy()
    for h in rim:
        if fans[h] in crowded:
            moved[fans[h]] += APART * _inward(places[fans], h, links, arriving)
    return moved


def _close_pairs(places: FloatArray, fans: list[int]) -> list[tuple[int, int]]:
    """Pairs of these fans that are less than `APART` from each other."""
    order = sorted(fans, key=lambda fan: places[fan, 0])
    pairs = []
    for i, a in enumerate(order):
        for b in itertools.takewhile(lambda b: places[b, 0] - places[a, 0] < APART, order[i + 1 :]):  # noqa: B023
            if math.dist(places[a], places[b]) < APART:
                pairs.append((a, b))
    return pairs


def _inward(tails: FloatArray, rim: int, links: HalfEdges, arriving: dict[int, int]) -> FloatArray:
    """(2,) the direction that halves the angle of the fan whose boundary leaves by the half-edge `rim`."""
    vertex, towards = tails[rim], tails[links.following[rim]] - tails[rim]
    angle, h = 0.0, rim
    while h >= 0:
        a, b = tails[links.following[h]] - vertex, tails[arriving[h]] - vertex
        angle += math.atan2(a[0] * b[1] - a[1] * b[0], a @ b) % (2.0 * math.pi)
        h = links.twins[arriving[h]]
    half = math.atan2(towards[1], towards[0]) + 0.5 * angle
    return np.array((math.cos(half), math.sin(half)))
