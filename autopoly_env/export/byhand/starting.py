"""How the mesh that a construction starts from is built by hand: a plane whose corners are moved, or face by face."""

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from autopoly_env.export.byhand.hand import Hand, Place, is_close
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators.deeds import Ids, Press, Selection

PLANE: tuple[Place, ...] = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))  # Blender's, counter-clockwise
CORNERS = ("the lower left corner", "the lower right corner", "the upper right corner", "the upper left corner")
_CENTRE = (0.0, 0.0)


def begin(hand: Hand, mesh: PolyMesh, wanted: Mapping[int, Place]) -> None:
    """Build a mesh whose vertices belong at `wanted`, in a new scene."""
    rings = {
        name: tuple(mesh.vertex_ids[v] for v in reversed(face))
        for name, face in zip(mesh.face_ids, mesh.faces, strict=True)
    }
    is_quad = len(rings) == 1 and len(mesh.vertices) == 4
    ring = next(iter(rings.values())) if is_quad else (-1, -2, -3, -4)
    if is_quad:
        ring = min((_turned(ring, k) for k in range(4)), key=lambda turned: _distance(turned, wanted))
    hand.note({"do": "add", "keys": ["Shift", "A"], "entry": "Mesh › Plane"})
    hand.end_line("`Shift` `A` › Mesh › Plane, in the middle of the world (`Shift` `C` puts the 3D cursor there)")
    hand.note({"do": "view", "keys": ["Numpad 7"]})
    hand.end_line("`Numpad 7`, or View › Viewpoint › Top: look from above")
    hand.places = dict(zip(ring, PLANE, strict=True))
    hand.rings = {mesh.face_ids[0]: ring}
    hand.mode, hand.selected = "vertex", {(v,) for v in ring}
    hand.note({"do": "tab", "keys": ["Tab"]})
    hand.end_line("`Tab`: edit mode")
    if is_quad:
        _move_corners(hand, ring, wanted)
        hand.know(mesh, {})
    else:
        _build(hand, mesh, rings, wanted)


def _move_corners(hand: Hand, ring: Ids, wanted: Mapping[int, Place]) -> None:
    for k, (vertex, corner) in enumerate(zip(ring, CORNERS, strict=True)):
        hand.names[vertex] = f"{corner} (vertex {vertex})"
        if not is_close(hand.places[vertex], wanted[vertex]):
            hand.move([vertex], wanted[vertex], afresh=k == 0)
    hand.names.clear()


def _build(hand: Hand, mesh: PolyMesh, rings: Mapping[int, Ids], wanted: Mapping[int, Place]) -> None:
    """Vertex after vertex from a single one, edge after edge, and each face filled."""
    first = next(iter(rings.values()))[0]
    hand.places, hand.rings = {first: _CENTRE}, {}
    hand.press(Press(("M",), "At Center", leaves=Selection("vertex", ((first,),)), effect="one vertex is left"))
    hand.move([first], wanted[first])
    for name, ring in rings.items():
        known = [k for k, v in enumerate(ring) if v in hand.places]
        if not known:
            hand.select(Selection("vertex", ((next(iter(hand.places)),),)))
            hand.grow("Shift D", ring[0], wanted[ring[0]])
        turned = _turned(ring, known[0] if known else 0)
        for a, b in pairwise((*turned, turned[0])):
            _join(hand, a, b, wanted)
        hand.select(Selection("edge", tuple(pairwise((*turned, turned[0])))))
        hand.rings[name] = turned
        hand.press(Press(("F",), leaves=Selection("face", ((name,),)), effect=f"fills face {name}"))
    hand.know(mesh, {})


def _join(hand: Hand, a: int, b: int, wanted: Mapping[int, Place]) -> None:
    """An edge from a to b, where there is none."""
    if b not in hand.places:
        if hand.mode != "vertex" or hand.selected != {(a,)}:
            hand.select(Selection("vertex", ((a,),)))
        hand.grow("E", b, wanted[b])
    elif not hand.has_edge(a, b):
        hand.select(Selection("vertex", ((a,), (b,))))
        hand.press(Press(("F",), leaves=Selection("vertex", ((a,), (b,))), effect="joins them with an edge"))
        hand.wires.add((min(a, b), max(a, b)))


def _turned(ring: Ids, k: int) -> Ids:
    return ring[k:] + ring[:k]


def _distance(ring: Ids, wanted: Mapping[int, Place]) -> float:
    """How far the corners of the plane are from their places, squared and summed, up to a common move."""
    away = np.array([wanted[v] for v in ring]) - np.array(PLANE)
    return float(((away - away.mean(axis=0)) ** 2).sum())
